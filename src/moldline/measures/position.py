"""Where a place on the shape is."""

import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector
from ..mesh import Geometry
from .base import AbstractMeasure
from .directions import Along, Way, directions
from .needs import room
from .picks import Place
from .picks import spot as picked
from .spot import Spot, gathered


class Position(AbstractMeasure):
    """Place of a spot [m], whole or along some directions.

    Attributes
    ----------
    matrix
        What of the points read the spot is.
    along
        Directions, one row for each number.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "1 r"]
    along: Float[np.ndarray, "k 3"]

    def __init__(self, spot: Spot, along: Along | None = None):
        self.reads, self.matrix = gathered([spot])
        self.along = directions(along)

    @classmethod
    @override
    def build(cls, geometry: Geometry, *, spot: Place, along: Way | None = None) -> "Position":
        """Of one spot; along x and y of a section."""
        return cls(picked(geometry, spot), room(geometry) if along is None else along)

    @property
    @override
    def size(self) -> int:
        return len(self.along)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def marks(self, places: Points) -> Array:
        return self.matrix @ places

    @override
    def of(self, places: Points) -> Vector:
        return self.along @ (self.matrix @ places)[0]
