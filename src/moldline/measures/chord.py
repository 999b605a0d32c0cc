"""The length of a section's chord."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from ..mesh import Geometry
from .base import AbstractMeasure
from .picks import chord_ends
from .spot import Spot, gathered


class Chord(AbstractMeasure):
    """Distance of the trailing from the leading edge [m], both places that move with the shape."""

    reads: np.ndarray
    matrix: Float[np.ndarray, "r"]

    def __init__(self, leading: Spot, trailing: Spot):
        self.reads, matrix = gathered([leading, trailing])
        self.matrix = matrix[1] - matrix[0]

    @classmethod
    @override
    def build(
        cls, geometry: Geometry, *, at: float | None = None, component: str | None = None
    ) -> "Chord":
        """Of a wing at the station y = `at`, or of a section."""
        return cls(*chord_ends(geometry, at, component, "a chord"))

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        return jnp.linalg.norm(self.matrix @ places)[None]
