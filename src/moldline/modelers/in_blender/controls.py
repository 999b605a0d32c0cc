"""Control positions: lattice points, vertices of cages, bones; changes of them are numbers."""

import abc
from typing import Any

import bpy  # type: ignore[import-not-found,unused-ignore]
import numpy as np

from . import meshes
from .wrong import Wrong, there_are

MOTIONS = ("location", "rotation", "scale")


class AbstractMoved(abc.ABC):
    """What some numbers move; all of it begins from where the file has it."""

    name: str
    block: Any
    labels: list[str]
    kind: str

    @abc.abstractmethod
    def write(self, numbers: np.ndarray) -> None:
        """Move it by so much from where the file has it."""


class Positions:
    """All control points of one object, which several controls may move."""

    def __init__(self, body: Any):
        self.body, self.data = body, body.data
        self.is_lattice = body.type == "LATTICE"
        self.base = self._read().astype(float)
        self.into = np.linalg.inv(np.array(body.matrix_world, float)[:3, :3])
        self.change = np.zeros_like(self.base)

    def _read(self) -> np.ndarray:
        if not self.is_lattice:
            return meshes.positions(self.data)
        found = np.empty(3 * len(self.data.points), np.float32)
        self.data.points.foreach_get("co_deform", found)
        return found.reshape(-1, 3)

    def begin(self) -> None:
        """Forget what was told before."""
        self.change[:] = 0.0

    def finish(self) -> None:
        """Put them where all that was told has them."""
        points = (self.base + self.change @ self.into.T).astype(np.float32)
        if self.is_lattice:
            self.data.points.foreach_set("co_deform", points.ravel())
            self.data.update_tag()
        else:
            meshes.place(self.data, points)


class MovedPoints(AbstractMoved):
    """Positions of a lattice or vertices of a mesh, moved along the axes of space."""

    def __init__(self, name: str, given: dict[str, Any], points: Positions):
        self.name, self.points, self.block = name, points, points.data
        self.kind = "length"
        numbers, weights = _chosen(name, given, points)
        self.numbers, self.weights = numbers, weights
        self.axes = ["xyz".index(axis) for axis in given["axes"]]
        self.is_together = given["together"]
        whose = ["together"] if self.is_together else [str(k) for k in numbers]
        self.labels = [f"{who}.{axis}" for who in whose for axis in given["axes"]]

    def write(self, numbers: np.ndarray) -> None:
        moves = numbers.reshape(-1, len(self.axes))
        if self.is_together:
            moves = self.weights[:, None] * moves
        for k, axis in enumerate(self.axes):
            np.add.at(self.points.change[:, axis], self.numbers, moves[:, k])


class MovedBones(AbstractMoved):
    """Bones of an armature, in the coordinates of their poses."""

    def __init__(self, name: str, given: dict[str, Any], body: Any):
        self.name, self.block = name, body
        motion = given["motion"]
        self.kind = {"location": "length", "rotation": "angle", "scale": "factor"}[motion]
        own = [bone.name for bone in body.pose.bones]
        wanted = given.get("bones") or own
        missing = [bone for bone in wanted if bone not in own]
        if missing:
            raise Wrong(
                "parameter",
                f"controls {name!r}: {body.name!r} has no bone {missing[0]!r}; {there_are(own)}",
            )
        self.bones = [body.pose.bones[bone] for bone in wanted]
        self.axes = ["xyz".index(axis) for axis in given["axes"]]
        self.is_together = given["together"]
        whose = ["together"] if self.is_together else list(wanted)
        self.labels = [f"{who}.{axis}" for who in whose for axis in given["axes"]]
        self.attribute = {"rotation": "rotation_euler"}.get(motion, motion)
        if motion == "rotation":
            for bone in self.bones:
                if bone.rotation_mode in ("QUATERNION", "AXIS_ANGLE"):
                    bone.rotation_mode = "XYZ"
        self.base = [np.array(getattr(bone, self.attribute), float) for bone in self.bones]

    def write(self, numbers: np.ndarray) -> None:
        moves = np.zeros((len(self.bones), 3))
        moves[:, self.axes] = numbers.reshape(-1, len(self.axes))
        for bone, base, move in zip(self.bones, self.base, moves, strict=True):
            setattr(bone, self.attribute, base + move)
        self.block.update_tag()


def moved(name: str, given: dict[str, Any], known: dict[str, Positions]) -> AbstractMoved:
    """What a table of controls moves; `known` are the points of objects that others move too."""
    body = bpy.data.objects.get(given["object"])
    if body is None:
        raise Wrong(
            "parameter",
            f"controls {name!r}: the file has no object {given['object']!r}; "
            f"{there_are([one.name for one in bpy.data.objects])}",
        )
    wrong = [key for key in ("points", "group", "bones") if given.get(key) is not None]
    if body.type == "ARMATURE":
        if set(wrong) - {"bones"}:
            raise Wrong("parameter", f"controls {name!r}: {body.name!r} has bones, no {wrong[0]}")
        return MovedBones(name, given, body)
    if body.type not in ("LATTICE", "MESH"):
        raise Wrong(
            "parameter",
            f"controls {name!r}: {body.name!r} is of type {body.type}; what has control positions "
            "are lattices, meshes and armatures",
        )
    if "bones" in wrong or given["motion"] != "location":
        raise Wrong(
            "parameter",
            f"controls {name!r}: {body.name!r} has points, which have a location only and are "
            "chosen by `points` or `group`",
        )
    if body.type == "LATTICE" and body.data.shape_keys is not None:
        raise Wrong(
            "parameter",
            f"controls {name!r}: the lattice {body.name!r} has shape keys, which say where its "
            "points are; turn their values",
        )
    points = known.setdefault(body.data.name_full, Positions(body))
    return MovedPoints(name, given, points)


def _chosen(name: str, given: dict[str, Any], points: Positions) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of points, and their weights."""
    count, group = len(points.base), given.get("group")
    if group is not None:
        return _of_group(name, group, points)
    wanted = given.get("points")
    numbers = np.arange(count) if wanted is None else np.asarray(wanted, int)
    bad = numbers[(numbers < 0) | (numbers >= count)]
    if len(bad):
        raise Wrong(
            "parameter",
            f"controls {name!r}: {points.body.name!r} has no point {bad[0]}; it has {count}, "
            "counted from 0",
        )
    return numbers, np.ones(len(numbers))


def _of_group(name: str, group: str, points: Positions) -> tuple[np.ndarray, np.ndarray]:
    body = points.body
    found = body.vertex_groups.get(group)
    if found is None:
        raise Wrong(
            "parameter",
            f"controls {name!r}: {body.name!r} has no vertex group {group!r}; "
            f"{there_are([one.name for one in body.vertex_groups])}",
        )
    numbers, weights = [], []
    for k, point in enumerate(body.data.points if points.is_lattice else body.data.vertices):
        for member in point.groups:
            if member.group == found.index and member.weight > 0:
                numbers.append(k)
                weights.append(member.weight)
    if not numbers:
        raise Wrong("parameter", f"controls {name!r}: the vertex group {group!r} is empty")
    return np.array(numbers), np.array(weights)
