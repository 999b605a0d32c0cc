"""A skeleton: posed bones that move the control points of a net, which moves the geometry."""

from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, ArrayLike, Vector
from ..errors import ParameterError
from . import bone_motion, bone_weights
from .bone_motion import AT_REST, COUNT, Blend, PoseAxes
from .bone_weights import Weights
from .bones import Bones
from .lattice import Lattice
from .net import AbstractControlNet
from .posed import AbstractPosed


class Skeleton(AbstractPosed):
    """Pose bones; they move a net's control points, and these the geometry.

    Each bone has ten controls, all zero at rest: `NAME.rotation`, a vector along the axis and as
    long as the angle [rad]; `NAME.translation` [m]; `NAME.stretch` e, by which the bone is 1 + e as
    long; `NAME.scale`, three s by which what follows it grows 1 + s times along its own axes about
    its head. A bone carries its children on its tail: they turn, move and ride on its stretch, but
    do not take its scale.

    Attributes
    ----------
    bones
        The tree at rest.
    net
        What moves the geometry. With clamped ends, or a cage, it gives back exactly what one bone
        does; a lattice with Blender's ends errs there by up to a sixth of a cell's motion.
    weights
        Share of each bone in each control point, shape (c, b). Built from "distance", "envelope"
        as in Blender, or numbers of one's own, whose rows are divided by their sums.
    blend
        "linear": of the bones' matrices. "dual quaternion": of the rotations and translations,
        which keeps the volume at a bent joint.
    axes
        Of rotation and translation. "bone": the bone's own, carried by its parent. "global": those
        of space, whatever the parent does.

    Notes
    -----
    docs/theory/skeleton.md derives it and names the sources.
    """

    bones: Bones = eqx.field(static=True)
    net: AbstractControlNet
    weights: Float[np.ndarray, "c b"]
    blend: str = eqx.field(static=True)
    axes: str = eqx.field(static=True)

    def __init__(
        self,
        bones: Bones,
        net: AbstractControlNet,
        *,
        weights: str | ArrayLike = "distance",
        blend: str = "linear",
        axes: str = "bone",
    ):
        bone_motion.check_choices(blend, axes)
        self.bones, self.net, self.blend, self.axes = bones, net, blend, axes
        rest = net.rest.reshape(-1, 3)
        if not isinstance(weights, str):
            shares = bone_weights.by_hand(weights, len(rest), bones)
        elif weights == "distance":
            shares = bone_weights.by_distance(bones, rest)
        elif weights == "envelope":
            shares = bone_weights.by_envelope(bones, rest)
        else:
            raise ParameterError(f"weights must be distance, envelope or an array, got {weights!r}")
        self.weights = np.asarray(shares)

    @classmethod
    @override
    def build(
        cls,
        geometry: Any,
        *,
        bones: Path,
        cage: Path | None = None,
        shape: tuple[int, int, int] | None = None,
        margin: float | tuple[float, float, float] = 0.02,
        component: str | None = None,
        degree: int | tuple[int, int, int] = 3,
        low: tuple[float, float, float] | None = None,
        high: tuple[float, float, float] | None = None,
        weights: Weights | tuple[tuple[float, ...], ...] = "distance",
        blend: Blend = "linear",
        axes: PoseAxes = "bone",
        store: Path = Path(".moldline"),
    ) -> "Skeleton":
        """From a case file: bones from a file, in a cage from a file or a lattice of a shape.

        The lattice lies around the geometry or one component of it, or from low to high. Weights by
        hand are a row for each control point, in the order of the net. `store` is the cage's.
        """
        net: AbstractControlNet
        if shape is not None and cage is None:
            place: dict[str, Any] = {"low": low, "high": high, "degree": degree}
            net = Lattice.build(geometry, shape=shape, margin=margin, component=component, **place)
        elif cage is not None and shape is None:
            from .cage import Cage

            net = Cage.build(geometry, file=cage, store=store)
        else:
            raise ParameterError("a skeleton takes either cage, a file, or shape, of a lattice")
        shares = weights if isinstance(weights, str) else _rows(weights)
        return cls(Bones.read(bones), net, weights=shares, blend=blend, axes=axes)

    @property
    @override
    def size(self) -> int:
        return COUNT * len(self.bones)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return bone_motion.parameters(self.bones)

    @property
    @override
    def values(self) -> Vector:
        """Angles [rad], displacements [m] and factors at rest."""
        return np.tile(AT_REST, len(self.bones))

    @override
    def pose(self, controls: Vector) -> Float[Array, "moves"]:
        motion = bone_motion.motion(self.bones, self.axes, controls)
        rest = self.net.rest.reshape(-1, 3)
        return bone_motion.displaced(self.bones, motion, self.weights, rest, self.blend).ravel()


def _rows(weights: tuple[tuple[float, ...], ...]) -> np.ndarray:
    lengths = sorted({len(row) for row in weights})
    if len(lengths) > 1:
        raise ParameterError(
            f"weights by hand are rows of one length, got rows of {lengths[0]} and {lengths[-1]}"
        )
    return np.array(weights, float)
