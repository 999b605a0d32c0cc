# SPDX-License-Identifier: GPL-3.0-or-later
"""How the shape answers: colours by sensitivity, readings of measures, health of the mesh."""

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty
from bpy.types import Operator

from . import convert, edits, following, legend, measuring, project, session, view
from .amending import finished

TICK = 0.25
"""Seconds between looks at whether values rest."""


@dataclass
class _State:
    """What is known of each scene, by its name."""

    seen: dict[str, Any] = field(default_factory=dict)
    read: dict[str, Any] = field(default_factory=dict)
    painted: dict[str, Any] = field(default_factory=dict)
    under_way: set[str] = field(default_factory=set)
    why: dict[str, str] = field(default_factory=dict)
    health: dict[str, dict[str, Any]] = field(default_factory=dict)
    shading: dict[tuple[str, int], str] = field(default_factory=dict)


_now = _State()


def trouble(scene: Any) -> str:
    """Why readings or colours are not up to date, or nothing."""
    return _now.why.get(scene.name, "")


def health(scene: Any) -> dict[str, Any]:
    """What the last check found: sentences, is_sound, faces, is_of_now; empty before."""
    found = _now.health.get(scene.name, {})
    return {**found, "is_of_now": found["of"] == _shape_key(scene)} if found else {}


def overview(scene: Any) -> dict[str, Any]:
    """What the pipeline is made of, as `moldline info` tells it; empty without a case."""
    return project.description(scene).get("overview", {})


def refresh(scene: Any, failed: Any = None) -> None:
    """Ask for readings, and for colours where they are shown, at the values as they are."""
    _ask_readings(scene, failed)
    if scene.moldline_view.is_coloured:
        _ask_colours(scene, failed)


def _ask_readings(scene: Any, failed: Any = None) -> None:
    _now.read[scene.name] = _shape_key(scene)
    if not edits.measures(view.case_of(scene)):
        return
    wrong, name = _wrong(scene, failed), scene.name
    try:
        case, values = project.case(scene), project.values(scene)
    except session.Problem as problem:
        wrong(problem)
        return

    def then(told: tuple) -> None:
        _now.under_way.discard(name)
        _now.why.pop(name, None)
        measuring.read(bpy.data.scenes[name], *told)

    _now.under_way.add(name)
    session.run(
        lambda _: (case.measures(values), case.beyond(values)), then=then, failed=wrong, what=""
    )


def _ask_colours(scene: Any, failed: Any = None) -> None:
    _now.painted[scene.name] = _paint_key(scene)
    wrong = _wrong(scene, failed)
    try:
        _paint(scene, project.case(scene), project.values(scene), wrong)
    except session.Problem as problem:
        wrong(problem)


def _wrong(scene: Any, failed: Any) -> Any:
    """What keeps a problem for the panel, and tells who asked."""
    name = scene.name

    def wrong(problem: Exception) -> None:
        _now.under_way.discard(name)
        _now.why[name] = str(problem)
        view.redraw()
        if failed is not None:
            failed(problem)

    return wrong


def _paint(scene: Any, case: Any, values: dict[str, Any], failed: Any) -> None:
    name, variable, how = scene.name, view.active_variable(scene), scene.moldline_view.how
    table = edits.variables(view.case_of(scene)).get(variable)
    if table is None:
        failed(session.Problem("choose a variable; colours show how the shape answers to it"))
        return
    if case.faces is None or case.faces.shape[1] != 3:
        how = "size"  # sections and grids have no outward side
    number = min(scene.moldline.active_number, edits.size_of(table) - 1)
    title = f"{edits.labels_of(variable, table)[number]}: {_WHAT[how]}"
    unit = f"m/{table['unit']}" if table.get("unit") else "m"
    session.run(
        lambda _: case.colour(values, variable, number, how=how),
        then=lambda numbers: _painted(bpy.data.scenes[name], numbers, title, unit, how),
        failed=failed,
        what="",
    )


_WHAT = {"normal": "motion outwards", "size": "size of motion"}


