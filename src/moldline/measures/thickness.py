"""Thickness: between fixed places of a shape, or along rays through it."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from .base import AbstractMeasure, as_rows
from .directions import direction
from .spot import Spot, gathered


class Thickness(AbstractMeasure):
    """Distance of upper from lower spots along a direction [m], or per length of the chord.

    These are toothpicks: their ends stay in the surface where they were put.

    Attributes
    ----------
    matrix
        What of the points read each upper spot less its lower one is; the last row, where there is
        a chord, is its trailing less its leading edge.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "s r"]
    along: Float[np.ndarray, "3"]
    is_relative: bool

    def __init__(
        self,
        lower: Sequence[Spot],
        upper: Sequence[Spot],
        along: str | Sequence[float] = "z",
        chord: tuple[Spot, Spot] | None = None,
    ):
        if len(lower) != len(upper) or not lower:
            raise ParameterError(f"as many upper as lower spots, got {len(upper)}, {len(lower)}")
        pairs = [*zip(lower, upper, strict=True), *([chord] if chord else [])]
        self.reads, matrix = gathered([spot for pair in pairs for spot in pair])
        self.matrix = matrix[1::2] - matrix[::2]
        self.along = direction(along)
        self.is_relative = chord is not None

    @property
    @override
    def size(self) -> int:
        return len(self.matrix) - self.is_relative

    @property
    @override
    def is_affine(self) -> bool:
        return not self.is_relative

    @override
    def of(self, places: Points) -> Vector:
        separations = self.matrix @ places
        heights = separations @ self.along
        if not self.is_relative:
            return heights
        return heights[:-1] / jnp.linalg.norm(separations[-1])


class RayThickness(AbstractMeasure):
    """What of each ray lies within closed faces [m], however the shape moves along it.

    Attributes
    ----------
    origins
        A point of each ray; it runs both ways.
    along
        Direction of all rays.

    Notes
    -----
    It has no derivative where a ray meets an edge of the mesh, and counts one where it does. A ray
    that misses the shape has thickness zero.
    """

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]
    origins: Float[np.ndarray, "k 3"]
    along: Float[np.ndarray, "3"]

    def __init__(
        self, faces: Array, origins: Sequence[Sequence[float]], along: str | Sequence[float] = "z"
    ):
        self.reads, self.corners = as_rows(np.asarray(faces))
        self.origins = np.atleast_2d(np.asarray(origins, float))
        self.along = direction(along)

    @property
    @override
    def size(self) -> int:
        return len(self.origins)

    @override
    def of(self, places: Points) -> Vector:
        return jnp.stack([self._within(places - origin) for origin in self.origins])

    def _within(self, places: Points) -> Float[jnp.ndarray, ""]:
        """Heights where the ray leaves less those where it enters."""
        a, b, c = (places[self.corners[:, i]] for i in range(3))
        sides = [jnp.cross(p, q) @ self.along for p, q in ((b, c), (c, a), (a, b))]
        total = sides[0] + sides[1] + sides[2]
        leaves = (sides[0] > 0) & (sides[1] > 0) & (sides[2] > 0)
        enters = (sides[0] < 0) & (sides[1] < 0) & (sides[2] < 0)
        met = leaves | enters
        safe = jnp.where(met, total, 1.0)
        weights = [side / safe for side in sides]
        height = (weights[0][:, None] * a + weights[1][:, None] * b + weights[2][:, None] * c) @ (
            self.along
        )
        return jnp.sum(jnp.where(met, jnp.where(leaves, height, -height), 0.0))
