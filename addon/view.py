# SPDX-License-Identifier: GPL-3.0-or-later
"""What panels list and how the surface is looked at: rows, the active ones, the colours' settings.

Rows repeat what the case's text says, since Blender's lists show collections only.
"""

from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    IntProperty,
    PointerProperty,
)
from bpy.types import PropertyGroup

from . import edits

HOWS = (
    (
        "normal",
        "Along Normal",
        "Motion along the outward normal for a unit of the variable: red outwards, blue inwards",
    ),
    ("size", "Size", "Length of the motion for a unit of the variable, whatever its direction"),
)

_listeners: list[Any] = []


def on_look(callback: Any) -> None:
    """Call this with the scene when colours are to be made anew."""
    if callback not in _listeners:
        _listeners.append(callback)


def looked(scene: Any) -> None:
    """Tell those who colour that something about it has changed."""
    for callback in _listeners:
        callback(scene)


def _look(_: Any, context: Any) -> None:
    looked(context.scene)


class MOLDLINE_PG_row(PropertyGroup):
    """A variable or a measure, by its name."""


class MOLDLINE_PG_view(PropertyGroup):
    """What is listed and chosen in the panels of a scene."""

    variables: CollectionProperty(type=MOLDLINE_PG_row)
    measures: CollectionProperty(type=MOLDLINE_PG_row)
    first: IntProperty(name="From Number", description="The first number that has a slider", min=0)
    is_coloured: BoolProperty(
        name="Sensitivity", description="Whether the surface shows how it answers to a variable"
    )
    how: EnumProperty(
        name="Colours", description="What of the motion is shown", items=HOWS, update=_look
    )


def case_of(scene: Any) -> dict[str, Any]:
    """Tables of the scene's case; empty where it has none."""
    text = scene.moldline.text
    return edits.tables(text.as_string()) if text is not None else {}


def active_variable(scene: Any) -> str:
    """Name of the active variable, or nothing."""
    return _active(scene.moldline_view.variables, scene.moldline.active_variable)


def active_measure(scene: Any) -> str:
    """Name of the active measure, or nothing."""
    return _active(scene.moldline_view.measures, scene.moldline.active_measure)


def is_stale(scene: Any) -> bool:
    """Whether rows are others than those of the case."""
    return any([r.name for r in rows] != names for rows, names in _pairs(scene))


def sync(scene: Any) -> None:
    """Bring the rows up to date; the active ones stay so by name."""
    view = scene.moldline_view
    chosen = active_variable(scene), active_measure(scene)
    for rows, names in _pairs(scene):
        if [row.name for row in rows] == names:
            continue
        rows.clear()
        for name in names:
            rows.add().name = name
    choose(scene, *chosen)
    here = scene.moldline
    here.active_variable = max(0, min(here.active_variable, len(view.variables) - 1))
    here.active_measure = max(0, min(here.active_measure, len(view.measures) - 1))


def sync_soon() -> None:
    """From where nothing may be written, such as a panel: bring rows up to date a moment later."""
    if not bpy.app.timers.is_registered(_sync_all):
        bpy.app.timers.register(_sync_all, first_interval=0.0)


def choose(scene: Any, variable: str = "", measure: str = "") -> None:
    """Make a variable or a measure the active one."""
    view, here = scene.moldline_view, scene.moldline
    if variable in view.variables:
        here.active_variable = view.variables.find(variable)
    if measure in view.measures:
        here.active_measure = view.measures.find(measure)


def redraw() -> None:
    """Have panels and views drawn again."""
    for window in bpy.context.window_manager.windows if bpy.context.window_manager else ():
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "PROPERTIES"}:
                area.tag_redraw()


def _active(rows: Any, index: int) -> str:
    return rows[index].name if 0 <= index < len(rows) else ""


def _pairs(scene: Any) -> list[tuple[Any, list[str]]]:
    case, view = case_of(scene), scene.moldline_view
    return [
        (view.variables, list(edits.variables(case))),
        (view.measures, list(edits.measures(case))),
    ]


def _sync_all() -> None:
    for scene in bpy.data.scenes:
        if is_stale(scene):
            sync(scene)
    redraw()


@bpy.app.handlers.persistent
def _after(*_: Any) -> None:
    sync_soon()


CLASSES = (MOLDLINE_PG_row, MOLDLINE_PG_view)

_make_known, _take_away = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Make them known to Blender."""
    _make_known()
    bpy.types.Scene.moldline_view = PointerProperty(type=MOLDLINE_PG_view)
    for handlers in (
        bpy.app.handlers.load_post,
        bpy.app.handlers.undo_post,
        bpy.app.handlers.redo_post,
    ):
        handlers.append(_after)


def unregister() -> None:
    """Take them away."""
    for handlers in (
        bpy.app.handlers.load_post,
        bpy.app.handlers.undo_post,
        bpy.app.handlers.redo_post,
    ):
        if _after in handlers:
            handlers.remove(_after)
    if bpy.app.timers.is_registered(_sync_all):
        bpy.app.timers.unregister(_sync_all)
    _listeners.clear()
    del bpy.types.Scene.moldline_view
    _take_away()
