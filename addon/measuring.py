# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures and constraints: added, bounded and removed, and what they read now."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy.types import Operator, UIList

from . import choosing, convert, edits, measure_kinds, project, view
from .amending import amend
from .measure_kinds import KINDS, Asked

KEEPS = (
    ("FREE", "Only Read", "No bounds: it is read, and nothing is asked of it"),
    ("EQUAL", "As It Is", "Equal to what it is now"),
    ("LEAST", "At Least", "Not below what it is now"),
    ("MOST", "At Most", "Not above what it is now"),
    ("BETWEEN", "Near", "Within a share of what it is now, to both sides"),
    ("NUMBERS", "By Numbers", "Within bounds that are given, in SI"),
)
SIDES = (
    ("BOTH", "Between", "Not below the lower, not above the upper number"),
    ("LEAST", "At Least", "Not below the lower number"),
    ("MOST", "At Most", "Not above the upper number"),
)
DIRECTIONS = (
    ("ALL", "All", "All axes, or the usual one"),
    ("x", "X", "Along x"),
    ("y", "Y", "Along y"),
    ("z", "Z", "Along z"),
)
CORNERS = (0, 1, 3, 2, 4, 5, 7, 6)
"""Blender's corners of a box in the order 000, 001, 010 .. 111."""


class Reading(NamedTuple):
    """Numbers of the measures, and by how much they are beyond their bounds where they are."""

    numbers: Mapping[str, Any]
    beyond: Mapping[str, Any]


_read: dict[str, Reading] = {}


def reading(scene: Any) -> Reading:
    """What the measures were when last read; empty before."""
    return _read.get(scene.name, Reading({}, {}))


def read(scene: Any, numbers: Mapping[str, Any], beyond: Mapping[str, Any]) -> None:
    """These are the numbers now."""
    _read[scene.name] = Reading(dict(numbers), dict(beyond))
    view.redraw()


def forget(scene: Any | None = None) -> None:
    """Numbers of a scene, or of all, hold no more."""
    _read.clear() if scene is None else _read.pop(scene.name, None)


def lines(table: Mapping[str, Any], numbers: Any, beyond: Any) -> list[tuple[str, bool]]:
    """What a panel says of each number of a measure, and whether it is beyond its bounds."""
    unit = measure_kinds.unit_of(dict(table))
    pairs = _pairs(table.get("bounds"), len(numbers))
    found = []
    for i, (number, (low, high)) in enumerate(zip(numbers, pairs, strict=True)):
        miss = float(beyond[i]) if beyond is not None and i < len(beyond) else 0.0
        said = " ".join(filter(None, [f"{float(number):.6g}", unit, _wanted(low, high)]))
        found.append((f"{said}, off by {miss:.3g}" if miss else said, bool(miss)))
    return found


def _wanted(low: float, high: float) -> str:
    if low == high:
        return f"(= {low:.6g})"
    parts = [f"≥ {low:.6g}"] * (low > -float("inf")) + [f"≤ {high:.6g}"] * (high < float("inf"))
    return f"({', '.join(parts)})" if parts else ""


def _pairs(bounds: Any, count: int) -> list[tuple[float, float]]:
    if not bounds:
        return [edits.FREE] * count
    pairs = bounds if isinstance(bounds[0], list | tuple) else [bounds] * count
    return [(float(low), float(high)) for low, high in pairs]


class MOLDLINE_UL_measures(UIList):
    """Measures of the case, each with what it is now."""

    bl_idname = "MOLDLINE_UL_measures"

    def draw_item(
        self, context, layout, data, item, icon, active_data, active_propname, index=0, flt_flag=0
    ):
        """A row: the name, the first number, and an alert where it is beyond its bounds."""
        table = edits.measures(view.case_of(context.scene)).get(item.name, {})
        now = reading(context.scene)
        numbers, is_beyond = now.numbers.get(item.name, ()), item.name in now.beyond
        sign = "ERROR" if is_beyond else "CHECKMARK" if "bounds" in table else "DRIVER_DISTANCE"
        row = layout.row(align=True)
        row.alert = is_beyond
        row.label(text=item.name, icon=sign, translate=False)
        more = " ..." if len(numbers) > 1 else ""
        unit = measure_kinds.unit_of(table)
        row.label(text=f"{float(numbers[0]):.5g}{more} {unit}" if len(numbers) else "")


def _components(self: Any, context: Any, typed: str) -> list[str]:
    surface = project.surface(context.scene)
    return convert.components(surface) if surface is not None else []


