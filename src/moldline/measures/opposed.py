"""Edges that move oppositely."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry
from .base import AbstractMeasure
from .directions import Along, Way, direction
from .needs import up
from .picks import Place, chord_ends, spot
from .spot import Spot, gathered


class Opposed(AbstractMeasure):
    """Sum of the motions of two spots along a direction [m]; zero where they move oppositely.

    One number for each pair: a leading and a trailing edge that turn about the middle of the chord.

    Attributes
    ----------
    matrix
        What of the points read the sum of each pair is.
    rest
        The sums at rest.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "p r"]
    along: Float[np.ndarray, "3"]
    rest: Float[np.ndarray, "p"]

    def __init__(self, points: Array, pairs: Sequence[tuple[Spot, Spot]], along: Along = "z"):
        if not pairs:
            raise ParameterError("opposed motion needs one pair of spots or more")
        self.reads, matrix = gathered([one for pair in pairs for one in pair])
        self.matrix = matrix[::2] + matrix[1::2]
        self.along = direction(along)
        self.rest = self.matrix @ np.asarray(points)[self.reads] @ self.along

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        start: Place | None = None,
        end: Place | None = None,
        at: float | list[float] | None = None,
        component: str | None = None,
        along: Way | None = None,
    ) -> "Opposed":
        """Of two spots, or of the edges of a wing at stations `at`, or of a section; upwards."""
        if start is not None and end is not None and at is None:
            pairs = [(spot(geometry, start), spot(geometry, end))]
        elif start is not None or end is not None:
            raise ParameterError("opposed motion is that of start and end, or of edges")
        else:
            stations = at if isinstance(at, list) else [at]
            pairs = [chord_ends(geometry, y, component, "opposed motion") for y in stations]
        return cls(geometry.points, pairs, up(geometry) if along is None else along)

    @property
    @override
    def size(self) -> int:
        return len(self.rest)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        return self.matrix @ places @ self.along - self.rest
