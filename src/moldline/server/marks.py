"""Places that show what a deformer without control points does: bones, and what pilots hold."""

import abc
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from typing_extensions import override

from .._types import Array
from ..deformers import bone_motion
from ..deformers.base import AbstractDeformer
from ..deformers.body_skeleton import BodySkeleton
from ..deformers.bones import Bones
from ..deformers.direct_skeleton import DirectSkeleton
from ..deformers.hinge import Hinge
from ..deformers.pilots import SHOWN, Pilots
from ..deformers.skeleton import Skeleton
from ..deformers.wing_skeleton import WingSkeleton
from ..numerics.rotation import turn
from ..pipeline.stage import Stage

Moving = Callable[[Array], Array]
"""Places, (p, 3), by controls."""


class AbstractMarks(abc.ABC):
    """Places by the controls of a deformer, differentiable.

    Attributes
    ----------
    kind
        "bones" or "marks".
    labels
        A name for each bone or mark.
    """

    kind: str
    labels: list[str]

    @abc.abstractmethod
    def rest(self, source: Array | None) -> np.ndarray:
        """Where they are before any stage, (p, 3), given the points there."""

    @abc.abstractmethod
    def places(self, controls: Array, seen: Array | None, present: Array | None) -> np.ndarray:
        """Where controls put them, (p, 3), given the shape that the stage sees, and the present."""

    @abc.abstractmethod
    def slopes(self, controls: Array, seen: Array | None, present: Array | None) -> np.ndarray:
        """Their motion for a unit of each control, (3 p, k)."""


class BoneMarks(AbstractMarks):
    """Head, tail and a point beside each bone."""

    def __init__(self, moving: Moving, neutral: np.ndarray, labels: list[str]):
        self.kind, self.labels = "bones", labels
        self._rest = np.asarray(moving(jnp.asarray(neutral, float)))
        self._moving = jax.jit(moving)
        self._sloped = jax.jit(jax.jacfwd(moving))

    @override
    def rest(self, source: Array | None) -> np.ndarray:
        return self._rest

    @override
    def places(self, controls: Array, seen: Array | None, present: Array | None) -> np.ndarray:
        return np.asarray(self._moving(controls))

    @override
    def slopes(self, controls: Array, seen: Array | None, present: Array | None) -> np.ndarray:
        return np.asarray(self._sloped(controls)).reshape(-1, len(controls))


class PilotMarks(AbstractMarks):
    """Where pilots hold the shape: of those that read few points."""

    def __init__(self, pilots: Pilots, is_bound: bool):
        self.kind = "marks"
        few = {name: m for name, m in pilots.pilots.items() if len(m.reads) <= SHOWN}
        self._few = list(few.values())
        self._reads = np.unique(np.concatenate([np.zeros(0), *(m.reads for m in self._few)]))
        self._reads = self._reads.astype(int)
        self._own = [np.searchsorted(self._reads, m.reads) for m in self._few]
        at = self._marked(jnp.asarray(pilots.rest)[self._reads])
        self.labels = [
            name if len(rows) == 1 else f"{name}[{i}]"
            for name, rows in zip(few, at, strict=True)
            for i in range(len(rows))
        ]

        def moving(controls: Array, seen: Array, present: Array) -> Array:
            net, x = pilots.net, pilots.pose(controls)
            if not is_bound:
                net, x = pilots.settle(seen, controls)
            start = seen[self._reads]
            moved = present[self._reads] + (net(start, x) - start)
            return jnp.concatenate([jnp.zeros((0, 3)), *self._marked(moved)])

        self._moving = jax.jit(moving)
        self._sloped = jax.jit(jax.jacfwd(moving))

    @override
    def rest(self, source: Array | None) -> np.ndarray:
        assert source is not None
        found = self._marked(jnp.asarray(source)[self._reads])
        return np.concatenate([np.zeros((0, 3)), *found])

    @override
    def places(self, controls: Array, seen: Array | None, present: Array | None) -> np.ndarray:
        return np.asarray(self._moving(controls, seen, present))

    @override
    def slopes(self, controls: Array, seen: Array | None, present: Array | None) -> np.ndarray:
        found = np.asarray(self._sloped(controls, seen, present))
        return found.reshape(-1, len(controls))

    def _marked(self, read: Array) -> list[Array]:
        """Marks of each measure, from the places of the points that are read."""
        return [m.marks(read[own]) for m, own in zip(self._few, self._own, strict=True)]


