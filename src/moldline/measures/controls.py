"""The deformer's own controls, read as a measure."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry
from .base import AbstractMeasure


class Controls(AbstractMeasure):
    """Some controls of the deformer, each in its own unit; it reads no points.

    Only whoever knows the controls can ask for it, by `under`.

    Attributes
    ----------
    numbers
        Which controls, counted from 0.
    """

    reads: np.ndarray
    numbers: Int[np.ndarray, "k"]

    def __init__(self, numbers: Sequence[int] | Int[np.ndarray, "k"]):
        self.reads, self.numbers = np.zeros(0, int), np.array(numbers, int)
        if not len(self.numbers) or self.numbers.min() < 0:
            raise ParameterError(f"controls are said by numbers from 0, got {list(numbers)}")

    @classmethod
    @override
    def build(cls, geometry: Geometry, *, numbers: list[int]) -> "Controls":
        """Of whatever deformer moves the geometry."""
        return cls(numbers)

    @property
    @override
    def size(self) -> int:
        return len(self.numbers)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        raise ParameterError("controls are not read from points; this measure is for a deformer")

    @override
    def under(self, places: Points, controls: Float[Array, "c"]) -> Vector:
        if self.numbers.max() >= len(controls):
            raise ParameterError(
                f"control {self.numbers.max()} is not there; the deformer has {len(controls)}, "
                "counted from 0"
            )
        return controls[self.numbers]
