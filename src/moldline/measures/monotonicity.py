"""Rows of places that only ever rise."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry
from .base import AbstractMeasure
from .directions import Along, Way, direction
from .needs import up
from .picks import Place
from .picks import spots as picked
from .spot import Spot, gathered


class Monotonicity(AbstractMeasure):
    """Rise from each spot to the next along a direction [m]; none negative is monotone."""

    reads: np.ndarray
    matrix: Float[np.ndarray, "s r"]
    along: Float[np.ndarray, "3"]

    def __init__(self, spots: Sequence[Spot], along: Along):
        if len(spots) < 2:
            raise ParameterError(f"a row needs two spots or more, got {len(spots)}")
        self.reads, matrix = gathered(spots)
        self.matrix = np.diff(matrix, axis=0)
        self.along = direction(along)

    @classmethod
    @override
    def build(
        cls, geometry: Geometry, *, spots: list[Place], along: Way | None = None
    ) -> "Monotonicity":
        """Of spots in a row; upwards by default."""
        row = picked(geometry, spots, None, "a row")
        return cls(row, up(geometry) if along is None else along)

    @property
    @override
    def size(self) -> int:
        return len(self.matrix)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        return self.matrix @ places @ self.along
