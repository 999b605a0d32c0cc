# SPDX-License-Identifier: GPL-3.0-or-later
"""What panels hold: sentences, buttons, sliders, numbers; all of it is known already."""

import textwrap
from collections.abc import Callable
from typing import Any

import bpy

from . import choosing, edits, insight, legend, measure_kinds, measuring, project, view
from .variables import MOST_SLIDERS

PIXELS = 7.5
"""Of a letter, about."""


def known(operator: str) -> bool:
    """Whether Blender knows an operator of ours."""
    return hasattr(bpy.types, f"MOLDLINE_OT_{operator}")


def button(layout: Any, operator: str, text: str | None = None, icon: str = "NONE") -> Any:
    """A button of an operator of ours, where Blender knows it."""
    if not known(operator):
        return None
    told = {} if text is None else {"text": text}
    return layout.operator(f"moldline.{operator}", icon=icon, **told)


def say(layout: Any, context: Any, text: str, icon: str = "NONE") -> None:
    """A sentence, in lines as long as the panel is wide."""
    region = getattr(context, "region", None)
    wide = region.width if region is not None and region.width > 1 else 280
    scale = context.preferences.system.ui_scale or 1.0
    letters = max(20, int(wide / (PIXELS * scale)) - 5)
    column = layout.column(align=True)
    for paragraph in text.splitlines():
        for line in textwrap.wrap(paragraph, letters):
            column.label(text=line, icon=icon, translate=False)
            icon = "BLANK1" if icon != "NONE" else "NONE"


