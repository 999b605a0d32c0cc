# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of one scene on its way to what handles and values say."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import bpy
import numpy as np

from . import convert, edits, handles, project, results
from .client.remote import Handle

REST = 0.15
"""Seconds without a change after which a drag has come to rest."""

NETS = 0.1
"""Seconds between looks at where the other handles are, during a drag."""

MOST_KNOWN = 100
"""States of handles whose values are kept, so that going back gives the same numbers."""

CAMERA = ("VIEW3D_OT_", "VIEW2D_OT_", "SCREEN_OT_", "WM_OT_", "MOLDLINE_OT_", "UI_OT_")
"""Modal operators that move nothing of ours."""

Values = dict[str, np.ndarray]

known: dict[tuple[str, str, str, bytes], Values] = {}
"""Values that belong to where a handle of a case is."""

listeners: list[Callable[[bpy.types.Scene, Any], None]] = []
"""Called with the scene and each shape that is shown."""


class Pursuit:
    """What is under way for one scene: what was asked for, and what has come.

    Coarse shapes, in single precision, follow a drag. When it rests, the fine one comes, and each
    handle goes where the values have it.

    Attributes
    ----------
    key, case
        The case that the scene had when this began, and the same on the connection of drags.
    values
        Those that were asked for last; None to ask again, whatever they are.
    is_resting
        Whether all is up to date.
    changed_at
        When something was asked for last.
    """

    def __init__(self, key: Any, case: Any):
        self.key = key
        self.values: Values | None = None
        self.is_resting = False
        self.changed_at = 0.0
        self.case = case
        self._coarse, self._fine = case.live(dtype="<f4"), case.live()
        self._joined = {case.connectivity or "": case.joining}
        self._asked: dict[str, bytes] = {}
        self._pulled, self._is_pull, self._is_fine = "", False, False
        self._nets: tuple[int, Values] | None = None
        self._nets_of: Values | None = None
        self._nets_at = 0.0
        self._places: dict[int, Handle] = {}
        self._before_edit: np.ndarray | None = None
        self._broken: list[str] = []

    def again(self) -> None:
        """Values and handles as they are now decide, whatever was asked for before."""
        self.values, self.is_resting = None, False
        self._asked = dict.fromkeys(self._asked, b"")  # also one that is where it was put

    def refused(self) -> None:
        """What was asked for cannot be had: a handle goes back; values stay as they were given."""
        self._nets, self._is_fine = None, False
        if self._is_pull:
            self._is_pull = False
        else:
            self.is_resting = True

    def step(self, scene: bpy.types.Scene, at_once: bool) -> None:
        """Send what has changed, show what has come; `at_once` a drag counts as over."""
        if self.can_show(scene):
            self.ask(scene)
            self._take(scene)
            self._rest(scene, at_once)
            self._complain(scene)

    def can_show(self, scene: bpy.types.Scene) -> bool:
        """Whether there is a surface that may be moved."""
        shown = project.surface(scene)
        if shown is None:
            return False
        if shown.mode in ("EDIT", "SCULPT"):
            if self._before_edit is None:
                self._before_edit = _coordinates(shown.data)
            return False
        if self._before_edit is not None:
            is_same = np.array_equal(self._before_edit, _coordinates(shown.data))
            self._before_edit = None
            if not is_same:
                _edited(scene, shown)
        return not shown.get(results.EDITED, False)

    def notice(self, scene: bpy.types.Scene) -> None:
        """The surface's mesh is another than before: see whether that is by hand."""
        shown = project.surface(scene)
        is_still = self.is_resting and shown is not None and shown.mode == "OBJECT"
        if is_still and self._before_edit is None and not convert.has_doubles(shown.data):
            _edited(scene, shown)

    def ask(self, scene: bpy.types.Scene) -> None:
        """Send what has changed: a handle that was moved, else values."""
        for obj, moved, touched, mark in self._moved(scene):
            if self._coarse.is_busy and self._pulled != obj.name:
                break  # one after the other: the latest request takes the place of all others
            self._asked[obj.name], self._pulled = mark, obj.name
            own = known.get(_key(scene, obj, mark))
            if own is not None:  # where it has been before: to the bit the same numbers
                project.set_values(scene, own)
                self._changed(self.values, is_pull=False)
                break
            values = project.values(scene)
            chosen = touched if touched.any() else None
            self._changed(values, is_pull=True)
            self._coarse.pull(obj.moldline.stage, moved, values, chosen)
            return
        values = project.values(scene)
        if self.values is None or not same(values, self.values):
            self._changed(values, is_pull=False)
            self._coarse.push(values)

    def _complain(self, scene: bpy.types.Scene) -> None:
        """Say once of a handle that it has lost or gained points, and so moves nothing."""
        broken = [obj.name for obj in handles.broken(scene)]
        if broken and broken != self._broken and self.is_resting:
            project.tell(
                scene,
                f"{broken[0]!r} has other points than its stage, so it moves nothing; 'Show "
                "Handles' makes it again",
                is_alert=True,
            )
        if self.is_resting:
            self._broken = broken

    def _changed(self, values: Values | None, is_pull: bool) -> None:
        self.values, self._is_pull = values, is_pull
        self._is_fine = self.is_resting = False
        self.changed_at = time.monotonic()

    def _moved(self, scene: bpy.types.Scene) -> Iterator[tuple]:
        """Handles that a hand has moved, or moved back, since they were last asked for."""
        for obj in handles.all_of(scene):
            mark, asked = mark_of(obj), self._asked.get(obj.name)
            if mark == asked:
                continue
            told = handles.state(obj)
            if told is not None and (told[1].any() or asked is not None):
                yield obj, *told, mark

    def _take(self, scene: bpy.types.Scene) -> None:
        """Show what has come."""
        shape = self._coarse.poll()
        if shape is not None:
            self._show(scene, shape)
            if shape.values is not None and self._is_pull:
                project.set_values(scene, shape.values)
                self.values = project.values(scene)
                at = ", ".join(shape.miss["at_bounds"][:4])
                project.tell(scene, f"at its bounds: {at}" if at else "")
            elif not self._is_pull:
                project.tell(scene, "")
        if self._answered():
            self._show_nets(scene)
        is_old = self._nets_of is None or not same(self._nets_of, self.values or {})
        is_time = time.monotonic() - self._nets_at > NETS
        if is_old and is_time and not (self._is_pull and self._coarse.is_busy):
            self._ask_nets()

    def _show(self, scene: bpy.types.Scene, shape: Any) -> None:
        name = shape.connectivity or ""
        if shape.faces is not None:
            self._joined[name] = shape.faces, shape.tags, shape.components
        shown, joined = project.surface(scene), self._joined.get(name)
        if joined is not None and shown.get(results.JOINED) != name:
            if joined[0] is not None and results.is_other(shown.data, shape.points, joined[0]):
                convert.set_faces(shown, shape.points, *joined)
            shown[results.JOINED] = name
        if len(shown.data.vertices) == len(shape.points):
            convert.set_points(shown.data, shape.points)
        else:
            _edited(scene, shown)
        for tell in listeners:
            tell(scene, shape)

    def _ask_nets(self) -> None:
        """Ask where values have the handles, unless that is being asked already."""
        if self._nets is None and self.values is not None:
            listed = {name: one.tolist() for name, one in self.values.items()}
            self._nets = self.case.send("handles", values=listed), self.values
            self._nets_at = time.monotonic()

    def _answered(self) -> bool:
        """Whether it has just come where the handles are."""
        told = self.case.taken(self._nets[0]) if self._nets is not None else None
        if told is not None:
            self._places, self._nets_of, self._nets = _stages(told), self._nets[1], None
        return told is not None

    def _show_nets(self, scene: bpy.types.Scene, lets_go: bool = False) -> None:
        """Move handles to where values have them; those in a hand only when it lets go."""
        stages = self._places
        for obj in handles.all_of(scene):
            handle = stages.get(obj.moldline.stage)
            if handle is None or len(handle.labels) != len(obj[handles.FROZEN]):
                continue
            is_held = obj.name in self._asked or handles.state(obj)[1].any()
            if is_held and not (lets_go and mark_of(obj) == self._asked.get(obj.name)):
                continue
            handles.write(obj, handle.moved)
            self._asked.pop(obj.name, None)
            if lets_go:
                _remember(scene, obj)

    def _rest(self, scene: bpy.types.Scene, at_once: bool) -> None:
        """When a drag is over: doubles, and each handle where the values have it."""
        if self.is_resting or self._coarse.is_busy or self.values is None:
            return
        is_early = time.monotonic() - self.changed_at < REST or is_dragging()
        if is_early and not at_once:
            return
        if not self._is_fine:
            self._is_fine = True
            self._fine.push(self.values)
        shape = self._fine.poll(0.02 if at_once else 0.0)
        if shape is not None:
            self._show(scene, shape)
        if self._fine.is_busy:
            return
        self._answered()
        if self._nets_of is None or not same(self._nets_of, self.values):
            self._ask_nets()
        elif not any(True for _ in self._moved(scene)):
            self._show_nets(scene, lets_go=True)
            self.is_resting, self._is_pull = True, False


