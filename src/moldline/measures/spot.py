"""A place on a shape: a vertex, or a point within a face or an edge, that moves with it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ParameterError


@dataclass(frozen=True)
class Spot:
    """A mean of points.

    Attributes
    ----------
    rows
        Numbers of the points.
    weights
        Their weights, which sum to one.
    """

    rows: tuple[int, ...]
    weights: tuple[float, ...]

    @classmethod
    def vertex(cls, number: int) -> "Spot":
        """A point of the shape itself."""
        return cls((int(number),), (1.0,))

    @classmethod
    def within(cls, face: Sequence[int], weights: Sequence[float]) -> "Spot":
        """A point within a face or an edge, by its barycentric weights."""
        if len(face) != len(weights) or abs(sum(weights) - 1) > 1e-12:
            raise ParameterError(f"weights of {len(face)} corners must sum to one, got {weights}")
        return cls(tuple(map(int, face)), tuple(map(float, weights)))

    def of(self, points: Any) -> np.ndarray:
        """Where it is on a shape of these points, shape (3,)."""
        return np.asarray(self.weights) @ np.asarray(points)[list(self.rows)]


def gathered(spots: Sequence[Spot]) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the points that spots read (r,), and what of each a spot is, shape (s, r)."""
    reads = np.unique([row for spot in spots for row in spot.rows])
    matrix = np.zeros((len(spots), len(reads)))
    for number, spot in enumerate(spots):
        np.add.at(matrix[number], np.searchsorted(reads, spot.rows), spot.weights)
    return reads, matrix