def safely(draw: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
    """A panel's `draw` that says what is wrong instead of raising, which would empty the tab."""

    def drawn(self: Any, context: Any) -> None:
        try:
            draw(self.layout, context)
        except Exception as problem:
            self.layout.label(text=f"{type(problem).__name__}: {problem}", icon="ERROR")

    return drawn


def draw_variables(layout: Any, context: Any) -> None:
    """The variables, and sliders for the numbers of the active one."""
    scene = context.scene
    if scene.moldline.text is None:
        say(layout, context, "Variables are the numbers that you turn; add a lattice, a cage or a "
            "skeleton first, or open a case", "INFO")  # fmt: skip
        return
    if view.is_stale(scene):
        view.sync_soon()
    shown, here = scene.moldline_view, scene.moldline
    row = layout.row()
    row.template_list(
        "MOLDLINE_UL_variables", "", shown, "variables", here, "active_variable", rows=4
    )
    side = row.column(align=True)
    side.menu("MOLDLINE_MT_add_variable", icon="ADD", text="")
    button(side, "remove_variable", "", "REMOVE")
    side.separator()
    button(side, "edit_variable", "", "GREASEPENCIL")
    button(side, "bound_variable", "", "ARROW_LEFTRIGHT")
    button(side, "reset_values", "", "LOOP_BACK")
    draw_ways(layout, context)
    draw_sliders(layout, context)


def draw_ways(layout: Any, context: Any) -> None:
    """Buttons for new variables of the handle that is active."""
    kind, row = choosing.stage_table(context).get("deformer", ""), layout.row(align=True)
    ways = [("SELECTION", "From Selection", "VERTEXSEL")] * (kind in edits.NETS)
    ways += [("STATIONS", "By Stations", "MOD_LATTICE")] * (kind == "lattice")
    ways += [("NAMED", "Of Skeleton", "BONE_DATA")] * bool(choosing.parameters(context))
    row.operator_context = "INVOKE_DEFAULT"
    for way, text, icon in ways:
        told = button(row, "add_variable", text, icon)
        if told is not None:
            told.by = way


def draw_sliders(layout: Any, context: Any) -> None:
    """The active variable's numbers, with what they are bounded by."""
    scene, name = context.scene, view.active_variable(context.scene)
    surface = project.surface(scene)
    table = edits.variables(view.case_of(scene)).get(name)
    if table is None or surface is None or name not in surface:
        return
    labels, pairs = edits.labels_of(name, table), edits.bounds_of(table)
    first = min(scene.moldline_view.first, max(0, len(labels) - MOST_SLIDERS))
    if len(labels) > MOST_SLIDERS:
        layout.prop(scene.moldline_view, "first")
    column = layout.column(align=True)
    path = f'["{bpy.utils.escape_identifier(name)}"]'
    for number in range(first, min(first + MOST_SLIDERS, len(labels))):
        column.prop(surface, path, index=number, text=labels[number], slider=True)
    unit = table.get("unit", "")
    low, high = min(p[0] for p in pairs), max(p[1] for p in pairs)
    said = f"from {low:.4g} to {high:.4g} {unit}" if "bounds" in table else f"no bounds, {unit}"
    layout.label(text=said.rstrip(", "), icon="BLANK1", translate=False)
    moved = edits.links_of(view.case_of(scene), name)
    if not moved:
        layout.label(text="Moves nothing: it has no link", icon="ERROR")


def draw_measures(layout: Any, context: Any) -> None:
    """Measures, and each number of the active one."""
    scene = context.scene
    if scene.moldline.text is None:
        say(layout, context, "Measures read the shape while it moves: volume, thickness, chord; "
            "with bounds they are constraints", "INFO")  # fmt: skip
        return
    if view.is_stale(scene):
        view.sync_soon()
    shown, here = scene.moldline_view, scene.moldline
    row = layout.row()
    row.template_list("MOLDLINE_UL_measures", "", shown, "measures", here, "active_measure", rows=4)
    side = row.column(align=True)
    side.menu("MOLDLINE_MT_add_measure", icon="ADD", text="")
    button(side, "remove_measure", "", "REMOVE")
    side.separator()
    button(side, "bound_measure", "", "ARROW_LEFTRIGHT")
    name, now = view.active_measure(scene), measuring.reading(scene)
    table = edits.measures(view.case_of(scene)).get(name)
    if table is None:
        return
    kind = measure_kinds.KINDS.get(table.get("measure", ""))
    if kind is not None:
        say(layout, context, kind.told)
    column = layout.column(align=True)
    found = measuring.lines(table, now.numbers.get(name, ()), now.beyond.get(name))
    for said, is_beyond in found[:MOST_SLIDERS]:
        line = column.row()
        line.alert = is_beyond
        line.label(text=said, icon="ERROR" if is_beyond else "BLANK1", translate=False)
    if insight.trouble(scene):
        say(layout, context, insight.trouble(scene), "ERROR")


def draw_look(layout: Any, context: Any) -> None:
    """Colours by sensitivity."""
    scene = context.scene
    if scene.moldline.text is None:
        say(layout, context, "Colours and checks need a case", "INFO")
        return
    shown, box = scene.moldline_view, layout.box()
    row = box.row(align=True)
    button(row, "show_sensitivity", "Sensitivity", "COLOR")
    if shown.is_coloured:
        button(row, "hide_sensitivity", "", "X")
    box.prop(shown, "how", text="")
    table = edits.variables(view.case_of(scene)).get(view.active_variable(scene), {})
    if edits.size_of(table) > 1:
        box.prop(scene.moldline, "active_number")
    scale = legend.shown()
    if shown.is_coloured and scale is not None:
        said = f"{scale.low:.3g} to {scale.largest:.3g} {scale.unit}"
        say(box, context, f"{scale.title}, {said}", "BLANK1")
    if shown.is_coloured and shading_of(context) not in ("", "SOLID"):
        say(box, context, "Solid shading of the view shows the colours", "INFO")
    if shown.is_coloured and insight.trouble(scene):
        say(box, context, insight.trouble(scene), "ERROR")


def shading_of(context: Any) -> str:
    """How the view that the panel belongs to shades things."""
    space = getattr(context, "space_data", None)
    return space.shading.type if getattr(space, "type", "") == "VIEW_3D" else ""


def draw_health(layout: Any, context: Any) -> None:
    """What the last check found."""
    row = layout.row(align=True)
    for text, is_deep in (("Check", False), ("Check Deeply", True)):
        told = button(row, "check_health", text, "HEART" if not is_deep else "NONE")
        if told is not None:
            told.deep = is_deep
    found = insight.health(context.scene)
    if not found:
        return
    if not found["is_of_now"]:
        layout.label(text="Of an earlier shape", icon="TIME")
    if found["is_sound"]:
        layout.label(text="Sound", icon="CHECKMARK")
    for sentence in found["sentences"][:MOST_SLIDERS]:
        say(layout, context, sentence, "DOT" if found["is_sound"] else "ERROR")
    if len(found["faces"]):
        button(layout, "select_faults", f"Select {len(found['faces'])} Bad Faces", "FACESEL")


def draw_overview(layout: Any, context: Any) -> None:
    """Geometries, what acts on each in order, and the variables that turn it."""
    told = insight.overview(context.scene)
    for name, row in told.get("geometries", {}).items():
        box = layout.box()
        ends = " (result)" if name == told.get("result") else ""
        box.label(text=f"{name}{ends}: {row['size']}", icon="MESH_DATA", translate=False)
        for step in row["steps"]:
            kind = ", ".join(filter(None, [step["kind"], step["detail"]]))
            say(box, context, f"{step['name']}: {kind}", "RIGHTARROW_THIN")
            if step["variables"]:
                say(box, context, "turned by " + ", ".join(step["variables"]), "BLANK1")
    if not told:
        layout.label(text="The case is not open")