class MOLDLINE_OT_add_measure(Operator):
    """Measure the shape: read the number live, and hold it within bounds if wanted"""

    bl_idname = "moldline.add_measure"
    bl_label = "Add Measure"
    bl_options = {"REGISTER"}

    kind: EnumProperty(
        name="Measure",
        description="What is measured",
        items=[(name, one.label, one.told) for name, one in KINDS.items()],
    )
    name: StringProperty(name="Name", description="What it is called")
    component: StringProperty(
        name="Component", description="Of this component only; empty: of all", search=_components
    )
    at: StringProperty(
        name="Stations", description="Places along the span (y) [m], apart by commas"
    )
    chord: StringProperty(
        name="Parts of Chord", description="0 to 1 from the leading edge, apart by commas"
    )
    along: EnumProperty(name="Along", description="Direction", items=DIRECTIONS)
    across: EnumProperty(
        name="Across", description="Plane of symmetry", items=DIRECTIONS[1:], default="y"
    )
    relative: BoolProperty(name="Over the Chord", description="As a share of the chord")
    keep: EnumProperty(name="Constraint", description="Bounds from what it is now", items=KEEPS)
    slack: FloatProperty(
        name="Share", description="Of what it is now", default=5.0, min=0.0, subtype="PERCENTAGE"
    )
    sides: EnumProperty(name="Sides", description="Which bounds there are", items=SIDES)
    lower: FloatProperty(name="Lower", description="Lower bound, SI", precision=5)
    upper: FloatProperty(name="Upper", description="Upper bound, SI", precision=5)

    @classmethod
    def poll(cls, context):
        """Needs a case."""
        return _has_case(cls, context)

    def invoke(self, context, event):
        """Begin in the middle of the span, and of the chord."""
        surface, needs = project.surface(context.scene), KINDS[self.kind].needs
        if any(need.lstrip("?") == "at" for need in needs) and surface is not None:
            ends = [(surface.matrix_world @ choosing.Vector(c)).y for c in surface.bound_box]
            self.at = self.at or f"{(min(ends) + max(ends)) / 2:.3g}"
        self.chord = self.chord or "0.5"
        if "along" in needs and self.along == "ALL":
            self.along = "z" if self.kind == "projected_area" else "y"
        if self.kind == "symmetry":
            self.across = "y"
        return context.window_manager.invoke_props_dialog(self, width=320)

    def draw(self, context):
        """The dialog."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "kind")
        layout.prop(self, "name", placeholder=self.kind)
        for need in KINDS[self.kind].needs:
            if need.lstrip("?") in ("component", "at", "chord", "along", "across", "relative"):
                layout.prop(self, need.lstrip("?"))
        layout.separator()
        draw_keep(layout, self)

    def execute(self, context):
        """Write the measure into the case, with bounds from what it is now."""
        case = view.case_of(context.scene)
        name = self.name.strip() or edits.unique(self.kind, edits.measures(case))
        try:
            edits.check_name(name, edits.measures(case), "measure")
            table = measure_kinds.table(self.kind, _asked(context, self))
            keeping = Keeping.of(self)
        except edits.Wrong as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        told, values = context.scene.moldline, project.values(context.scene)
        text, folder = told.text.as_string(), told.folder

        def wanted(client: Any) -> edits.Edits:
            bounds = None
            if keeping.how != "FREE":
                first = client.amend(text, folder, [{"set": ["measure", name], "to": table}])
                opened = client.open(text=first["text"], folder=folder)
                bounds = keeping.bounds(opened.measures(values)[name])
                opened.close()
            whole = table if bounds is None else {**table, "bounds": bounds}
            return [{"set": ["measure", name], "to": whole}]

        return amend(
            self, context, "adding a measure", wanted, lambda s: view.choose(s, measure=name)
        )


class Keeping(NamedTuple):
    """How a measure is to be held, read from an operator's fields."""

    how: str
    slack: float
    lower: float
    upper: float

    @classmethod
    def of(cls, asked: Any) -> "Keeping":
        """From the fields; numbers that leave no choice are refused."""
        low = asked.lower if asked.sides != "MOST" else -float("inf")
        high = asked.upper if asked.sides != "LEAST" else float("inf")
        found = cls(asked.keep, asked.slack / 100, low, high)
        if found.how == "NUMBERS":
            found.bounds(())
        return found

    def bounds(self, numbers: Any) -> list[Any] | None:
        """As a case has them."""
        return edits.kept(self.how, list(numbers), self.slack, self.lower, self.upper)


