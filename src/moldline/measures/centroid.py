"""The middle of the volume that a closed surface encloses."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Faces, Points, Vector
from .base import AbstractMeasure, as_rows
from .directions import directions


class Centroid(AbstractMeasure):
    """Centre of the volume within closed faces [m], whole or along some directions."""

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]
    along: Float[np.ndarray, "k 3"]

    def __init__(self, faces: Faces, along: str | Sequence[float] | None = None):
        self.reads, self.corners = as_rows(np.asarray(faces))
        self.along = directions(along)

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
