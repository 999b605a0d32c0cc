# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of the case's text, asked of moldline, which keeps comments and refuses what is wrong."""

from collections.abc import Callable
from typing import Any

import bpy

from . import edits, project, session, view, window

Make = Callable[[Any], edits.Edits]
"""Edits, made in a thread beside Blender with the client at hand."""

_under_way: set[str] = set()
"""Scenes whose case is being changed."""


def amend(
    operator: Any,
    context: Any,
    what: str,
    make: Make | edits.Edits,
    then: Callable[[Any], None] | None = None,
) -> set[str]:
    """Change the case and open it again; what is wrong is told as the operator's error.

    `then` is called with the scene when the case is open again.
    """
    scene = context.scene
    if scene.moldline.text is None:
        operator.report({"ERROR"}, "there is no case yet; add a parameterisation first")
        return {"CANCELLED"}
    name, text, folder = scene.name, scene.moldline.text.as_string(), scene.moldline.folder
    if name in _under_way and session.busy():  # what comes second would undo the first
        operator.report({"WARNING"}, "the case is just being changed; wait a moment")
        return {"CANCELLED"}
    problems: list[str] = []
    _under_way.add(name)

    def work(client: Any) -> str:
        try:
            wanted = make(client) if callable(make) else make
        except edits.Wrong as problem:
            raise session.Problem(str(problem)) from None
        return client.amend(text, folder, wanted)["text"]

    def done() -> None:
        _under_way.discard(name)
        own = bpy.data.scenes[name]
        view.sync(own)
        if then is not None:
            then(own)
        view.looked(own)
        view.redraw()
        _push_undo(what)

    def taken(new: str) -> None:
        project.update_text(bpy.data.scenes[name], new, then=done, failed=failed, undo="")

    def failed(problem: Any) -> None:
        _under_way.discard(name)
        problems.append(str(problem))
        if not bpy.app.background:  # the operator has ended by now
            window.tell(problem)

    session.run(work, then=taken, failed=failed, what=what)
    return finished(operator, problems)


def _push_undo(what: str) -> None:
    """Make an undo step, out of edit mode for a moment: steps made there hold the mesh alone."""
    windows = [] if bpy.app.background else bpy.context.window_manager.windows
    if not windows:
        return
    with bpy.context.temp_override(window=windows[0]):
        active = bpy.context.view_layer.objects.active
        is_edited = active is not None and active.mode == "EDIT"
        if is_edited:
            bpy.ops.object.mode_set(mode="OBJECT")
        window.push_undo(what)
        if is_edited:
            bpy.ops.object.mode_set(mode="EDIT")
            window.push_undo("Edit Mode")


def finished(operator: Any, problems: list[str]) -> set[str]:
    """How an operator ends, by the problems that are known by then."""
    if problems:
        operator.report({"ERROR"}, problems[0])
        return {"CANCELLED"}
    return {"FINISHED"}