class MOLDLINE_OT_bound_measure(Operator):
    """Hold the active measure within bounds, from what it is now or by numbers, or let it go"""

    bl_idname = "moldline.bound_measure"
    bl_label = "Bounds of Measure"
    bl_options = {"REGISTER"}

    keep: EnumProperty(name="Constraint", description="Bounds from what it is now", items=KEEPS)
    slack: FloatProperty(
        name="Share", description="Of what it is now", default=5.0, min=0.0, subtype="PERCENTAGE"
    )
    sides: EnumProperty(name="Sides", description="Which bounds there are", items=SIDES)
    lower: FloatProperty(name="Lower", description="Lower bound, SI", precision=5)
    upper: FloatProperty(name="Upper", description="Upper bound, SI", precision=5)

    @classmethod
    def poll(cls, context):
        """Needs an active measure."""
        return _has_case(cls, context) and bool(view.active_measure(context.scene))

    def invoke(self, context, event):
        """Ask how."""
        numbers = reading(context.scene).numbers.get(view.active_measure(context.scene), ())
        if len(numbers):
            self.lower = self.upper = float(numbers[0])
        return context.window_manager.invoke_props_dialog(self, width=320)

    def draw(self, context):
        """The dialog."""
        self.layout.use_property_split = True
        draw_keep(self.layout, self)

    def execute(self, context):
        """Change the case."""
        name = view.active_measure(context.scene)
        table = edits.measures(view.case_of(context.scene))[name]
        try:
            keeping = Keeping.of(self)
        except edits.Wrong as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        values = project.values(context.scene)
        opened = project.case(context.scene)

        def wanted(client: Any) -> edits.Edits:
            if keeping.how == "FREE":
                return [{"remove": ["measure", name, "bounds"]}] if "bounds" in table else []
            bounds = keeping.bounds(opened.measures(values)[name])
            return [{"set": ["measure", name, "bounds"], "to": bounds}]

        return amend(self, context, "bounding a measure", wanted)


class MOLDLINE_OT_remove_measure(Operator):
    """Remove the active measure from the case"""

    bl_idname = "moldline.remove_measure"
    bl_label = "Remove Measure"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Needs an active measure."""
        return _has_case(cls, context) and bool(view.active_measure(context.scene))

    def execute(self, context):
        """Change the case."""
        name = view.active_measure(context.scene)
        return amend(self, context, "removing a measure", [{"remove": ["measure", name]}])


class MOLDLINE_MT_add_measure(bpy.types.Menu):
    """What can be measured"""

    bl_idname = "MOLDLINE_MT_add_measure"
    bl_label = "Add Measure"

    def draw(self, context):
        """An entry for each kind."""
        self.layout.operator_context = "INVOKE_DEFAULT"
        for name, kind in KINDS.items():
            told = self.layout.operator("moldline.add_measure", text=kind.label)
            told.kind = name


def draw_keep(layout: Any, asked: Any) -> None:
    """The fields for bounds."""
    layout.prop(asked, "keep")
    if asked.keep == "BETWEEN":
        layout.prop(asked, "slack")
    if asked.keep == "NUMBERS":
        layout.prop(asked, "sides")
        if asked.sides != "MOST":
            layout.prop(asked, "lower")
        if asked.sides != "LEAST":
            layout.prop(asked, "upper")


def _has_case(cls: Any, context: Any) -> bool:
    if context.scene.moldline.text is not None:
        return True
    cls.poll_message_set("There is no case yet; add a parameterisation first")
    return False


def _asked(context: Any, given: Any) -> Asked:
    """What the operator's fields and the selection say."""
    surface = project.surface(context.scene)
    vertices = choosing.selected(surface) if surface is not None else []
    others = [one for one in context.selected_objects if one is not surface and one.type == "MESH"]
    others = [one for one in others if not getattr(one.moldline, "role", "")]
    box = []
    if others:
        corners = [others[0].matrix_world @ choosing.Vector(c) for c in others[0].bound_box]
        box = [[edits.tidy(x) for x in corners[i]] for i in CORNERS]
    along = "" if given.along == "ALL" else given.along
    return Asked(
        given.component.strip(),
        given.at,
        given.chord,
        along,
        given.across,
        given.relative,
        vertices,
        box,
    )


CLASSES = (
    MOLDLINE_UL_measures,
    MOLDLINE_OT_add_measure,
    MOLDLINE_OT_bound_measure,
    MOLDLINE_OT_remove_measure,
    MOLDLINE_MT_add_measure,
)

_make_known, _take_away = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Make them known to Blender."""
    _make_known()


def unregister() -> None:
    """Take them away."""
    forget()
    _take_away()
