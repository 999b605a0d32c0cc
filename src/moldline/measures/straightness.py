"""Straight lines and flat regions."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from .base import AbstractMeasure
from .circularity import spanned
from .spot import Spot, gathered


class Linearity(AbstractMeasure):
    """How far spots are beside the straight line from the first to the last [m].

    Two numbers for each spot between, across the line at rest; all zero keep a leading edge or a
    hinge straight. Spots keep their parts of the line, so the numbers are affine.

    Attributes
    ----------
    matrix
        What of the points read each spot between, less its part of the line, is.
    plane
        Two directions across the line.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "s r"]
    plane: Float[np.ndarray, "2 3"]

    def __init__(self, points: Array, spots: Sequence[Spot]):
        if len(spots) < 3:
            raise ParameterError(f"a line needs three spots or more, got {len(spots)}")
        places = np.array([spot.of(points) for spot in spots])
        line = places[-1] - places[0]
        length = float(np.linalg.norm(line))
        if length == 0:
            raise ParameterError("the line's first and last spot are in one place")
        self.plane = spanned(line)
        share = (places[1:-1] - places[0]) @ line / length**2
        self.reads, matrix = gathered(spots)
        self.matrix = matrix[1:-1] - np.outer(1 - share, matrix[0]) - np.outer(share, matrix[-1])

    @property
    @override
    def size(self) -> int:
        return 2 * len(self.matrix)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        return (self.matrix @ places @ self.plane.T).reshape(-1)


class Planarity(AbstractMeasure):
    """How far spots are above the plane through the first three [m], one number for each other."""

    reads: np.ndarray
    matrix: Float[np.ndarray, "s r"]

    def __init__(self, spots: Sequence[Spot]):
        if len(spots) < 4:
            raise ParameterError(f"a plane needs four spots or more, got {len(spots)}")
        self.reads, matrix = gathered(spots)
        self.matrix = matrix[1:] - matrix[0]

    @property
    @override
    def size(self) -> int:
        return len(self.matrix) - 2

    @override
    def of(self, places: Points) -> Vector:
        one, other, *_ = sides = self.matrix @ places
        normal = jnp.cross(one, other)
        return sides[2:] @ (normal / jnp.linalg.norm(normal))
