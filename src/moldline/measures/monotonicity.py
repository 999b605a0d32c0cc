"""Rows of places that only ever rise."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from ..errors import ParameterError
from .base import AbstractMeasure
from .directions import direction
from .spot import Spot, gathered


class Monotonicity(AbstractMeasure):
    """Rise from each spot to the next along a direction [m]; none negative is monotone."""

    reads: np.ndarray
    matrix: Float[np.ndarray, "s r"]
    along: Float[np.ndarray, "3"]

    def __init__(self, spots: Sequence[Spot], along: str | Sequence[float]):
        if len(spots) < 2:
            raise ParameterError(f"a row needs two spots or more, got {len(spots)}")
        self.reads, matrix = gathered(spots)
        self.matrix = np.diff(matrix, axis=0)
        self.along = direction(along)

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
