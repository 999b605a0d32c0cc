# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user may choose once and for all."""

import bpy
from bpy.props import BoolProperty, StringProperty

from . import environment, session
from .drawing import say


def _changed(_preferences: bpy.types.AddonPreferences, _context: bpy.types.Context) -> None:
    session.forget()


class MOLDLINE_AP_preferences(bpy.types.AddonPreferences):
    """Where moldline is, and when it starts."""

    bl_idname = __package__

    python: StringProperty(
        name="Python",
        description="Interpreter of an environment that has moldline; "
        "empty for the add-on's own, which 'Make environment' makes",
        subtype="FILE_PATH",
        update=_changed,
    )
    socket: StringProperty(
        name="Socket",
        description="Where moldline listens; empty for a place of your own, which others share "
        "that you start. Windows keeps a file there that tells the port",
        subtype="FILE_PATH",
        update=_changed,
    )
    starts_at_once: BoolProperty(
        name="Start with Blender",
        description="Start moldline as soon as Blender is there, not when it is first needed",
        default=False,
    )

    def draw(self, context: bpy.types.Context) -> None:
        """What the preferences show."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "python")
        layout.prop(self, "socket")
        layout.prop(self, "starts_at_once")
        for line in (session.sentence(), environment.progress()):
            if line:
                say(layout, context, line)
        layout.operator("moldline.make_environment", text=environment.button())


def register() -> None:
    """Let Blender know."""
    bpy.utils.register_class(MOLDLINE_AP_preferences)


def unregister() -> None:
    """Take it back."""
    bpy.utils.unregister_class(MOLDLINE_AP_preferences)
