# SPDX-License-Identifier: GPL-3.0-or-later
"""The tab "Moldline" of the sidebar; what is drawn is known already, nothing is computed here."""

from typing import Any

import bpy

from . import choosing, environment, project, results, session, view
from .drawing import (
    button,
    draw_health,
    draw_look,
    draw_measures,
    draw_overview,
    draw_variables,
    safely,
    say,
)

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

HINTS = {
    "MESH": "Tab for edit mode; then select control points, and move them with G",
    "ARMATURE": "Ctrl Tab for pose mode; then turn, move and scale bones with R, G and S",
}

ICONS = {
    "no environment": "ERROR",
    "stopped": "PAUSE",
    "starting": "SORTTIME",
    "ready": "CHECKMARK",
    "failed": "ERROR",
}


def draw_state(layout: Any, context: Any) -> None:
    """How moldline is, and what may be done about it; files."""
    now = session.state()
    say(layout, context, session.sentence(), "ERROR" if session.mismatch() else ICONS[now])
    if session.busy():
        layout.label(text=f"{session.busy()} ...", icon="SORTTIME")
    if now == "no environment" or (now == "failed" and environment.is_own()):
        button(layout, "make_environment", environment.button(), "IMPORT")
    row = layout.row(align=True)
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
    button(row, "close_case", "", "X")
    if not project.is_open(context.scene):
        button(layout, "reopen_case", icon="FILE_REFRESH")
    shown = project.surface(context.scene)
    if shown is None or shown.get(results.EDITED, False):
        row = layout.row(align=True)
        button(row, "restore_surface", icon="LOOP_BACK")
        if shown is not None:
            button(row, "use_surface", icon="CHECKMARK")
    layout.label(text=told.path or told.text.name, icon="TEXT", translate=False)
    if told.status:
        say(layout, context, told.status, "ERROR" if told.is_alert else "INFO")


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
        if kind.replace("_", " ") != name:
            row.label(text=kind.replace("_", " "), translate=False)
        gone = button(row, "remove_stage", "", "X")
        if gone is not None:
            gone.stage = number
    row = layout.row(align=True)
    button(row, "reset_handle", "Reset", "LOOP_BACK")
    button(row, "mirror_handle", "Mirror", "MOD_MIRROR")
    button(row, "show_handles", "Show", "HIDE_OFF")
    if active >= 0 and context.object.mode == "OBJECT":
        say(layout, context, HINTS.get(context.object.type, ""), "INFO")


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

register, unregister = bpy.utils.register_classes_factory(CLASSES)
