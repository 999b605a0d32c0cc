"""Deformers written in plain NumPy, with derivatives by complex step or central differences."""

import abc
import warnings
from collections.abc import Callable
from typing import Literal

import jax
import numpy as np
from typing_extensions import override

from .._types import Array, Points, Vector
from ..numerics.kernel import AbstractKernel, Arrays
from .base import AbstractDeformer

Method = Literal["complex step", "central differences"]

COMPLEX_STEP = 1e-30
CENTRAL_STEP = 6e-6  # cube root of the rounding unit balances truncation against rounding
AGREEMENT = 1e-5  # what central differences can confirm of a complex step


class AbstractNumpyDeformer(AbstractDeformer):
    """A deformer whose map is NumPy: write `size` and `move`, all else is made from it.

    Derivatives are first order only. They come by complex step, to rounding, where `move` lets
    complex numbers through and agrees with differences; else by central differences, to about
    1e-9 of the values. `method` says which.
    """

    @abc.abstractmethod
    def move(self, points: np.ndarray, controls: np.ndarray) -> np.ndarray:
        """The points, shape (n, 3), moved by the controls, shape (k,); each point by itself."""

    @override
    def __call__(self, points: Points, controls: Vector) -> Points:
        return Motion(self)(points, controls)[0]

    @override
    def follow(self, points: Points, controls: Vector) -> Points:
        return self(points, controls)

    def method(self, points: Points, controls: Vector) -> Method:
        """How derivatives are taken here."""
        points, controls = np.asarray(points)[:64], np.asarray(controls)
        directions = np.ones_like(points), np.ones_like(controls)
        by_difference = _central(self.move, points, controls, *directions)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", np.exceptions.ComplexWarning)
                by_complex = _complex(self.move, points, controls, *directions)
        except (TypeError, ValueError, np.exceptions.ComplexWarning):
            return "central differences"
        scale = np.abs(by_difference).max(initial=1.0)
        agrees = np.abs(by_complex - by_difference).max(initial=0.0) <= AGREEMENT * scale
        return "complex step" if agrees else "central differences"

    def slope(self, points: Points, controls: Vector) -> Callable[..., np.ndarray]:
        """The directional derivative to use here, as a function of two directions."""
        rule = _complex if self.method(points, controls) == "complex step" else _central
        return lambda motion, change: rule(self.move, points, controls, motion, change)


def _complex(move, points, controls, motion, change) -> np.ndarray:  # type: ignore[no-untyped-def]
    moved = move(points + 1j * COMPLEX_STEP * motion, controls + 1j * COMPLEX_STEP * change)
    if not np.iscomplexobj(moved):
        raise TypeError("the deformer drops the imaginary part")
    return moved.imag / COMPLEX_STEP


def _central(move, points, controls, motion, change) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Points and controls one after the other, since millimetres and radians differ in size."""
    by_points = _difference(lambda x: move(x, controls), points, motion)
    by_controls = _difference(lambda c: move(points, c), controls, change)
    return np.zeros_like(points) + by_points + by_controls


def _difference(form: Callable, at: np.ndarray, along: np.ndarray) -> np.ndarray | float:
    size = np.abs(along).max(initial=0.0)
    if size == 0.0:
        return 0.0
    h = CENTRAL_STEP * max(np.abs(at).max(initial=0.0), 1.0) / size
    return (form(at + h * along) - form(at - h * along)) / (2 * h)


class Motion(AbstractKernel):
    """Points and controls to moved points."""

    def __init__(self, deformer: AbstractNumpyDeformer):
        self.deformer = deformer

    @override
    def run(self, points: np.ndarray, controls: np.ndarray) -> tuple[np.ndarray, ...]:
        return (np.array(self.deformer.move(points, controls), dtype=float),)

    @override
    def plain(self, points: Array, controls: Array) -> tuple[Array, ...]:
        return (
            jax.pure_callback(
                lambda *a: self.run(*map(np.asarray, a))[0], points, points, controls
            ),
        )

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return Push(self.deformer)(*arrays, *tangents)


class Push(AbstractKernel):
    """Points, controls and a direction of each to the motion of the moved points."""

    def __init__(self, deformer: AbstractNumpyDeformer):
        self.deformer = deformer

    @override
    def run(self, points, controls, motion, change) -> tuple[np.ndarray, ...]:  # type: ignore
        return (np.array(self.deformer.slope(points, controls)(motion, change)),)

    @override
    def plain(self, points, controls, motion, change) -> tuple[Array, ...]:  # type: ignore
        given = points, controls, motion, change
        return (jax.pure_callback(lambda *a: self.run(*map(np.asarray, a))[0], points, *given),)

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        return (None, None, *Pull(self.deformer)(*arrays[:2], *cotangents))


class Pull(AbstractKernel):
    """Points, controls and a cotangent to the cotangents of both, one direction after the other."""

    def __init__(self, deformer: AbstractNumpyDeformer):
        self.deformer = deformer

    @override
    def run(self, points, controls, vectors) -> tuple[np.ndarray, ...]:  # type: ignore
        slope = self.deformer.slope(points, controls)
        still, quiet = np.zeros_like(points), np.zeros_like(controls)
        at_points = np.empty_like(points)
        for i in range(3):  # one direction serves all points, since each moves by itself
            motion = still.copy()
            motion[:, i] = 1.0
            at_points[:, i] = np.sum(slope(motion, quiet) * vectors, axis=1)
        at_controls = [np.sum(slope(still, row) * vectors) for row in np.eye(len(controls))]
        return at_points, np.array(at_controls)

    @override
    def plain(self, points, controls, vectors) -> tuple[Array, ...]:  # type: ignore
        given = points, controls, vectors
        return jax.pure_callback(
            lambda *a: self.run(*map(np.asarray, a)), (points, controls), *given
        )

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        return (None, None, *Push(self.deformer)(*arrays[:2], *cotangents))
