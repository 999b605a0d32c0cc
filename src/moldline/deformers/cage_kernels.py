"""The kernels of a harmonic cage for points that move, each other's derivatives."""

# kernels give names and types to what their base leaves open
# mypy: disable-error-code="override"

from typing import TYPE_CHECKING

import jax
import numpy as np
from typing_extensions import override

from .._types import Array
from ..numerics.kernel import AbstractKernel, Arrays
from ..numerics.winding import winding
from .cage_embedding import embedded

if TYPE_CHECKING:
    from .cage import Cage


class Following(AbstractKernel):
    """Points and the cage's displacements to moved points, for points that are not fixed."""

    def __init__(self, cage: "Cage"):
        self.cage = cage
        self.push = Push(self)
        self.pull = Pull(self)

    @override
    def run(self, points: np.ndarray, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        return (embedded(self.cage, points, refuse=False).displaced(moves, points),)

    @override
    def plain(self, points: Array, moves: Array) -> tuple[Array, ...]:
        return (self.cage.followed(points, moves),)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self.push(*arrays, *tangents)

    def slopes(self, points: np.ndarray, moves: np.ndarray) -> np.ndarray:
        """Derivatives of displacements by the points, (n, 3, 3): row moved, column place."""
        found, kind = self.cage.solved.slopes(points, moves)  # type: ignore[union-attr]
        near = np.flatnonzero(kind > 0)  # others are inside
        around = winding(points[near], self.cage.rest, self.cage.shape.faces)
        found[near[around <= 0.5]] = 0.0
        return found


class Push(AbstractKernel):
    """Points, displacements and a tangent of each to the tangent of the moved points."""

    def __init__(self, value: Following):
        self.value = value

    @override
    def run(
        self, points: np.ndarray, moves: np.ndarray, motion: np.ndarray, change: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        slopes = self.value.slopes(points, moves)
        pushed = motion + np.einsum("nij,nj->ni", slopes, motion)
        if np.any(change):
            pushed += embedded(self.value.cage, points, refuse=False).displaced(change, None)
        return (pushed,)

    @override
    def plain(self, points: Array, moves: Array, motion: Array, change: Array) -> tuple[Array, ...]:
        return jax.jvp(self.value.plain, (points, moves), (motion, change))[1]

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        points, moves = arrays[:2]
        return (None, None, *self.value.pull(points, moves, *cotangents))


class Pull(AbstractKernel):
    """Points, displacements and a cotangent to the cotangents of both."""

    def __init__(self, value: Following):
        self.value = value

    @override
    def run(
        self, points: np.ndarray, moves: np.ndarray, vectors: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        slopes = self.value.slopes(points, moves)
        pulled = vectors + np.einsum("nij,ni->nj", slopes, vectors)
        return pulled, embedded(self.value.cage, points, refuse=False).gathered(vectors)

    @override
    def plain(self, points: Array, moves: Array, vectors: Array) -> tuple[Array, ...]:
        return jax.vjp(self.value.plain, points, moves)[1]((vectors,))

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        points, moves = arrays[:2]
        return (None, None, *self.value.push(points, moves, *cotangents))
