"""Twist, incidence, and the angle at an edge."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry
from .base import AbstractMeasure
from .directions import Along, Way, direction
from .needs import up as upwards
from .picks import Place, chord_ends, spot
from .spot import Spot, gathered
from .stations import station


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

    def __init__(self, leading: Spot, trailing: Spot, ahead: Along = "x", up: Along = "z"):
        self.reads, matrix = gathered([leading, trailing])
        self.matrix = matrix[1] - matrix[0]
        self.ahead, self.up = direction(ahead), direction(up)

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        leading: Place | None = None,
        trailing: Place | None = None,
        at: float | None = None,
        component: str | None = None,
        ahead: Way = "x",
        up: Way | None = None,
    ) -> "Incidence":
        """Of two spots, or of the chord of a wing at the station y = `at`, or of a section."""
        if (leading is None) != (trailing is None):
            raise ParameterError("an angle between spots needs leading and trailing")
        if leading is None or trailing is None:
            ends = chord_ends(geometry, at, component, "an incidence")
        else:
            ends = spot(geometry, leading), spot(geometry, trailing)
        return cls(*ends, ahead, upwards(geometry) if up is None else up)

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        chord = self.matrix @ places
        return jnp.arctan2(-(self.up @ chord), self.ahead @ chord)[None]


class Opening(AbstractMeasure):
    """Angle between the lines from one spot to two others [rad]: a trailing edge's.

    Of a blunt edge the lines begin at its two corners; the apex is then the pair of them. It has no
    derivative where the angle is zero.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "2 r"]

    def __init__(self, apex: Spot | tuple[Spot, Spot], one: Spot, other: Spot):
        first, second = (apex, apex) if isinstance(apex, Spot) else apex
        self.reads, matrix = gathered([first, second, one, other])
        self.matrix = matrix[2:] - matrix[:2]

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        apex: Place | None = None,
        one: Place | None = None,
        other: Place | None = None,
        at: float | None = None,
        component: str | None = None,
        length: float = 0.02,
    ) -> "Opening":
        """Of three spots, or of the trailing edge of a wing at the station y = `at`, or a section.

        `length` says how far before the trailing edge its sides are read, in chords.
        """
        if apex is not None and one is not None and other is not None:
            return cls(*(spot(geometry, place) for place in (apex, one, other)))
        if not apex is one is other is None:
            raise ParameterError("an angle at a spot needs apex, one and other")
        if not 0 < length < 1:
            raise ParameterError(f"length is a part of the chord between 0 and 1, got {length}")
        cut = station(geometry, at, component, "an opening")
        corners, sides = (
            tuple(Spot(*cut.foot(fraction, side)) for side in ("upper", "lower"))
            for fraction in (1.0, 1.0 - length)
        )
        return cls((corners[0], corners[1]), *sides)

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        one, other = self.matrix @ places
        return jnp.arctan2(jnp.linalg.norm(jnp.cross(one, other)), one @ other)[None]
