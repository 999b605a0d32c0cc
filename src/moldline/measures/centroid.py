"""The middle of the volume that a closed surface encloses."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Faces, Points, Vector
from ..mesh import Geometry
from .base import AbstractMeasure, as_rows
from .directions import Along, Way, directions
from .needs import faces_of


class Centroid(AbstractMeasure):
    """Centre of the volume within closed faces [m], whole or along some directions."""

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]
    along: Float[np.ndarray, "k 3"]

    def __init__(self, faces: Faces, along: Along | None = None):
        self.reads, self.corners = as_rows(np.asarray(faces))
        self.along = directions(along)

    @classmethod
    @override
    def build(
        cls, geometry: Geometry, *, along: Way | None = None, component: str | None = None
    ) -> "Centroid":
        """Of a surface, or of one component; all three coordinates by default."""
        return cls(faces_of(geometry, component, "a centroid"), along)

    @property
    @override
    def size(self) -> int:
        return len(self.along)

    @override
    def of(self, places: Points) -> Vector:
        a, b, c = (places[self.corners[:, i]] for i in range(3))
        volumes = jnp.sum(a * jnp.cross(b, c), axis=1)  # six times each tetrahedron's
        middle = volumes @ (a + b + c) / (4 * jnp.sum(volumes))
        return self.along @ middle
