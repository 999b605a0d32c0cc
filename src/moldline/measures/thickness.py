"""Thickness between fixed places of a shape: toothpicks."""

from collections.abc import Sequence
from typing import TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry
from .base import AbstractMeasure
from .directions import Along, Way, direction
from .needs import up
from .picks import Place, ends_of, spot
from .spot import Spot, gathered
from .stations import Station, station

Ends: TypeAlias = tuple[Spot, Spot]
Several: TypeAlias = float | Sequence[float]


class Thickness(AbstractMeasure):
    """Distance of upper from lower spots along a direction [m], or per length of the chord.

    These are toothpicks: their ends stay in the surface where they were put.

    Attributes
    ----------
    matrix
        What of the points read each upper spot less its lower one is.
    chords
        What the chord of each is, trailing less leading edge; no rows where there is none.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "s r"]
    chords: Float[np.ndarray, "c r"]
    along: Float[np.ndarray, "3"]

    def __init__(
        self,
        lower: Sequence[Spot],
        upper: Sequence[Spot],
        along: Along = "z",
        chord: Ends | Sequence[Ends] | None = None,
    ):
        if len(lower) != len(upper) or not lower:
            raise ParameterError(f"as many upper as lower spots, got {len(upper)}, {len(lower)}")
        chords = own_chords(chord, len(lower))
        pairs = [*zip(lower, upper, strict=True), *chords]
        self.reads, matrix = gathered([spot for pair in pairs for spot in pair])
        matrix = matrix[1::2] - matrix[::2]
        self.matrix, self.chords = matrix[: len(lower)], matrix[len(lower) :]
        self.along = direction(along)

    @classmethod
    def over(
        cls,
        geometry: Geometry,
        chord: Several,
        at: Several | None = None,
        component: str | None = None,
        along: Along | None = None,
        relative: bool = False,
    ) -> "Thickness":
        """Toothpicks at fractions of the chord, for each station y = `at` of a wing in turn."""
        lower, upper, chords = picks_over(geometry, chord, at, component)
        return cls(
            lower, upper, up(geometry) if along is None else along, chords if relative else None
        )

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        lower: list[Place] | None = None,
        upper: list[Place] | None = None,
        chord: float | list[float] | None = None,
        at: float | list[float] | None = None,
        component: str | None = None,
        along: Way | None = None,
        relative: bool = False,
    ) -> "Thickness":
        """Between lower and upper spots, or at fractions of the chord over stations y = `at`.

        Upwards by default; `relative` divides by the length of the chord at the station.
        """
        if chord is not None and lower is None and upper is None:
            return cls.over(geometry, chord, at, component, along, relative)
        if lower is None or upper is None or chord is not None or at is not None or relative:
            raise ParameterError("a thickness is said by lower and upper spots, or by chord and at")
        low, high = ([spot(geometry, place) for place in places] for places in (lower, upper))
        return cls(low, high, up(geometry) if along is None else along)

    @property
    @override
    def size(self) -> int:
        return len(self.matrix)

    @property
    @override
    def is_affine(self) -> bool:
        return not len(self.chords)

    @override
    def of(self, places: Points) -> Vector:
        heights = self.matrix @ places @ self.along
        if not len(self.chords):
            return heights
        return heights / jnp.linalg.norm(self.chords @ places, axis=1)


def own_chords(chord: Ends | Sequence[Ends] | None, count: int) -> list[Ends]:
    """The chord of each of some places: one for all, or one each, or none at all."""
    if chord is None:
        return []
    if isinstance(chord[0], Spot):
        return [(chord[0], chord[1])] * count  # type: ignore[list-item]
    if len(chord) != count:
        raise ParameterError(f"one chord, or one for each of {count} places, got {len(chord)}")
    return list(chord)  # type: ignore[arg-type]


def picks_over(
    geometry: Geometry, chord: Several, at: Several | None, component: str | None
) -> tuple[list[Spot], list[Spot], list[Ends]]:
    """Lower and upper spots and chords at fractions of the chord, for each station in turn."""
    stations = np.atleast_1d(np.array(at if at is not None else np.nan, float)).tolist()
    fractions = np.atleast_1d(np.array(chord, float)).tolist()
    lower: list[Spot] = []
    upper: list[Spot] = []
    chords: list[Ends] = []
    for y in stations:
        cut: Station = station(geometry, None if np.isnan(y) else y, component, "a thickness")
        lower += [Spot(*cut.foot(fraction, "lower")) for fraction in fractions]
        upper += [Spot(*cut.foot(fraction, "upper")) for fraction in fractions]
        chords += [ends_of(cut)] * len(fractions)
    return lower, upper, chords
