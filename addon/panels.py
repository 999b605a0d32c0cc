# SPDX-License-Identifier: GPL-3.0-or-later
"""The tab "Moldline" of the sidebar; what is drawn is known already, nothing is computed here."""

import textwrap
from collections.abc import Callable
from typing import Any

import bpy

from . import choosing, edits, environment, insight, legend, measuring, session, view
from .variables import MOST_SLIDERS

ADDED = (
    ("add_lattice", "Lattice", "OUTLINER_OB_LATTICE"),
    ("add_wing_lattice", "Wing Lattice", "MOD_LATTICE"),
    ("add_cage", "Cage", "MESH_ICOSPHERE"),
    ("add_wing_cage", "Wing Cage", "MOD_MESHDEFORM"),
    ("add_body_cage", "Body Cage", "MESH_CAPSULE"),
    ("add_wing_skeleton", "Wing Skeleton", "OUTLINER_OB_ARMATURE"),
    ("add_body_skeleton", "Body Skeleton", "BONE_DATA"),
    ("add_pilot_points", "Pilot Points", "PIVOT_CURSOR"),
)
"""Operators that add a stage, with what the panel calls them."""

ICONS = {
    "no environment": "ERROR",
    "stopped": "PAUSE",
    "starting": "SORTTIME",
    "ready": "CHECKMARK",
    "failed": "ERROR",
}
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
        for number, line in enumerate(textwrap.wrap(paragraph, letters)):
            column.label(text=line, icon=icon if number == 0 else "BLANK1", translate=False)
            icon = "BLANK1" if icon != "NONE" else "NONE"


