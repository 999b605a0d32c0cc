"""How smoothly a shape was bent."""

import jax.numpy as jnp
import numpy as np
import scipy.sparse
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Faces, Points, Vector
from ..mesh import Geometry, topology
from .base import AbstractMeasure, as_rows
from .needs import faces_of


class BendingEnergy(AbstractMeasure):
    """What it takes to bend a thin plate from its rest as the shape is bent [m2].

    The square of the Laplacian of the displacement, integrated over the surface at rest but for
    its border: zero where flat parts stay flat.

    Notes
    -----
    Source: cotangent weights, Pinkall and Polthier, Experimental Mathematics 2, 1993; a third of
    the faces' areas for each point.
    """

    reads: np.ndarray
    rest: Float[np.ndarray, "r 3"]
    pairs: Int[np.ndarray, "e 2"]
    weights: Float[np.ndarray, "e"]
    areas: Float[np.ndarray, "r"]

    def __init__(self, points: Points, faces: Faces):
        self.reads, corners = as_rows(np.asarray(faces))
        self.rest = np.asarray(points)[self.reads]
        self.pairs, self.weights, self.areas = _laplacian(self.rest, corners)

    @classmethod
    @override
    def build(cls, geometry: Geometry, *, component: str | None = None) -> "BendingEnergy":
        """Of a surface, or of one component, from where it is now."""
        return cls(geometry.points, faces_of(geometry, component, "a bending energy"))

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        motion = places - self.rest
        start, end = self.pairs.T
        flow = self.weights[:, None] * (motion[end] - motion[start])
        total = jnp.zeros_like(motion).at[start].add(flow).at[end].add(-flow)
        return jnp.sum(total**2 / self.areas[:, None])[None]


def _laplacian(
    points: np.ndarray, corners: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges, their cotangent weights, and the area of each point."""
    count = len(points)
    areas = np.zeros(count)
    total = scipy.sparse.csr_array((count, count))
    for i in range(3):
        apex, start, end = (corners[:, (i + k) % 3] for k in range(3))
        one, other = points[start] - points[apex], points[end] - points[apex]
        twice = np.linalg.norm(np.cross(one, other), axis=1)
        flat = twice == 0
        cotangent = np.where(flat, 0.0, np.sum(one * other, axis=1) / np.where(flat, 1.0, twice))
        np.add.at(areas, apex, twice / 6)
        low, high = np.minimum(start, end), np.maximum(start, end)
        total = total + scipy.sparse.csr_array((cotangent / 2, (low, high)), shape=(count, count))
    found = topology.edges(corners)
    areas[found.ends[found.uses == 1]] = np.inf  # at a border a Laplacian is no bending
    edges = total.tocoo()
    pairs = np.stack([edges.row, edges.col], axis=1).astype(np.int64)
    return pairs, edges.data, np.where(areas > 0, areas, np.inf)
