"""Camber: how far the middle of a section is above its chord."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from .base import AbstractMeasure
from .directions import direction
from .spot import Spot, gathered


class Camber(AbstractMeasure):
    """Height of the middle between two spots above the chord, per length of the chord.

    Attributes
    ----------
    matrix
        What of the points read the middle less the leading edge is, and the chord.
    normal
        Direction along the span: the section's plane is across it.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "2 r"]
    normal: Float[np.ndarray, "3"]

    def __init__(
        self,
        lower: Spot,
        upper: Spot,
        chord: tuple[Spot, Spot],
        normal: str | Sequence[float] = "y",
    ):
        self.reads, matrix = gathered([lower, upper, *chord])
        self.matrix = np.stack([(matrix[0] + matrix[1]) / 2 - matrix[2], matrix[3] - matrix[2]])
        self.normal = direction(normal)

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        middle, chord = self.matrix @ places
        up = jnp.cross(chord, self.normal)
        return (up @ middle / (jnp.linalg.norm(up) * jnp.linalg.norm(chord)))[None]