def safely(draw: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
    """A panel's `draw` that says what is wrong instead of raising, which would empty the tab."""

    def drawn(self: Any, context: Any) -> None:
        try:
            draw(self.layout, context)
        except Exception as problem:
            self.layout.label(text=f"{type(problem).__name__}: {problem}", icon="ERROR")

    return drawn


def draw_state(layout: Any, context: Any) -> None:
    """How moldline is, and what may be done about it; files."""
    now = session.state()
    say(layout, context, session.sentence(), ICONS[now])
    if session.busy():
        layout.label(text=f"{session.busy()} ...", icon="SORTTIME")
    row = layout.row(align=True)
    if now == "no environment" or (now == "failed" and environment.is_own()):
        button(row, "make_environment", environment.button(), "IMPORT")
    if now == "stopped":
        button(row, "start_server", icon="PLAY")
    if now in ("ready", "failed"):
        button(row, "restart_server", icon="FILE_REFRESH")
    if now == "ready":
        button(row, "stop_server", "", "CANCEL")
    row = layout.row(align=True)
    button(row, "import_geometry", "Import", "IMPORT")
    button(row, "export_geometry", "Export", "EXPORT")
    draw_case(layout, context)


def draw_case(layout: Any, context: Any) -> None:
    """The case: its file, and what was said of it last."""
    told = context.scene.moldline
    row = layout.row(align=True)
    button(row, "open_case", "Open Case", "FILE_FOLDER")
    if told.text is None:
        return
    button(row, "save_case", "Save", "FILE_TICK")
    button(row, "save_case_as", "", "FILE_NEW")
    button(row, "revert_case", "", "LOOP_BACK")
    layout.label(text=told.path or told.text.name, icon="TEXT", translate=False)
    if told.status:
        say(layout, context, told.status, "INFO")


def draw_parameterise(layout: Any, context: Any) -> None:
    """What may be put around the shape, and the stages that there are."""
    grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
    for operator, text, icon in ADDED:
        button(grid, operator, text, icon)
    stages = view.case_of(context.scene).get("stage", [])
    if not stages:
        say(layout, context, "Select a mesh, and add what is to move it", "INFO")
        return
    active, column = choosing.active_stage(context), layout.column(align=True)
    for number, stage in enumerate(stages):
        row = column.row(align=True)
        kind = str(stage.get("deformer") or stage.get("modeler") or "")
        name = stage.get("name") or stage.get("to") or kind.replace("_", " ")
        shown = button(row, "select_handle", name, "RADIOBUT_ON" if number == active else "DOT")
        if shown is None:
            row.label(text=name, icon="DOT", translate=False)
        else:
            shown.stage = number
        row.label(text=kind.replace("_", " "), translate=False)
        gone = button(row, "remove_stage", "", "X")
        if gone is not None:
            gone.stage = number
    row = layout.row(align=True)
    button(row, "reset_handle", "Reset", "LOOP_BACK")
    button(row, "mirror_handle", "Mirror", "MOD_MIRROR")


def draw_variables(layout: Any, context: Any) -> None:
    """The variables, and sliders for the numbers of the active one."""
    scene = context.scene
    if scene.moldline.text is None:
        say(layout, context, "Variables are the numbers that you turn; add a lattice, a cage or a "
            "skeleton first, or open a case", "INFO")  # fmt: skip
        return
    if view.is_stale(scene):
        view.sync_soon()
    shown = scene.moldline_view
    row = layout.row()
    row.template_list("MOLDLINE_UL_variables", "", shown, "variables", shown, "variable", rows=4)
    side = row.column(align=True)
    side.menu("MOLDLINE_MT_add_variable", icon="ADD", text="")
    button(side, "remove_variable", "", "REMOVE")
    side.separator()
    button(side, "edit_variable", "", "GREASEPENCIL")
    button(side, "bound_variable", "", "ARROW_LEFTRIGHT")
    button(side, "reset_values", "", "LOOP_BACK")
    draw_sliders(layout, context)


def draw_sliders(layout: Any, context: Any) -> None:
    """The active variable's numbers, with what they are bounded by."""
    scene, name = context.scene, view.active_variable(context.scene)
    surface = scene.moldline.surface
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
    shown = scene.moldline_view
    row = layout.row()
    row.template_list("MOLDLINE_UL_measures", "", shown, "measures", shown, "measure", rows=4)
    side = row.column(align=True)
    side.menu("MOLDLINE_MT_add_measure", icon="ADD", text="")
    button(side, "remove_measure", "", "REMOVE")
    side.separator()
    button(side, "bound_measure", "", "ARROW_LEFTRIGHT")
    name, now = view.active_measure(scene), measuring.reading(scene)
    table = edits.measures(view.case_of(scene)).get(name)
    if table is None:
        return
    kind = str(table.get("measure", "")).replace("_", " ")
    layout.label(text=f"{name}: {kind}", translate=False)
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
        box.prop(shown, "number")
    scale = legend.shown()
    if shown.is_coloured and scale is not None:
        said = f"{scale.low:.3g} to {scale.largest:.3g} {scale.unit}"
        say(box, context, f"{scale.title}, {said}", "BLANK1")
    if shown.is_coloured and insight.trouble(scene):
        say(box, context, insight.trouble(scene), "ERROR")


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


class MOLDLINE_PT_main(bpy.types.Panel):
    """Moldline itself, and files."""

    bl_idname = "MOLDLINE_PT_main"
    bl_label = "Moldline"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Moldline"
    draw = safely(draw_state)


class MOLDLINE_PT_parameterise(bpy.types.Panel):
    """What moves the shape."""

    bl_idname = "MOLDLINE_PT_parameterise"
    bl_label = "Parameterise"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Moldline"
    draw = safely(draw_parameterise)


class MOLDLINE_PT_variables(bpy.types.Panel):
    """The numbers that the designer turns."""

    bl_idname = "MOLDLINE_PT_variables"
    bl_label = "Variables"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Moldline"
    draw = safely(draw_variables)


class MOLDLINE_PT_measures(bpy.types.Panel):
    """What the shape measures."""

    bl_idname = "MOLDLINE_PT_measures"
    bl_label = "Measures"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Moldline"
    draw = safely(draw_measures)


class MOLDLINE_PT_look(bpy.types.Panel):
    """How the shape answers."""

    bl_idname = "MOLDLINE_PT_look"
    bl_label = "Look"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Moldline"
    draw = safely(draw_look)


class MOLDLINE_PT_health(bpy.types.Panel):
    """Whether the mesh is sound."""

    bl_idname = "MOLDLINE_PT_health"
    bl_parent_id = "MOLDLINE_PT_look"
    bl_label = "Health"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Moldline"
    poll = classmethod(lambda cls, context: context.scene.moldline.text is not None)
    draw = safely(draw_health)


class MOLDLINE_PT_overview(bpy.types.Panel):
    """What the pipeline is made of."""

    bl_idname = "MOLDLINE_PT_overview"
    bl_parent_id = "MOLDLINE_PT_look"
    bl_label = "Pipeline"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Moldline"
    bl_options = {"DEFAULT_CLOSED"}
    poll = classmethod(lambda cls, context: context.scene.moldline.text is not None)
    draw = safely(draw_overview)


class MOLDLINE_MT_add_variable(bpy.types.Menu):
    """Ways to define a variable."""

    bl_idname = "MOLDLINE_MT_add_variable"
    bl_label = "New Variable"

    def draw(self, context: Any) -> None:
        """An entry for each way."""
        self.layout.operator_context = "INVOKE_DEFAULT"
        for way, text, icon in (
            ("SELECTION", "From Selected Control Points", "VERTEXSEL"),
            ("STATIONS", "Thickness, Camber, Radius by Stations", "MOD_LATTICE"),
            ("NAMED", "Of a Skeleton: Span, Chord, Sweep ...", "BONE_DATA"),
        ):
            told = button(self.layout, "add_variable", text, icon)
            if told is not None:
                told.by = way


CLASSES = (
    MOLDLINE_MT_add_variable,
    MOLDLINE_PT_main,
    MOLDLINE_PT_parameterise,
    MOLDLINE_PT_variables,
    MOLDLINE_PT_measures,
    MOLDLINE_PT_look,
    MOLDLINE_PT_health,
    MOLDLINE_PT_overview,
)


def register() -> None:
    """Make them known to Blender."""
    for one in CLASSES:
        bpy.utils.register_class(one)


def unregister() -> None:
    """Take them away."""
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
