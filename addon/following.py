# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape follows the hand: changes of handles and values are seen, sent, and answered.

What a scene is asked to look like is told by its data alone: a handle that is not where it was put
was moved by a hand; else the variables' values count. So undo, files that are opened again and
several handles at once need nothing of their own. Coarse shapes, in single precision, follow a
drag; the fine one comes when it rests.
"""

import contextlib
import time
from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.handlers import persistent

from . import project, pursuit, session
from .client.protocol import ServerError

BUSY, IDLE = 0.004, 0.1
"""Seconds between looks, while something is under way and otherwise."""

AGAIN = 30.0
"""Seconds after which a server that was lost may be started by itself once more."""

WRITTEN = 1.0
"""Seconds after which a text is taken as written."""

_texts: dict[str, tuple[str, float]] = {}
_now: dict[str, pursuit.Pursuit] = {}
_started: dict[str, float] = {}
_loading: set[str] = set()


def on_shape(callback: Callable[[bpy.types.Scene, Any], None]) -> None:
    """Have `callback(scene, shape)` called whenever a shape is shown."""
    if callback not in pursuit.listeners:
        pursuit.listeners.append(callback)


def is_busy(scene: bpy.types.Scene) -> bool:
    """Whether the shape is not yet what handles and values say."""
    found = _now.get(scene.name)
    if found is None or found.key is not project.opened(scene):
        return project.has_case(scene)
    return not found.is_resting


def settle(scene: bpy.types.Scene | None = None, seconds: float = 60.0) -> None:
    """Bring everything up to date and wait for it; opens the case, and starts moldline, if needed.

    What is wrong is told in the scene's status; a lost server is started again once.
    """
    scene = scene or bpy.context.scene
    if not project.has_case(scene):
        return
    if scene == bpy.context.scene:
        bpy.context.view_layer.update()
    if not project.is_open(scene):
        project.reopen(scene)
    deadline = time.monotonic() + seconds
    for _ in range(3):  # both connections may have been lost
        try:
            while _step(scene, rests=True) and time.monotonic() < deadline:
                time.sleep(0.0005)
            return
        except _Lost:
            session.start()
            if not project.is_open(scene):
                project.reopen(scene)


def step(scene: bpy.types.Scene) -> bool:
    """Look once at what has changed and what has come, without waiting; whether more is to come."""
    try:
        return _step(scene, rests=False)
    except _Lost:
        return False


def forget() -> None:
    """What is under way counts no more: values and handles as they are now decide."""
    for found in _now.values():
        found.again()


class _Lost(Exception):
    """The server went away."""


def _step(scene: bpy.types.Scene, rests: bool) -> bool:
    found = _follow(scene)
    if found is None:
        return False
    try:
        found.step(scene, rests)
    except (ServerError, session.Problem) as error:
        _wrong(scene, found, error)
    return not found.is_resting and found.can_show(scene)


def _follow(scene: bpy.types.Scene) -> pursuit.Pursuit | None:
    """What is under way for a scene, begun anew where its case is another."""
    case = project.opened(scene)
    if case is None or scene.name in _loading:
        return None
    found = _now.get(scene.name)
    if found is None or found.key is not case:
        text, folder = project.text(scene), scene.moldline.folder
        try:
            own = session.live_client().open(text=text, folder=folder)
        except (ServerError, session.Problem) as error:
            project.tell(scene, str(session.met(error)), is_alert=True)
            return None
        if found is not None:
            project.leave(found.case)
        found = _now[scene.name] = pursuit.Pursuit(case, own)
    return found


def _wrong(scene: bpy.types.Scene, found: pursuit.Pursuit, error: Exception) -> None:
    """Say what is wrong; the shape stays."""
    problem = session.met(error)
    project.tell(scene, str(problem), is_alert=True)
    if problem.code in ("disconnected", "timeout", "version"):
        _now.pop(scene.name, None)
        raise _Lost from None
    found.refused()
    if problem.code == "worker died" and _is_time(scene.name):
        found.again()  # once more, in a new process


def _is_time(name: str) -> bool:
    """Whether something may be tried again by itself."""
    last, now = _started.get(name, -AGAIN), time.monotonic()
    if now - last > AGAIN:
        _started[name] = now
    return now - last > AGAIN


def _scenes() -> list[bpy.types.Scene]:
    """Those that somebody looks at."""
    manager = bpy.context.window_manager
    shown = {window.scene.name for window in manager.windows} if manager else set()
    return [one for one in bpy.data.scenes if one.name in shown and project.has_case(one)]


def _tick() -> float:
    """Blender's timer."""
    pause = IDLE
    for scene in _scenes():
        if project.waits(scene):
            if _is_written(scene):
                project.reopen(scene)
        elif step(scene):
            pause = BUSY
    return pause


