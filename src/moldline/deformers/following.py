"""Kernels of nets of control points for points that move, each other's derivatives."""

import abc

import jax
import numpy as np
from typing_extensions import override

from .._types import Array
from ..numerics.kernel import AbstractKernel, Arrays


class AbstractFollowing(AbstractKernel):
    """Points and control displacements to moved points, for points that are not fixed."""

    push: "Push"
    pull: "Pull"

    @abc.abstractmethod
    def pushed(
        self, points: np.ndarray, moves: np.ndarray, motion: np.ndarray, change: np.ndarray
    ) -> np.ndarray:
        """The tangent of the moved points, from those of points and displacements."""

    @abc.abstractmethod
    def pulled(
        self, points: np.ndarray, moves: np.ndarray, vectors: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The cotangents of points and displacements, from that of the moved points."""

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self.push(*arrays, *tangents)


class Push(AbstractKernel):
    """Points, control displacements and a tangent of each to the tangent of the moved points."""

    def __init__(self, value: AbstractFollowing):
        self.value = value

    @override
    def run(
        self, points: np.ndarray, moves: np.ndarray, motion: np.ndarray, change: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        return (self.value.pushed(points, moves, motion, change),)

    @override
    def plain(self, points: Array, moves: Array, motion: Array, change: Array) -> tuple[Array, ...]:
        return jax.jvp(self.value.plain, (points, moves), (motion, change))[1]

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        points, moves = arrays[:2]
        return (None, None, *self.value.pull(points, moves, *cotangents))


class Pull(AbstractKernel):
    """Points, control displacements and a cotangent to the cotangents of both."""

    def __init__(self, value: AbstractFollowing):
        self.value = value

    @override
    def run(
        self, points: np.ndarray, moves: np.ndarray, vectors: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        return self.value.pulled(points, moves, vectors)

    @override
    def plain(self, points: Array, moves: Array, vectors: Array) -> tuple[Array, ...]:
        return jax.vjp(self.value.plain, points, moves)[1]((vectors,))

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        points, moves = arrays[:2]
        return (None, None, *self.value.push(points, moves, *cotangents))
