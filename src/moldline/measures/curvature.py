"""How curved a shape is."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Faces, Points, Vector
from ..mesh import Geometry, topology
from .base import AbstractMeasure, as_rows
from .needs import faces_of


class Curvature(AbstractMeasure):
    """Square of the mean curvature, integrated over the surface but for its border [-].

    4 pi for a sphere of any size, the least there is for a closed surface; creases and waves
    raise it. It has no derivative where a face has no area.

    Attributes
    ----------
    is_inner
        One for points read that are not on a border, zero for those that are.

    Notes
    -----
    The normal of a point, twice its mean curvature long, is the cotangent formula's over a third of
    its faces' area: Meyer, Desbrun, Schroeder and Barr, Discrete differential-geometry operators
    for triangulated 2-manifolds, 2003.
    """

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]
    is_inner: Float[np.ndarray, "r"]

    def __init__(self, faces: Faces):
        self.reads, self.corners = as_rows(np.asarray(faces))
        self.is_inner = np.ones(len(self.reads))
        self.is_inner[topology.edges(self.corners).open] = 0.0

    @classmethod
    @override
    def build(cls, geometry: Geometry, *, component: str | None = None) -> "Curvature":
        """Of a surface, or of one component."""
        return cls(faces_of(geometry, component, "a curvature"))

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        areas = jnp.zeros(len(places))
        normals = jnp.zeros_like(places)
        for i in range(3):
            apex, start, end = (self.corners[:, (i + k) % 3] for k in range(3))
            one, other = places[start] - places[apex], places[end] - places[apex]
            square = jnp.sum(jnp.cross(one, other) ** 2, axis=1)
            is_flat = square == 0  # such a face counts for nothing
            twice = jnp.sqrt(jnp.where(is_flat, 1.0, square))
            weight = jnp.where(is_flat, 0.0, 0.5 * jnp.sum(one * other, axis=1) / twice)
            areas = areas.at[apex].add(jnp.where(is_flat, 0.0, twice / 6))
            flow = weight[:, None] * (places[end] - places[start])
            normals = normals.at[start].add(flow).at[end].add(-flow)
        counts = (self.is_inner > 0) & (areas > 0)
        squares = jnp.sum(normals**2, axis=1) / (4 * jnp.where(counts, areas, 1.0))
        return jnp.sum(jnp.where(counts, squares, 0.0))[None]
