"""Where one place on the shape is, seen from another: thickness as a vector."""

import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from ..mesh import Geometry
from .base import AbstractMeasure
from .directions import Along, Way, directions
from .needs import room
from .picks import Place, spot
from .spot import Spot, gathered


class Separation(AbstractMeasure):
    """The vector from one spot to another [m], whole or along some directions.

    Source: AIAA 2012-0965, equation 6.

    Attributes
    ----------
    matrix
        What of the points read the second spot less the first is.
    along
        Directions, one row for each number.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "r"]
    along: Float[np.ndarray, "k 3"]

    def __init__(self, start: Spot, end: Spot, along: Along | None = None):
        self.reads, matrix = gathered([start, end])
        self.matrix = matrix[1] - matrix[0]
        self.along = directions(along)

    @classmethod
    @override
    def build(
        cls, geometry: Geometry, *, start: Place, end: Place, along: Way | None = None
    ) -> "Separation":
        """Of two spots; along x and y of a section."""
        return cls(
            spot(geometry, start), spot(geometry, end), room(geometry) if along is None else along
        )

    @property
    @override
    def size(self) -> int:
        return len(self.along)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        return self.along @ (self.matrix @ places)
