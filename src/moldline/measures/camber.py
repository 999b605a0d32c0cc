"""Camber: how far the middle of a section is above its chord."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from ..mesh import Geometry
from .base import AbstractMeasure
from .directions import Along, direction
from .needs import span
from .picks import ends_of
from .spot import Spot, gathered
from .stations import station


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
        normal: Along = "y",
    ):
        self.reads, matrix = gathered([lower, upper, *chord])
        self.matrix = np.stack([(matrix[0] + matrix[1]) / 2 - matrix[2], matrix[3] - matrix[2]])
        self.normal = direction(normal)

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        chord: float = 0.5,
        at: float | None = None,
        component: str | None = None,
    ) -> "Camber":
        """At a fraction of the chord of a wing at the station y = `at`, or of a section."""
        cut = station(geometry, at, component, "a camber")
        lower, upper = (Spot(*cut.foot(chord, side)) for side in ("lower", "upper"))
        return cls(lower, upper, ends_of(cut), span(geometry))

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        middle, chord = self.matrix @ places
        up = jnp.cross(chord, self.normal)
        return (up @ middle / (jnp.linalg.norm(up) * jnp.linalg.norm(chord)))[None]
