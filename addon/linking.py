# SPDX-License-Identifier: GPL-3.0-or-later
"""New variables: from selected control points, by stations of a lattice, by a skeleton's names."""

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy.types import Operator

from . import choosing, edits, project, view
from .amending import amend
from .variables import UNITS, unit_text

WAYS = (
    ("SELECTION", "Selected Control Points", "Of the active handle, in edit mode or as left there"),
    (
        "STATIONS",
        "Stations of the Lattice",
        "A number for each row of control points along an axis",
    ),
    (
        "NAMED",
        "Named Parameter",
        "What a skeleton or hinge measures: span, chord, sweep, twist ...",
    ),
)
AXES = (
    ("x", "X", "Along the first axis: a lattice's own edge, of other nets the axis of space"),
    ("y", "Y", "Along the second axis"),
    ("z", "Z", "Along the third axis"),
)
NORMAL = (
    "NORMAL",
    "Surface Normal",
    "Along the mean outward normal of the surface next to the selected control points",
)
MIRRORS = (
    ("NONE", "Not", "Only the chosen control points move"),
    ("x", "About X = 0", "Those at x > 0 move, those at x < 0 as their mirror images"),
    ("y", "About Y = 0", "Those at y > 0 move, those at y < 0 as their mirror images: both wings"),
    ("z", "About Z = 0", "Those at z > 0 move, those at z < 0 as their mirror images"),
)
MOVES = (
    ("GROUP", "Together", "One number moves all of them by the same"),
    ("EACH", "One by One", "A number for each of them"),
)
KINDS = (
    ("thickness", "Thickness", "The two sides of the box move apart: the number is the growth"),
    ("camber", "Camber", "Both sides of the box move together"),
    ("radius", "Radius", "The section grows: each side moves outwards by the number"),
)
SHOWN = {
    "SELECTION": ("axis", "moves", "mirrored"),
    "STATIONS": ("kind", "along", "axis", "mirrored"),
    "NAMED": ("parameter", "absolute"),
}


def _parameters(self: Any, context: Any, typed: str) -> list[str]:
    return choosing.parameters(context)


class MOLDLINE_OT_add_variable(Operator):
    """Define a variable: a named number, or several, that move control points or bones"""

    bl_idname = "moldline.add_variable"
    bl_label = "New Variable"
    bl_options = {"REGISTER"}

    by: EnumProperty(name="Moves", description="What the variable moves", items=WAYS)
    name: StringProperty(name="Name", description="One word: what the variable is called")
    axis: EnumProperty(
        name="Direction", description="Where to it moves", items=(*AXES, NORMAL), default="z"
    )
    moves: EnumProperty(name="Numbers", description="Of one variable", items=MOVES)
    mirrored: EnumProperty(
        name="Mirrored", description="Keep the shape symmetric about a plane", items=MIRRORS
    )
    kind: EnumProperty(name="What", description="What the numbers are", items=KINDS)
    along: EnumProperty(name="Stations along", description="The axis of the stations", items=AXES)
    parameter: StringProperty(
        name="Parameter",
        description="What the skeleton measures; for bones, NAME.rotation and the like",
        search=_parameters,
    )
    absolute: BoolProperty(
        name="Absolute",
        description="The number is what is measured, a sweep of 35 degrees, not its change",
        default=True,
    )
    join: BoolProperty(
        name="Join",
        description="Where there is a variable of this name, let it move these as well",
    )
    bounded: BoolProperty(
        name="Bounds", description="Whether its numbers have bounds", default=True
    )
    lower: FloatProperty(name="Lower", description="Lower bound, in the unit", default=-1.0)
    upper: FloatProperty(name="Upper", description="Upper bound, in the unit", default=1.0)
    unit: EnumProperty(
        name="Unit", description="What values and bounds are in", items=UNITS, default="m"
    )
    typical: FloatProperty(
        name="Typical Change",
        description="A change that matters, for steps of methods; 0: a tenth of the bounds",
        min=0.0,
    )

    @classmethod
    def poll(cls, context):
        """Needs a handle of a case."""
        if choosing.stage_table(context):
            return True
        cls.poll_message_set("Select a handle of the case: a lattice, a cage, a skeleton")
        return False

    def invoke(self, context, event):
        """Begin with what suits the handle."""
        named = choosing.parameters(context)
        if named and self.by != "NAMED":
            self.by = "NAMED"
        if self.by == "NAMED":
            self.parameter = self.parameter or (named[0] if named else "")
            if self.parameter.rpartition(".")[2] in choosing.ANGLES:
                self.unit, self.lower, self.upper = "deg", -15.0, 15.0
        elif not self.properties.is_property_set("upper"):
            reach = choosing.spacing(context.object) / 4
            self.lower, self.upper = -reach, reach
        return context.window_manager.invoke_props_dialog(self, width=340)

    def draw(self, context):
        """The dialog."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "name", placeholder=self.named())
        for key in SHOWN[self.by]:
            layout.prop(self, key)
        if self.named() in edits.variables(view.case_of(context.scene)):
            layout.prop(self, "join")
        if self.by == "NAMED" and choosing.is_measured(context):
            return  # its unit and bounds are those of what it measures
        layout.separator()
        for key in ("unit", "bounded", "lower", "upper", "typical"):
            row = layout.row()
            row.enabled = self.bounded or key not in {"lower", "upper"}
            row.prop(self, key)

    def named(self) -> str:
        """The name, or one that says what it does."""
        if self.name.strip():
            return self.name.strip()
        if self.by == "STATIONS":
            return self.kind
        if self.by == "NAMED":
            return self.parameter.replace(".", "_")
        return f"move_{'normal' if self.axis == 'NORMAL' else self.axis}"

    def execute(self, context):
        """Write the variable and its link into the case."""
        case, name = view.case_of(context.scene), self.named()
        known = edits.variables(case)
        try:
            name = name if self.join else edits.check_name(name, known, "variable")
            bounds = edits.check_bounds(self.lower, self.upper) if self.bounded else None
            make = choosing.Made.of(context, self)
        except edits.Wrong as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        stage, unit, typical = choosing.active_stage(context), unit_text(self.unit), self.typical
        opened = project.case(context.scene) if make.needs_case else None

        def wanted(client: Any) -> edits.Edits:
            made = make(client, opened)
            link = edits.new_link(stage, name, made.link)
            if name in known:
                edits.check_size(name, known[name], made.size)
                return link
            table = made.table or edits.variable_table(made.size, 0.0, bounds, unit, typical)
            return [{"set": ["variable", name], "to": table}, *link]

        return amend(
            self, context, "defining a variable", wanted, lambda s: view.choose(s, variable=name)
        )


CLASSES = (MOLDLINE_OT_add_variable,)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
