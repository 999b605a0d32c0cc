# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons that start and stop moldline and make its environment."""

from collections.abc import Callable

import bpy

from . import environment, session


class MOLDLINE_OT_make_environment(bpy.types.Operator):
    """Make a Python environment with moldline in Blender's user folder, or renew it (online)"""

    bl_idname = "moldline.make_environment"
    bl_label = "Make Environment"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Whether it can be pressed."""
        return not environment.is_making() and environment.is_own()

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Begin; the panels tell how it goes."""
        return _reported(self, session.make_environment)


class MOLDLINE_OT_restart_server(bpy.types.Operator):
    """Stop moldline and start it again; nothing in the file is lost"""

    bl_idname = "moldline.restart_server"
    bl_label = "Restart"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Stop and start."""
        return _reported(self, session.restart)


class MOLDLINE_OT_start_server(bpy.types.Operator):
    """Start moldline now; otherwise it starts when it is first needed"""

    bl_idname = "moldline.start_server"
    bl_label = "Start"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Start."""
        return _reported(self, session.start)


class MOLDLINE_OT_stop_server(bpy.types.Operator):
    """Stop moldline; the shape stays as it is"""

    bl_idname = "moldline.stop_server"
    bl_label = "Stop"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Stop."""
        return _reported(self, session.stop)


def _reported(operator: bpy.types.Operator, act: Callable[[], None]) -> set[str]:
    try:
        act()
    except session.Problem as problem:
        operator.report({"ERROR"}, str(problem))
        return {"CANCELLED"}
    return {"FINISHED"}


CLASSES = (
    MOLDLINE_OT_make_environment,
    MOLDLINE_OT_restart_server,
    MOLDLINE_OT_start_server,
    MOLDLINE_OT_stop_server,
)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
