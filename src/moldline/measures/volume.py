"""The volume that a closed surface encloses."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int
from typing_extensions import override

from .._types import Faces, Points, Vector
from ..mesh import Geometry
from .base import AbstractMeasure, as_rows
from .needs import faces_of


class Volume(AbstractMeasure):
    """Volume within closed faces [m3], by the divergence theorem.

    Of an open surface it is what the faces close with the origin, which is of use where the
    opening lies in a plane through it, as a half model's does.
    """

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]

    def __init__(self, faces: Faces):
        self.reads, self.corners = as_rows(np.asarray(faces))

    @classmethod
    @override
    def build(cls, geometry: Geometry, *, component: str | None = None) -> "Volume":
        """Of a surface, or of one component."""
        return cls(faces_of(geometry, component, "a volume"))

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        a, b, c = (places[self.corners[:, i]] for i in range(3))
        return jnp.sum(a * jnp.cross(b, c))[None] / 6
