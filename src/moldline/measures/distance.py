"""How far two places on the shape are apart."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from ..mesh import Geometry
from .base import AbstractMeasure
from .picks import Place, spot
from .spot import Spot, gathered


class Distance(AbstractMeasure):
    """Distance of two spots [m]: a chord from its ends, a thickness by toothpick.

    It has no derivative where they are in one place.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "r"]

    def __init__(self, start: Spot, end: Spot):
        self.reads, matrix = gathered([start, end])
        self.matrix = matrix[1] - matrix[0]

    @classmethod
    @override
    def build(cls, geometry: Geometry, *, start: Place, end: Place) -> "Distance":
        """Of two spots."""
        return cls(spot(geometry, start), spot(geometry, end))

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        return jnp.linalg.norm(self.matrix @ places)[None]