def marks_of(stage: Stage, is_bound: bool) -> AbstractMarks | None:
    """What shows a deformer; None of one that nothing shows."""
    own = stage.deformer
    if isinstance(own, Pilots):
        found = PilotMarks(own, is_bound)
        return found if found.labels else None
    if isinstance(own, WingSkeleton | BodySkeleton):
        places, labels = _sections(own)
        return BoneMarks(lambda controls: own(places, controls), np.asarray(own.neutral), labels)
    if isinstance(own, Skeleton | DirectSkeleton):
        bones, axes = own.bones, own.axes
        names = [bone.name for bone in bones]
        return BoneMarks(lambda c: _posed(bones, axes, c), np.asarray(own.neutral), names)
    if isinstance(own, Hinge):
        return BoneMarks(lambda controls: _hinged(own, controls), np.zeros(1), ["hinge"])
    return None


def _sections(own: WingSkeleton | BodySkeleton) -> tuple[np.ndarray, list[str]]:
    """At rest: of a wing's stations leading and trailing edge and a place above the former.

    Of a body's the centre, the top and the side.
    """
    net, count = own.net, len(own.net.stations)
    sizes, frame = net.scales[:, None], np.eye(3)
    middle = np.zeros((count, 3))
    if isinstance(own, WingSkeleton):
        middle[:, 1], middle[:, [0, 2]] = net.stations, net.origins
        lean = np.asarray(own.twist)[:, None]
        along = np.cos(lean) * frame[0] - np.sin(lean) * frame[2]
        beside = np.sin(lean) * frame[0] + np.cos(lean) * frame[2]
        side = np.array([1.0, net.sides[0], 1.0])
    else:
        middle[:, 0], middle[:, 1:] = net.stations, net.origins
        along, beside = np.tile(frame[2], (count, 1)), np.tile(frame[1], (count, 1))
        side = np.ones(3)
    places = np.stack([middle, middle + sizes * along, middle + sizes * beside], axis=1) * side
    return places.reshape(-1, 3), [f"station {i}" for i in range(count)]


def _posed(bones: Bones, axes: str, controls: Array) -> Array:
    """Where bones are by their own motion; the third point is along their z axis."""
    found = bone_motion.motion(bones, axes, controls)
    levers = np.stack([bones.tails - bones.heads, bones.axes[:, :, 2]], axis=1)
    levers[:, 1] *= np.linalg.norm(levers[:, 0], axis=1, keepdims=True)
    heads = bones.heads + found.shifts
    grown = levers + jnp.einsum("bij,bkj->bki", found.growths, levers)
    turned = grown + turn(found.rotations[:, None], grown)
    return jnp.concatenate([heads[:, None], heads[:, None] + turned], axis=1).reshape(-1, 3)


def _hinged(hinge: Hinge, controls: Array) -> Array:
    """The line, and a place behind it that turns by the whole angle."""
    along, behind, _ = np.linalg.inv(hinge.inverse)
    lever, angle = hinge.length * behind, controls[0]
    across = np.cross(hinge.axis, lever)
    turned = lever + jnp.sin(angle) * across
    turned = turned + 2 * jnp.sin(angle / 2) ** 2 * np.cross(hinge.axis, across)
    end = hinge.start + hinge.length * along
    return jnp.stack([jnp.asarray(hinge.start), jnp.asarray(end), hinge.start + turned])


def is_shown(deformer: AbstractDeformer) -> bool:
    """Whether something shows it."""
    few = isinstance(deformer, Pilots) and any(
        len(m.reads) <= SHOWN for m in deformer.pilots.values()
    )
    kinds = WingSkeleton | BodySkeleton | Skeleton | DirectSkeleton | Hinge
    return few or isinstance(deformer, kinds)
