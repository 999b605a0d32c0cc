"""A program as operations of JAX: its points, their motions, and gradients by its parameters."""

from typing import Any

import jax
import numpy as np
from typing_extensions import override

from .._types import Array
from ..errors import ParameterError
from ..numerics.kernel import AbstractKernel, Arrays
from .program_slopes import Change, Slopes


class Values(AbstractKernel):
    """Parameters, and points of the file in if there is one, to points."""

    def __init__(self, slopes: Slopes):
        self.slopes = slopes
        self.motions = Motions(slopes)

    @override
    def run(self, numbers: np.ndarray, *points: np.ndarray) -> tuple[np.ndarray, ...]:
        return (np.array(self.slopes.points(_own(numbers), _only(points))),)

    @override
    def plain(self, *arrays: Array) -> tuple[Array, ...]:
        return _called(self, self.slopes.rest.points.shape, arrays)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self.motions(*arrays, *tangents)


class Motions(AbstractKernel):
    """The same and a change of each, to the motion of the points."""

    def __init__(self, slopes: Slopes):
        self.slopes = slopes
        self.gradient = Gradient(slopes)

    @override
    def run(self, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        (numbers, *points), (change, *moves) = _halves(arrays)
        along = Change(_own(change), _only(moves))
        return tuple(self.slopes.motions(_own(numbers), _only(points), [along]))

    @override
    def plain(self, *arrays: Array) -> tuple[Array, ...]:
        return _called(self, self.slopes.rest.points.shape, arrays)

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        given, (_, *moves) = _halves(arrays)
        if any(move is None for move in moves):
            raise ParameterError(
                f"{self.slopes.runs.told} is known by directions only, and the points of "
                "its file in have too many: take `Pipeline.pullback`, which asks for those of the "
                "variables, or jax.jvp"
            )
        return (*(None for _ in given), *self.gradient(*given, *cotangents), *(None for _ in moves))


class Gradient(AbstractKernel):
    """The same and a cotangent of the points, to that of the parameters."""

    def __init__(self, slopes: Slopes):
        self.slopes = slopes

    @override
    def run(self, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        numbers, *points, cotangent = arrays
        return (self.slopes.gradient(_own(numbers), _only(points), np.asarray(cotangent)),)

    @override
    def plain(self, *arrays: Array) -> tuple[Array, ...]:
        return _called(self, arrays[0].shape, arrays)


def _halves(arrays: Arrays) -> tuple[list[Any], list[Any]]:
    middle = len(arrays) // 2
    return list(arrays[:middle]), list(arrays[middle:])


def _own(numbers: Array) -> np.ndarray:
    return np.array(numbers, float)


def _only(points: Arrays) -> np.ndarray | None:
    return np.array(points[0], float) if points else None


def _called(kernel: AbstractKernel, shape: tuple[int, ...], arrays: Arrays) -> tuple[Array, ...]:
    out = jax.ShapeDtypeStruct(shape, np.dtype(float))
    return (jax.pure_callback(lambda *given: kernel.run(*map(np.asarray, given))[0], out, *arrays),)
