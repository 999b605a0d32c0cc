"""Surface area, and the area of its shadow."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Array, Faces, Points, Vector
from ..mesh import Geometry
from .base import AbstractMeasure, as_rows
from .directions import Along, Way, direction
from .needs import faces_of


class Area(AbstractMeasure):
    """Area of faces [m2]; it has no derivative where a face has none."""

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]

    def __init__(self, faces: Faces):
        self.reads, self.corners = as_rows(np.asarray(faces))

    @classmethod
    @override
    def build(cls, geometry: Geometry, *, component: str | None = None) -> "Area":
        """Of a surface, or of one component."""
        return cls(faces_of(geometry, component, "an area"))

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        return 0.5 * jnp.sum(jnp.linalg.norm(area_vectors(places, self.corners), axis=1))[None]


class ProjectedArea(AbstractMeasure):
    """Area of the faces that look along a direction, as seen from there [m2].

    "z" gives the planform of a closed wing, "x" its frontal area. Where faces hide each other each
    counts.
    """

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]
    along: Float[np.ndarray, "3"]

    def __init__(self, faces: Faces, along: Along = "z"):
        self.reads, self.corners = as_rows(np.asarray(faces))
        self.along = direction(along)

    @classmethod
    @override
    def build(
        cls, geometry: Geometry, *, along: Way = "z", component: str | None = None
    ) -> "ProjectedArea":
        """Of a surface, or of one component; seen from above by default."""
        return cls(faces_of(geometry, component, "a projected area"), along)

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        shadows = area_vectors(places, self.corners) @ self.along
        return 0.5 * jnp.sum(jnp.maximum(shadows, 0.0))[None]


def area_vectors(places: Points, corners: Int[np.ndarray, "m 3"]) -> Float[Array, "m 3"]:
    """Normals of faces, each as long as twice its area."""
    a, b, c = (places[corners[:, i]] for i in range(3))
    return jnp.cross(b - a, c - a)
