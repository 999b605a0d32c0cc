"""NACA airfoils of five digits, with simple and with reflexed camber lines."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Scalar, Vector
from ..errors import ParameterError
from .airfoil import (
    AbstractAirfoil,
    Edge,
    Outline,
    around_camber,
    check_edge,
    check_thickness,
    outlined,
)
from .naca4 import digits, half_thickness
from .spacing import Spacing

LIFT = 0.3
"""Design lift coefficient that the constants were published for; the slope is proportional."""

SIMPLE = np.array(
    [
        [0.05, 0.0580, 361.400],
        [0.10, 0.1260, 51.640],
        [0.15, 0.2025, 15.957],
        [0.20, 0.2900, 6.643],
        [0.25, 0.3910, 3.230],
    ]
)
"""Crest, where the cubic ends, and its constant k1 (report 537, table I)."""

REFLEXED = np.array(
    [
        [0.10, 0.1300, 51.990],
        [0.15, 0.2170, 15.793],
        [0.20, 0.3180, 6.520],
        [0.25, 0.4410, 3.191],
    ]
)
"""The same for lines with no pitching moment; k2 follows from these."""


class Naca5(AbstractAirfoil):
    """A section such as 23012: camber far forward, the thickness of the four digits.

    Parameters are "lift", the design lift coefficient, "crest", where the camber line is highest,
    and "thickness", the greatest one; the latter two of the chord.

    Attributes
    ----------
    lift, crest, thickness
        Its own values: 0.3, 0.15 and 0.12 of 23012.
    is_reflexed
        Whether the camber line bends up behind, as that of 23112, for no pitching moment.
    trailing_edge
        "sharp", by another last coefficient of the thickness, or "blunt" as published.
    outline
        How it is drawn.

    Notes
    -----
    Source: Jacobs and Pinkerton, NACA report 537, 1935; NASA TM 4741, 1996. The camber line's
    constants are the published ones where the crest is at a published place, and polynomials
    through them between those.
    """

    lift: float
    crest: float
    thickness: float
    is_reflexed: bool = eqx.field(static=True)
    trailing_edge: str = eqx.field(static=True)
    outline: Outline

    def __init__(
        self,
        designation: str = "23012",
        *,
        lift: float | None = None,
        crest: float | None = None,
        thickness: float | None = None,
        is_reflexed: bool | None = None,
        trailing_edge: Edge = "sharp",
        points_per_side: int = 101,
        spacing: Spacing | list[float] = "cosine",
        base_points: int = 0,
        chord: float = 1.0,
    ):
        own = _read(designation)
        self.lift = float(own[0] if lift is None else lift)
        self.crest = float(own[1] if crest is None else crest)
        self.thickness = float(own[2] if thickness is None else thickness)
        self.is_reflexed = bool(own[3] if is_reflexed is None else is_reflexed)
        check_edge(trailing_edge)
        places = (REFLEXED if self.is_reflexed else SIMPLE)[:, 0]
        if not places[0] <= self.crest <= places[-1]:
            raise ParameterError(
                f"the crest must lie between {places[0]} and {places[-1]} of chord, where the "
                f"camber line is published, got {self.crest}"
            )
        check_thickness(self.thickness)
        self.trailing_edge = trailing_edge
        self.outline = outlined(self, points_per_side, spacing, base_points, chord)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return {name: np.array([i]) for i, name in enumerate(("lift", "crest", "thickness"))}

    @property
    @override
    def values(self) -> Vector:
        return np.array([self.lift, self.crest, self.thickness])

    @property
    @override
    def is_blunt(self) -> bool:
        return self.trailing_edge == "blunt"

    @property
    @override
    def name(self) -> str:
        line = f"{self.lift / 0.15:.0f}{20 * self.crest:.0f}{self.is_reflexed:d}"
        return f"NACA {line}{100 * self.thickness:02.0f}"

    @override
    def sides(self, parameters: Vector, stations: Float[Array, "c"]) -> Array:
        lift, crest, thickness = parameters
        line = reflexed_line if self.is_reflexed else simple_line
        height, slope = line(lift, crest, jnp.asarray(stations))
        half = half_thickness(thickness, stations, self.trailing_edge)
        return around_camber(height, slope, half, stations)


def simple_line(lift: Scalar, crest: Scalar, x: Array) -> tuple[Array, Array]:
    """Height and slope of a cubic up to r, and of a straight line behind it."""
    r, k1 = _constants(SIMPLE, crest)
    bent = jnp.minimum(x - r, 0.0)
    height = bent**3 + r**3 * (1 - x)
    slope = 3 * bent**2 - r**3
    scale = lift / LIFT * k1 / 6
    return scale * height, scale * slope


def reflexed_line(lift: Scalar, crest: Scalar, x: Array) -> tuple[Array, Array]:
    """Height and slope of two cubics that meet at r with the same slope and curvature."""
    r, k1 = _constants(REFLEXED, crest)
    share = (3 * (r - crest) ** 2 - r**3) / (1 - r) ** 3  # k2 / k1: no slope at the crest
    bent = jnp.where(x < r, 1.0, share)
    height = bent * (x - r) ** 3 - share * (1 - r) ** 3 * x - r**3 * x + r**3
    slope = 3 * bent * (x - r) ** 2 - share * (1 - r) ** 3 - r**3
    scale = lift / LIFT * k1 / 6
    return scale * height, scale * slope


def through(places: np.ndarray, values: np.ndarray, at: Scalar) -> Array:
    """The polynomial through points, at another place."""
    total = jnp.zeros(())
    for i, value in enumerate(values):
        others = np.delete(places, i)
        total += value * jnp.prod(jnp.asarray(at) - others) / np.prod(places[i] - others)
    return total


def _constants(table: np.ndarray, crest: Scalar) -> tuple[Array, Array]:
    """r and k1; r / crest and k1 crest³ change little over the table."""
    places, r, k1 = table.T
    return (
        crest * through(places, r / places, crest),
        through(places, k1 * places**3, crest) / crest**3,
    )


def _read(designation: Any) -> tuple[float, float, float, bool]:
    lift, crest, reflex, *last = digits(designation, 5, "23012")
    if reflex > 1 or not 0 < crest < 6:
        raise ParameterError(
            f"NACA {designation}: the second digit of five is 1 to 5 and the third 0 or 1, got "
            f"{crest} and {reflex}; sections of the 6-series need a file of coordinates"
        )
    return 0.15 * lift, crest / 20, (10 * last[0] + last[1]) / 100, bool(reflex)
