# SPDX-License-Identifier: GPL-3.0-or-later
"""Variables in the panel: their list, bounds, units, names, and what resets and removes them."""

from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy.types import Operator, UIList

from . import edits, project, view
from .amending import amend

UNITS = (
    ("NONE", "None", "A plain number; lengths in metres, angles in radians"),
    ("m", "m", "Metres"),
    ("cm", "cm", "Centimetres"),
    ("mm", "mm", "Millimetres"),
    ("in", "in", "Inches"),
    ("ft", "ft", "Feet"),
    ("rad", "rad", "Radians"),
    ("deg", "deg", "Degrees"),
    ("%", "%", "Hundredths"),
)
"""For the menu; Blender knows no empty name."""

MOST_SLIDERS = 24


def unit_text(choice: str) -> str:
    """A unit as cases write it, from the menu's name."""
    return "" if choice == "NONE" else choice


def unit_choice(unit: str) -> str:
    """The menu's name of a unit."""
    return unit or "NONE"


class MOLDLINE_UL_variables(UIList):
    """Variables of the case, each with its unit and how many numbers it has."""

    bl_idname = "MOLDLINE_UL_variables"

    def draw_item(
        self, context, layout, data, item, icon, active_data, active_propname, index=0, flt_flag=0
    ):
        """A row: the name, and how many numbers in which unit."""
        table = edits.variables(view.case_of(context.scene)).get(item.name, {})
        row = layout.row(align=True)
        row.label(text=item.name, icon="DRIVER", translate=False)
        row.label(text=summary(table), translate=False)


def summary(table: dict[str, Any]) -> str:
    """Size and unit of a variable in few letters: 4 numbers [deg]."""
    size, unit = edits.size_of(table), table.get("unit", "")
    return " ".join(filter(None, [f"{size} numbers" if size > 1 else "", unit and f"[{unit}]"]))


class MOLDLINE_OT_edit_variable(Operator):
    """Change the active variable's name, bounds, unit and typical change"""

    bl_idname = "moldline.edit_variable"
    bl_label = "Edit Variable"
    bl_options = {"REGISTER"}

    name: StringProperty(name="Name", description="One word; links follow it")
    bounded: BoolProperty(
        name="Bounds", description="Whether its numbers have bounds", default=True
    )
    lower: FloatProperty(name="Lower", description="Lower bound of all its numbers, in its unit")
    upper: FloatProperty(name="Upper", description="Upper bound of all its numbers, in its unit")
    keep_bounds: BoolProperty(
        name="Keep Each Number's Own",
        description="Leave the bounds, which differ from number to number, as they are",
    )
    unit: EnumProperty(
        name="Unit",
        description="The unit that its numbers are in; they are converted, the shape stays",
        items=UNITS,
    )
    typical: FloatProperty(
        name="Typical Change",
        description="A change that matters, for steps and optimisers; 0: a tenth of the bounds",
        min=0.0,
    )

    @classmethod
    def poll(cls, context):
        """Needs an active variable."""
        return bool(view.active_variable(context.scene))

    def invoke(self, context, event):
        """Begin with what the variable is."""
        self.name = view.active_variable(context.scene)
        table = edits.variables(view.case_of(context.scene))[self.name]
        pairs = edits.bounds_of(table)
        self.bounded = "bounds" in table
        self.keep_bounds = any(pair != pairs[0] for pair in pairs)
        self.lower, self.upper = (x if abs(x) < 3e38 else 0.0 for x in pairs[0])
        self.unit = unit_choice(table.get("unit", ""))
        self.typical = table.get("typical", 0.0)
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context):
        """The dialog."""
        layout = self.layout
        layout.use_property_split = True
        for key in ("name", "unit", "bounded", "keep_bounds"):
            layout.prop(self, key)
        column = layout.column()
        column.enabled = self.bounded and not self.keep_bounds
        column.prop(self, "lower")
        column.prop(self, "upper")
        layout.prop(self, "typical")

    def execute(self, context):
        """Change the case."""
        case, old = view.case_of(context.scene), view.active_variable(context.scene)
        new, was = self.name.strip() or old, edits.variables(case)[old].get("unit", "")
        unit = unit_text(self.unit) if self.properties.is_property_set("unit") else was
        try:
            edits.check_name(new, (), "variable")
            table = edits.in_unit(edits.variables(case)[old], unit)
            wanted = _described(table, self) if not self.keep_bounds else table
            if self.typical > 0:
                wanted["typical"] = edits.tidy(self.typical)
            changed = edits.changed_variable(case, old, new, wanted)
        except edits.Wrong as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        values = project.values(context.scene).get(old)
        factor = edits.UNITS[was] / edits.UNITS[unit]

        def then(scene: Any) -> None:
            view.choose(scene, variable=new)
            if values is not None and (new != old or factor != 1.0):
                project.set_values(scene, {new: np.asarray(values) * factor})

        return amend(self, context, "changing a variable", changed, then)


