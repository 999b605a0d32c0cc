"""Twist, incidence, and the angle at an edge."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from .base import AbstractMeasure
from .directions import direction
from .spot import Spot, gathered


class Incidence(AbstractMeasure):
    """Angle of the line between two spots to a direction, in a plane [rad].

    With the leading and the trailing edge of a section this is its twist, positive nose up.

    Attributes
    ----------
    ahead, up
        Rows of the plane: where the angle is zero, and where it is minus a right angle.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "r"]
    ahead: Float[np.ndarray, "3"]
    up: Float[np.ndarray, "3"]

    def __init__(
        self,
        leading: Spot,
        trailing: Spot,
        ahead: str | Sequence[float] = "x",
        up: str | Sequence[float] = "z",
    ):
        self.reads, matrix = gathered([leading, trailing])
        self.matrix = matrix[1] - matrix[0]
        self.ahead, self.up = direction(ahead), direction(up)

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        chord = self.matrix @ places
        return jnp.arctan2(-(self.up @ chord), self.ahead @ chord)[None]


class Opening(AbstractMeasure):
    """Angle between the lines from one spot to two others [rad]: a trailing edge's."""

    reads: np.ndarray
    matrix: Float[np.ndarray, "2 r"]

    def __init__(self, apex: Spot, one: Spot, other: Spot):
        self.reads, matrix = gathered([apex, one, other])
        self.matrix = matrix[1:] - matrix[0]

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        one, other = self.matrix @ places
        return jnp.arctan2(jnp.linalg.norm(jnp.cross(one, other)), one @ other)[None]
