# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said in the window."""

import textwrap

import bpy

WIDE = 100
"""Letters of a line in a menu; Blender cuts off what the window does not hold."""


def show(text: str) -> None:
    """Say what is under way, in the status bar and the panels."""
    if bpy.app.background:
        return
    for window in bpy.context.window_manager.windows:
        window.workspace.status_text_set(f"Moldline: {text} ..." if text else None)
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def clear_soon() -> None:
    """Say nothing more: a moment later, since at Blender's end windows are half gone already."""
    if not bpy.app.background:
        bpy.app.timers.register(lambda: show(""), first_interval=0.0)


def tell(problem: object) -> None:
    """A sentence in the window."""

    def draw(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
        for paragraph in str(problem).splitlines():
            for line in textwrap.wrap(paragraph, WIDE):
                menu.layout.label(text=line, translate=False)

    windows = bpy.context.window_manager.windows
    if windows and not bpy.app.background:  # without a display, Blender crashes on a menu
        with bpy.context.temp_override(window=windows[0]):
            bpy.context.window_manager.popup_menu(draw, title="Moldline", icon="ERROR")


def push_undo(name: str) -> None:
    """Make an undo step outside an operator."""
    windows = bpy.context.window_manager.windows
    if windows and not bpy.app.background:
        with bpy.context.temp_override(window=windows[0]):
            bpy.ops.ed.undo_push(message=name)