def mark_of(obj: bpy.types.Object) -> bytes:
    """Where Blender has a handle."""
    return handles.own(obj).tobytes() + handles.placed(obj).tobytes()


def _edited(scene: bpy.types.Scene, shown: bpy.types.Object) -> None:
    """Keep what was done to the surface by hand, and say so."""
    shown[results.EDITED] = True
    project.tell(scene, results.BY_HAND, is_alert=True)


def _coordinates(mesh: bpy.types.Mesh) -> np.ndarray:
    """Of a mesh as it is outside edit mode, also while it is in it."""
    found = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", found)
    return found


def same(one: Values, other: Values) -> bool:
    """Whether values are alike."""
    return one.keys() == other.keys() and all(np.array_equal(v, other[n]) for n, v in one.items())


def is_dragging() -> bool:
    """Whether a tool of Blender's is just moving something."""
    manager = bpy.context.window_manager
    for window in manager.windows if manager is not None else ():
        for one in getattr(window, "modal_operators", ()):
            if not one.bl_idname.startswith(CAMERA):
                return True
    return False


def _stages(told: Any) -> dict[int, Handle]:
    """Handles by stage, from an answer."""
    own, found = ("lines", "rest", "moved", "frozen"), {}
    for i, one in enumerate(told.header["handles"]):
        arrays = {name: told.arrays[f"{name}.{i}"] for name in own}
        found[one["stage"]] = Handle(**{**one, **arrays})
    return found


def _key(scene: bpy.types.Scene, obj: bpy.types.Object, mark: bytes) -> tuple:
    """In another case the same place may belong to other values."""
    return scene.moldline.folder, project.text(scene), obj.name, mark


def _remember(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """The values that belong to where a handle is."""
    stages = edits.tables(project.text(scene)).get("stage", [])
    if 0 <= obj.moldline.stage < len(stages):
        names = {row["variable"] for row in stages[obj.moldline.stage].get("link", [])}
        key = _key(scene, obj, mark_of(obj))
        known.pop(key, None)
        known[key] = {n: v for n, v in project.values(scene).items() if n in names}
        while len(known) > MOST_KNOWN:
            del known[next(iter(known))]