def _painted(scene: Any, numbers: np.ndarray, title: str, unit: str, how: str) -> None:
    surface = project.surface(scene)
    if surface is None or not scene.moldline_view.is_coloured or surface.mode == "EDIT":
        return
    if len(numbers) != len(surface.data.vertices):
        _now.painted.pop(scene.name, None)  # a remade shape is on its way; then ask again
        return
    largest = float(np.abs(numbers).max(initial=0.0)) or 1.0
    scale = legend.Scale(title, unit, largest, is_signed=how == "normal")
    convert.colour(surface.data, scale.rgba(numbers))
    legend.show(scale)
    show_attribute(True)
    view.redraw()


def show_attribute(is_shown: bool) -> None:
    """Have solid views show colour attributes, or what they showed before."""
    for screen in bpy.data.screens:
        for number, area in enumerate(screen.areas):
            if area.type != "VIEW_3D":
                continue
            shading, key = area.spaces.active.shading, (screen.name, number)
            if is_shown and shading.color_type != "VERTEX":
                _now.shading[key] = shading.color_type
                shading.color_type = "VERTEX"
            elif not is_shown and shading.color_type == "VERTEX":
                shading.color_type = _now.shading.pop(key, "MATERIAL")


def _bare(scene: Any) -> None:
    """Take the colours away."""
    surface = project.surface(scene)
    if surface is not None and surface.mode != "EDIT":
        convert.colour(surface.data, None)
    legend.hide()
    show_attribute(False)
    view.redraw()


class MOLDLINE_OT_show_sensitivity(Operator):
    """Colour the surface by how it moves for a unit of the active variable's number"""

    bl_idname = "moldline.show_sensitivity"
    bl_label = "Show Sensitivity"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Needs a variable and a shape."""
        if project.surface(context.scene) is not None and view.active_variable(context.scene):
            return True
        cls.poll_message_set("Needs a case with a variable")
        return False

    def execute(self, context):
        """Colour it, now and whenever values come to rest."""
        problems: list[str] = []
        context.scene.moldline_view.is_coloured = True
        refresh(context.scene, lambda problem: problems.append(str(problem)))
        if problems:
            context.scene.moldline_view.is_coloured = False
        return finished(self, problems)


class MOLDLINE_OT_hide_sensitivity(Operator):
    """Show the components' colours again"""

    bl_idname = "moldline.hide_sensitivity"
    bl_label = "Hide Sensitivity"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Take the colours away."""
        context.scene.moldline_view.is_coloured = False
        _bare(context.scene)
        return {"FINISHED"}


class MOLDLINE_OT_check_health(Operator):
    """Check the shape as it is: holes, crossing and turned faces, torn places, pilots that miss"""

    bl_idname = "moldline.check_health"
    bl_label = "Check Health"
    bl_options = {"REGISTER"}

    deep: BoolProperty(
        name="Space and Derivatives",
        description="Also whether space folds over and derivatives are right; takes longer",
    )

    @classmethod
    def poll(cls, context):
        """Needs a shape of a case."""
        return context.scene.moldline.text is not None

    def execute(self, context):
        """Ask; the panel says what was found."""
        scene, problems, deep = context.scene, [], self.deep
        name, key = scene.name, _shape_key(scene)
        try:
            case = project.case(scene)
        except session.Problem as problem:
            return finished(self, [str(problem)])
        values = project.values(scene)

        def then(told: dict[str, Any]) -> None:
            faces = np.asarray(told.get("bad_faces", ()), int)
            _now.health[name] = {
                "sentences": list(told["sentences"]),
                "is_sound": bool(told["is_sound"]),
                "faces": faces,
                "of": key,
            }
            view.redraw()

        session.run(
            lambda _: case.check(values, deep=deep),
            then=then,
            failed=lambda problem: problems.append(str(problem)),
            what="checking the shape",
        )
        return finished(self, problems)


class MOLDLINE_OT_select_faults(Operator):
    """Select the faces that the last check found to be bad, in edit mode"""

    bl_idname = "moldline.select_faults"
    bl_label = "Select Bad Faces"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Needs bad faces."""
        return project.surface(context.scene) is not None and bool(
            len(_now.health.get(context.scene.name, {}).get("faces", ()))
        )

    def execute(self, context):
        """Select them."""
        surface, faces = project.surface(context.scene), health(context.scene)["faces"]
        if context.object is not None and context.object.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        for one in context.selected_objects:
            one.select_set(False)
        surface.hide_set(False)
        surface.select_set(True)
        context.view_layer.objects.active = surface
        context.tool_settings.mesh_select_mode = (False, False, True)
        convert.mark(surface.data, faces)
        bpy.ops.object.mode_set(mode="EDIT")
        return {"FINISHED"}