def _is_written(scene: bpy.types.Scene) -> bool:
    """Whether the case's text is what it was a moment ago: nobody is just writing it."""
    now, text = time.monotonic(), project.text(scene)
    before, since = _texts.get(scene.name, ("", now))
    if text != before:
        _texts[scene.name] = text, now
        return False
    return now - since > WRITTEN


def _hurry() -> None:
    """Look at once."""
    if bpy.app.background:
        return
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    bpy.app.timers.register(_tick, first_interval=0.0, persistent=True)


@persistent
def _updated(scene: bpy.types.Scene, changes: bpy.types.Depsgraph) -> None:
    """Something changed: send it; what comes back is shown by the timer."""
    found = _now.get(scene.name)
    if found is None or found.key is not project.opened(scene):
        return
    shown = scene.moldline.surface
    if any(one.id.original == shown and one.is_updated_geometry for one in changes.updates):
        found.notice(scene)
    before = found.changed_at
    try:
        if found.can_show(scene):
            found.ask(scene)
    except (ServerError, session.Problem) as error:
        with contextlib.suppress(_Lost):
            _wrong(scene, found, error)
    if found.changed_at != before:
        _hurry()


@persistent
def _framed(scene: bpy.types.Scene, *_: Any) -> None:
    """Another frame: in a rendering each has its own shape, in a window they follow."""
    if not project.is_open(scene):
        return
    if bpy.app.background or bpy.app.is_job_running("RENDER"):
        settle(scene)
    else:
        _hurry()


@persistent
def _going_back(*_: Any) -> None:
    """Before undo and redo: what the surface is then is not by hand."""
    forget()


@persistent
def _gone_back(*_: Any) -> None:
    """After undo and redo, and when a file was opened."""
    forget()
    _hurry()


@persistent
def _loaded(*_: Any) -> None:
    """Another file: its cases are opened when moldline runs."""
    _forget_all()
    project.forget()
    _hurry()


def _forget_all() -> None:
    for one in (_now, _texts, _started, _loading, pursuit.known):
        one.clear()


def _lost(_: Exception) -> None:
    """The server is gone: nothing is lost, and it is started once more by itself."""
    for scene in bpy.data.scenes:
        if project.has_case(scene):
            _now.pop(scene.name, None)
            project.tell(scene, "the shape stays as it is until moldline runs again", is_alert=True)
    if not bpy.app.background and _is_time("") and _scenes():
        session.start()


def _there() -> None:
    """The server is there again: it loads the cases, beside Blender, before they are used."""
    _now.clear()
    for scene in _scenes():
        case, name = project.opened(scene), scene.name
        if case is None or bpy.app.background:
            continue
        _loading.add(name)

        def done(_: Any, name: str = name) -> None:
            _loading.discard(name)
            _hurry()

        session.run(lambda _, case=case: case.values(), done, done, what="opening the case")
    _hurry()


HANDLERS = {
    "depsgraph_update_post": _updated,
    "frame_change_post": _framed,
    "undo_pre": _going_back,
    "redo_pre": _going_back,
    "undo_post": _gone_back,
    "redo_post": _gone_back,
    "load_post": _loaded,
}


def register() -> None:
    """Begin to look."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)
    session.on_lost(_lost)
    session.on_ready(_there)
    _hurry()


def unregister() -> None:
    """Look no more."""
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    for name, handler in HANDLERS.items():
        if handler in getattr(bpy.app.handlers, name):
            getattr(bpy.app.handlers, name).remove(handler)
    _forget_all()
    pursuit.listeners.clear()
