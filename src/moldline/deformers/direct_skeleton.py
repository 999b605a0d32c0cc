"""A skeleton whose bones move the geometry's points themselves."""

from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector, is_concrete
from ..errors import ParameterError
from . import bone_motion
from .base import AbstractBinding, DefinedBinding
from .bone_motion import AT_REST, COUNT, Blend, PoseAxes
from .bone_weights import by_distance
from .bones import Bones
from .named import AbstractNamed


class DirectSkeleton(AbstractNamed):
    """Pose bones that move points with no net between.

    It is seldom wanted: shares by distance are once differentiable, so a bent surface has jumps in
    curvature, and it is bent within a bone's distance of the joint where it is thin and far from
    it where it is thick. A `Skeleton` is as smooth as its net. Controls are the same.

    Attributes
    ----------
    bones
        The tree at rest. One at least has no reach, so that every point follows some bone.
    blend, axes
        As in `Skeleton`.
    """

    bones: Bones = eqx.field(static=True)
    blend: str = eqx.field(static=True)
    axes: str = eqx.field(static=True)

    def __init__(self, bones: Bones, *, blend: str = "linear", axes: str = "bone"):
        bone_motion.check_choices(blend, axes)
        if all(np.isfinite(bone.reach) for bone in bones):
            raise ParameterError(
                "every bone has a reach, so a surface that leaves all of them would be torn; give "
                "one bone none, such as one that is never moved"
            )
        self.bones, self.blend, self.axes = bones, blend, axes

    @classmethod
    @override
    def build(
        cls, geometry: Any, *, bones: Path, blend: Blend = "linear", axes: PoseAxes = "bone"
    ) -> "DirectSkeleton":
        """From a case file: bones from a file."""
        return cls(Bones.read(bones), blend=blend, axes=axes)

    @property
    @override
    def size(self) -> int:
        return COUNT * len(self.bones)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        """Numbers of the controls by the name of what they change, such as "inner.rotation"."""
        return bone_motion.parameters(self.bones)

    @property
    @override
    def values(self) -> Vector:
        """What the parameters measure at rest: angles [rad], displacements [m] and factors."""
        return np.tile(AT_REST, len(self.bones))

    @override
    def __call__(self, points: Points, controls: Vector) -> Points:
        return points + self.moves(points, by_distance(self.bones, points), controls)

    @override
    def bind(self, points: Points) -> AbstractBinding:
        if not is_concrete(points):
            return DefinedBinding(self, points)
        return DirectBinding(self, points, np.asarray(by_distance(self.bones, points)))

    def moves(self, points: Points, weights: Float[Array, "n b"], controls: Vector) -> Points:
        """Displacements of points by the bones' shares in them [m]."""
        motion = bone_motion.motion(self.bones, self.axes, controls)
        return bone_motion.displaced(self.bones, motion, weights, points, self.blend)


class DirectBinding(AbstractBinding):
    """Bones and the points that follow them by known shares."""

    skeleton: DirectSkeleton
    points: Points
    weights: Float[np.ndarray, "n b"]

    @override
    def __call__(self, controls: Vector) -> Points:
        return _moved(self, controls)


@eqx.filter_jit
def _moved(binding: DirectBinding, controls: Vector) -> Points:
    return binding.points + binding.skeleton.moves(binding.points, binding.weights, controls)