def _described(table: dict[str, Any], asked: Any) -> dict[str, Any]:
    """The table with the bounds that were asked for; a script that says none keeps them."""
    if not any(asked.properties.is_property_set(key) for key in ("bounded", "lower", "upper")):
        return dict(table)
    found = {key: value for key, value in table.items() if key != "bounds"}
    if asked.bounded:
        found["bounds"] = edits.check_bounds(asked.lower, asked.upper)
    return found


class MOLDLINE_OT_remove_variable(Operator):
    """Remove the active variable and all its links; what it moved stays where the case began"""

    bl_idname = "moldline.remove_variable"
    bl_label = "Remove Variable"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Needs an active variable."""
        return bool(view.active_variable(context.scene))

    def execute(self, context):
        """Change the case."""
        name = view.active_variable(context.scene)
        gone = edits.removed_variable(view.case_of(context.scene), name)
        return amend(self, context, "removing a variable", gone)


class MOLDLINE_OT_bound_variable(Operator):
    """Set the active variable's bounds around its present values, or take them away"""

    bl_idname = "moldline.bound_variable"
    bl_label = "Bounds around Present Values"
    bl_options = {"REGISTER"}

    how: EnumProperty(
        name="Reach",
        description="How far the bounds are from the present values",
        items=(
            ("DISTANCE", "Distance", "By so much to both sides, in the variable's unit"),
            ("SHARE", "Share", "By a share of each value, in hundredths"),
            ("FREE", "No Bounds", "Every value is allowed"),
        ),
    )
    reach: FloatProperty(
        name="Distance", description="To both sides, in the variable's unit", default=1.0, min=0.0
    )
    share: FloatProperty(
        name="Share",
        description="Of each value, to both sides",
        default=20.0,
        min=0.0,
        subtype="PERCENTAGE",
    )

    @classmethod
    def poll(cls, context):
        """Needs an active variable."""
        return bool(view.active_variable(context.scene))

    def invoke(self, context, event):
        """Ask how far."""
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context):
        """The dialog."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "how")
        if self.how != "FREE":
            layout.prop(self, "share" if self.how == "SHARE" else "reach")

    def execute(self, context):
        """Change the case."""
        name = view.active_variable(context.scene)
        table = edits.variables(view.case_of(context.scene))[name]
        if self.how == "FREE":
            gone = [{"remove": ["variable", name, "bounds"]}] if "bounds" in table else []
            return amend(self, context, "removing bounds", gone)
        values = project.values(context.scene)[name]
        by_share = self.how == "SHARE"
        try:
            pairs = edits.bounds_around(
                list(values), self.share / 100 if by_share else self.reach, by_share
            )
        except edits.Wrong as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        start = [{"set": ["variable", name, "value"], "to": [float(x) for x in values]}]
        wanted = [*start, {"set": ["variable", name, "bounds"], "to": pairs}]
        return amend(self, context, "setting bounds", wanted)


class MOLDLINE_OT_reset_values(Operator):
    """Put the active variable, or all of them, back to the values that the case begins with"""

    bl_idname = "moldline.reset_values"
    bl_label = "Reset Values"
    bl_options = {"REGISTER", "UNDO"}

    all: BoolProperty(name="All Variables", description="Else only the active one")

    @classmethod
    def poll(cls, context):
        """Needs a variable."""
        return bool(view.active_variable(context.scene))

    def execute(self, context):
        """Set the values; the shape follows."""
        known = edits.variables(view.case_of(context.scene))
        chosen = list(known) if self.all else [view.active_variable(context.scene)]
        project.set_values(
            context.scene, {name: np.array(edits.values_of(known[name])) for name in chosen}
        )
        return {"FINISHED"}


CLASSES = (
    MOLDLINE_UL_variables,
    MOLDLINE_OT_edit_variable,
    MOLDLINE_OT_remove_variable,
    MOLDLINE_OT_bound_variable,
    MOLDLINE_OT_reset_values,
)

_make_known, _take_away = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Make them known to Blender, and what they stand on."""
    from . import linking

    view.register()
    _make_known()
    linking.register()


def unregister() -> None:
    """Take them away."""
    from . import linking

    linking.unregister()
    _take_away()
    view.unregister()
