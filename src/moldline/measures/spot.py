"""A place on a shape: a vertex, or a point within a face or an edge, that moves with it."""

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, SupportsIndex

import numpy as np
from jaxtyping import Float, Int

from ..errors import ParameterError
from ..mesh import Geometry, Grid, Section, Surface
from .needs import faces_of
from .stations import Side, foot, station


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
    def vertex(cls, number: SupportsIndex) -> "Spot":
        """A point of the shape itself."""
        if operator.index(number) < 0:
            raise ParameterError(f"vertices are counted from 0, got {number}")
        return cls((operator.index(number),), (1.0,))

    @classmethod
    def within(
        cls,
        face: Sequence[int] | Int[np.ndarray, "c"],
        weights: Sequence[float] | Float[np.ndarray, "c"],
    ) -> "Spot":
        """A point within a face or an edge, by its barycentric weights."""
        if len(face) != len(weights) or abs(sum(weights) - 1) > 1e-12:
            raise ParameterError(f"weights of {len(face)} corners must sum to one, got {weights}")
        return cls(tuple(map(int, face)), tuple(map(float, weights)))

    @classmethod
    def middle(cls, spots: Sequence["Spot"]) -> "Spot":
        """The mean of some spots."""
        if not spots:
            raise ParameterError("a middle needs one spot or more")
        rows, matrix = gathered(spots)
        return cls(tuple(rows.tolist()), tuple(matrix.mean(axis=0).tolist()))

    @classmethod
    def nearest(
        cls,
        geometry: Geometry,
        place: Sequence[float] | Float[np.ndarray, "3"],
        component: str | None = None,
    ) -> "Spot":
        """The point of a geometry nearest to a place [m]: on a face, a segment, or a vertex."""
        points, near = np.asarray(geometry.points, float), np.asarray(place, float)
        if near.shape != (3,) or not np.all(np.isfinite(near)):
            raise ParameterError(f"a place is three coordinates, got {place}")
        if component is not None or isinstance(geometry, Surface | Grid):
            found = foot(points, np.asarray(faces_of(geometry, component, "a component")), near)
        elif isinstance(geometry, Section):
            found = foot(points, geometry.segments, near)
        else:
            found = (int(np.linalg.norm(points - near, axis=1).argmin()),), (1.0,)
        return cls(*found)

    @classmethod
    def at_chord(
        cls,
        geometry: Geometry,
        fraction: float,
        side: Side,
        at: float | None = None,
        component: str | None = None,
    ) -> "Spot":
        """A point on a side of a wing's section at the station y = `at`, or of an airfoil.

        The fraction is measured along the chord line, from 0 at the leading edge to 1 at the
        trailing edge, of a blunt one the upper or lower corner.
        """
        return cls(*station(geometry, at, component).foot(fraction, side))

    def of(self, points: Any) -> np.ndarray:
        """Where it is on a shape of these points, shape (3,)."""
        return np.asarray(self.weights) @ np.asarray(points)[list(self.rows)]


def gathered(
    spots: Sequence[Spot],
) -> tuple[Int[np.ndarray, "r"], Float[np.ndarray, "s r"]]:
    """Numbers of the points that spots read, and what of each a spot is."""
    reads = np.unique([row for spot in spots for row in spot.rows])
    matrix = np.zeros((len(spots), len(reads)))
    for number, spot in enumerate(spots):
        np.add.at(matrix[number], np.searchsorted(reads, spot.rows), spot.weights)
    return reads, matrix


def padded(
    spots: Sequence[Spot],
) -> tuple[Int[np.ndarray, "s w"], Float[np.ndarray, "s w"]]:
    """The same as short rows of point numbers and weights, for measures that read many points."""
    width = max((len(spot.rows) for spot in spots), default=1)
    rows, weights = np.zeros((len(spots), width), int), np.zeros((len(spots), width))
    for number, spot in enumerate(spots):
        rows[number] = spot.rows[0]
        rows[number, : len(spot.rows)] = spot.rows
        weights[number, : len(spot.rows)] = spot.weights
    return rows, weights
