"""Deformers whose controls are displacements of control points."""

import abc
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Float, Int

from .._types import Array, Points, Vector
from .base import AbstractDeformer

AXES = {"x": 0, "y": 1, "z": 2}


class AbstractControlNet(AbstractDeformer):
    """A deformer moved by control points; controls are their displacements in space [m].

    Control points may lie in an array of any shape; their numbers run through it in C order, and
    the controls are the displacement of each, (dx, dy, dz), one after the other.
    """

    frozen: eqx.AbstractVar[np.ndarray]
    """Which control points never move, whatever the controls say."""

    @property
    @abc.abstractmethod
    def rest(self) -> Float[np.ndarray, "*counts 3"]:
        """Control points at rest [m]."""

    @abc.abstractmethod
    def moves(self, controls: Vector) -> Float[Array, "*counts 3"]:
        """Displacements of the control points [m], zero for the frozen ones."""

    @abc.abstractmethod
    def numbers(self, index: Any) -> Int[np.ndarray, "c"]:
        """Numbers of control points from their indices, one row for each."""

    @abc.abstractmethod
    def direction(self, axis: str) -> Float[np.ndarray, "3"]:
        """Unit vector of one of the net's own axes."""

    @property
    @abc.abstractmethod
    def lines(self) -> Int[np.ndarray, "l 2"]:
        """Pairs of control points, by number, that pictures join."""

    @abc.abstractmethod
    def samples(self, most: int) -> Points:
        """Places spread over where the net acts, about `most` at most [m]."""

    @abc.abstractmethod
    def tears(self, points: Points, edges: Array, controls: Vector) -> tuple[Array, Array]:
        """Where a mesh is torn at the border of what moves: places (t, 3) and gaps (t,) [m]."""

    def moved(self, controls: Vector) -> Float[Array, "*counts 3"]:
        """Control points where the controls put them [m]."""
        return self.rest + self.moves(controls)


def grid_lines(numbers: Int[np.ndarray, "nu nv nw"]) -> Int[np.ndarray, "l 2"]:
    """Pairs of neighbours in a grid of control points, given their numbers."""
    pairs = [
        np.stack([np.delete(numbers, -1, axis), np.delete(numbers, 0, axis)], axis=-1)
        for axis in range(3)
    ]
    return np.concatenate([pair.reshape(-1, 2) for pair in pairs])
