"""The lattice's compiled kernels for points that move, each other's derivatives."""

from typing import TYPE_CHECKING

import jax
import numpy as np
from typing_extensions import override

from .._types import Array
from ..numerics import cellwise
from ..numerics.kernel import AbstractKernel, Arrays

if TYPE_CHECKING:
    from .lattice import Lattice


class Following(AbstractKernel):
    """Points and control displacements to moved points, for points that are not fixed."""

    def __init__(self, lattice: "Lattice"):
        self.lattice = lattice
        self.box = cellwise.Box.of(lattice.origin, lattice.inverse, lattice.axes)
        self.weights = cellwise.Weights.of(lattice.axes)
        self.push = Push(self)
        self.pull = Pull(self)

    @override
    def run(self, points: np.ndarray, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        return (cellwise.followed(self.box, self.weights, moves, points),)

    @override
    def plain(self, points: Array, moves: Array) -> tuple[Array, ...]:
        return (points + self.lattice.field(points, moves),)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self.push(*arrays, *tangents)


class Push(AbstractKernel):
    """Points, control displacements and a tangent of each to the tangent of the moved points."""

    def __init__(self, value: Following):
        self.value = value

    @override
    def run(
        self, points: np.ndarray, moves: np.ndarray, motion: np.ndarray, change: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        v = self.value
        return (cellwise.pushed(v.box, v.weights, moves, change, points, motion),)

    @override
    def plain(self, points: Array, moves: Array, motion: Array, change: Array) -> tuple[Array, ...]:
        return jax.jvp(self.value.plain, (points, moves), (motion, change))[1]

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        points, moves = arrays[:2]
        return (None, None, *self.value.pull(points, moves, *cotangents))


class Pull(AbstractKernel):
    """Points, control displacements and a cotangent to the cotangents of both."""

    def __init__(self, value: Following):
        self.value = value

    @override
    def run(
        self, points: np.ndarray, moves: np.ndarray, vectors: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        return cellwise.pulled(self.value.box, self.value.weights, moves, points, vectors)

    @override
    def plain(self, points: Array, moves: Array, vectors: Array) -> tuple[Array, ...]:
        return jax.vjp(self.value.plain, points, moves)[1]((vectors,))

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        points, moves = arrays[:2]
        return (None, None, *self.value.push(points, moves, *cotangents))
