"""The area of the section that a plane cuts from a closed surface."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from typing_extensions import override

from .._types import Array, Faces, Points, Scalar, Vector
from ..mesh import Geometry
from .base import AbstractMeasure, as_rows
from .directions import Along, Way, direction
from .needs import faces_of


class CrossSection(AbstractMeasure):
    """Area of sections at places along a direction [m2], the places fixed in space.

    Attributes
    ----------
    at
        Places along the direction [m], one for each number.

    Notes
    -----
    Each face that the plane crosses adds the triangle of its cut and a point of the plane. It has
    no derivative by points in the plane; choose places between them.
    """

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]
    along: Float[np.ndarray, "3"]
    at: Float[np.ndarray, "k"]

    def __init__(
        self, faces: Faces, along: Along, at: float | Sequence[float] | Float[np.ndarray, "k"]
    ):
        self.reads, self.corners = as_rows(np.asarray(faces))
        self.along = direction(along)
        self.at = np.atleast_1d(np.asarray(at, float))

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        at: float | list[float],
        along: Way = "y",
        component: str | None = None,
    ) -> "CrossSection":
        """Of a surface, or of one component, at places along the span by default."""
        return cls(faces_of(geometry, component, "a cross-section"), along, at)

    @property
    @override
    def size(self) -> int:
        return len(self.at)

    @override
    def of(self, places: Points) -> Vector:
        return jnp.stack([self._area(places, at) for at in self.at])

    def _area(self, places: Points, at: Scalar) -> Float[Array, ""]:
        height = places @ self.along - at
        corners = [self.corners[:, i] for i in range(3)]
        total = jnp.zeros(())
        for i in range(3):  # the corner that is alone on its side
            p, q, r = (corners[(i + k) % 3] for k in range(3))
            above, b, c = height[p] > 0, height[q] > 0, height[r] > 0
            alone = (above != b) & (above != c)
            one = _crossing(places, height, p, q, alone)
            other = _crossing(places, height, p, r, alone)
            side = jnp.where(above, 1.0, -1.0)
            cut = 0.5 * jnp.cross(one, other) @ self.along * side
            total = total + jnp.sum(jnp.where(alone, cut, 0.0))
        return total


def _crossing(
    places: Points,
    height: Float[Array, "r"],
    start: Int[np.ndarray, "m"],
    end: Int[np.ndarray, "m"],
    crosses: Bool[Array, "m"],
) -> Float[Array, "m 3"]:
    rise = jnp.where(crosses, height[start] - height[end], 1.0)
    share = (height[start] / rise)[:, None]
    return places[start] + share * (places[end] - places[start])
