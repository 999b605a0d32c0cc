# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's own menus, where F3 finds them too."""

from typing import Any

import bpy

from .panels import ADDED


class MOLDLINE_MT_add(bpy.types.Menu):
    """What moves a shape"""

    bl_idname = "MOLDLINE_MT_add"
    bl_label = "Moldline"

    def draw(self, _context: Any) -> None:
        """An entry for each kind."""
        for operator, text, icon in ADDED:
            self.layout.operator(f"moldline.{operator}", text=text, icon=icon)


class MOLDLINE_MT_case(bpy.types.Menu):
    """The case, its values and its measures"""

    bl_idname = "MOLDLINE_MT_case"
    bl_label = "Moldline"

    def draw(self, _context: Any) -> None:
        """What the panels offer most often."""
        for operators in (
            ("open_case", "save_case", "save_case_as", "revert_case"),
            ("add_variable", "add_measure", "reset_values"),
            ("show_sensitivity", "hide_sensitivity", "check_health"),
        ):
            for operator in operators:
                self.layout.operator(f"moldline.{operator}")
            self.layout.separator()


def _in_add(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.menu("MOLDLINE_MT_add", icon="MOD_LATTICE")


def _in_object(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.menu("MOLDLINE_MT_case")


def _in_mesh(menu: bpy.types.Menu, context: bpy.types.Context) -> None:
    _in_object(menu, context)  # pilots and boxes go where points are selected
    menu.layout.menu("MOLDLINE_MT_add", text="Moldline: Add", icon="MOD_LATTICE")


PLACES = {
    "VIEW3D_MT_add": _in_add,
    "VIEW3D_MT_object": _in_object,
    "VIEW3D_MT_pose": _in_object,
    "VIEW3D_MT_edit_mesh": _in_mesh,
}

_make_known, _take_away = bpy.utils.register_classes_factory((MOLDLINE_MT_add, MOLDLINE_MT_case))


def register() -> None:
    """Let Blender know."""
    _make_known()
    for name, draw in PLACES.items():
        getattr(bpy.types, name).append(draw)


def unregister() -> None:
    """Take it back."""
    for name, draw in PLACES.items():
        getattr(bpy.types, name).remove(draw)
    _take_away()
