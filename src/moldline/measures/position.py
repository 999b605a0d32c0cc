"""Where a place on the shape is."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from .base import AbstractMeasure
from .directions import directions
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

    def __init__(self, spot: Spot, along: str | Sequence[float] | None = None):
        self.reads, self.matrix = gathered([spot])
        self.along = directions(along)

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
        return self.along @ (self.matrix @ places)[0]