def _shape_key(scene: Any) -> Any:
    """What the shape depends on, to tell whether it is another."""
    told = scene.moldline
    text = told.text.as_string() if told.text is not None else ""
    try:
        values = project.values(scene)
    except (KeyError, session.Problem):
        values = {}
    return text, tuple((name, np.asarray(v).tobytes()) for name, v in values.items())


def _paint_key(scene: Any) -> Any:
    """What colours depend on."""
    told, surface = scene.moldline, project.surface(scene)
    look = view.active_variable(scene), told.active_number, scene.moldline_view.how
    on = (len(surface.data.vertices), surface.mode) if surface is not None else ()
    return _shape_key(scene), look, on


def _watch() -> float:
    """Blender's timer: readings follow the values, colours come when values have come to rest."""
    scene = getattr(bpy.context, "scene", None)
    if scene is None or not hasattr(scene, "moldline") or not project.is_open(scene):
        return TICK
    name = scene.name
    if legend.shown() is not None and not scene.moldline_view.is_coloured:
        _bare(scene)  # an undo has switched them off
    if _now.read.get(name) != _shape_key(scene) and name not in _now.under_way:
        _ask_readings(scene)
    if scene.moldline_view.is_coloured and not session.busy():
        now = _paint_key(scene)
        rests, _now.seen[name] = _now.seen.get(name) == now, now
        if rests and _now.painted.get(name) != now:
            _ask_colours(scene)
    return TICK


def _shape_came(scene: Any, shape: Any) -> None:
    """A shape that brings its measures along spares asking for them."""
    if getattr(shape, "measures", None) is not None:
        _now.read[scene.name] = _shape_key(scene)
        measuring.read(scene, shape.measures, shape.beyond)


def _looked(scene: Any) -> None:
    """Settings of the colours have changed; in a window the timer sees it."""
    if bpy.app.background and scene.moldline.text is not None:
        refresh(scene)


@bpy.app.handlers.persistent
def _loaded(*_: Any) -> None:
    """Another file: nothing that is known holds, but colours that were on come again."""
    _forget()


@bpy.app.handlers.persistent
def _gone_back(*_: Any) -> None:
    """After undo and redo a mesh may have other colours than those that were asked for."""
    _now.painted.clear()


def _forget() -> None:
    for known in (_now.seen, _now.read, _now.painted, _now.why, _now.health, _now.under_way):
        known.clear()
    measuring.forget()
    legend.hide()


def _again() -> None:
    """Moldline is there again: ask once more."""
    for known in (_now.read, _now.painted, _now.why, _now.under_way):
        known.clear()


HANDLERS = (("load_post", _loaded), ("undo_post", _gone_back), ("redo_post", _gone_back))
CLASSES = (
    MOLDLINE_OT_show_sensitivity,
    MOLDLINE_OT_hide_sensitivity,
    MOLDLINE_OT_check_health,
    MOLDLINE_OT_select_faults,
)

_make_known, _take_away = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Make them known to Blender."""
    measuring.register()
    _make_known()
    view.on_look(_looked)
    following.on_shape(_shape_came)
    session.on_ready(_again)
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    if not bpy.app.background:
        bpy.app.timers.register(_watch, first_interval=1.0, persistent=True)


def unregister() -> None:
    """Take them away."""
    if bpy.app.timers.is_registered(_watch):
        bpy.app.timers.unregister(_watch)
    for name, handler in HANDLERS:
        if handler in getattr(bpy.app.handlers, name):
            getattr(bpy.app.handlers, name).remove(handler)
    show_attribute(False)
    _forget()
    _now.shading.clear()
    _take_away()
    measuring.unregister()
