"""NACA airfoils of four digits."""

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
    check_crest,
    check_edge,
    check_thickness,
    outlined,
)
from .spacing import Spacing, root

LAST = {"sharp": 0.1036, "blunt": 0.1015}
"""Last coefficient of the thickness; the published one leaves a base of 0.21 % of the chord."""

CREST = 0.4
"""Where the camber of a section without any would be highest."""


class Naca4(AbstractAirfoil):
    """A section such as 2412: a camber line of two parabolas, thickness at a right angle to it.

    Parameters are "camber", the camber line's greatest height, "crest", where that is, and
    "thickness", the greatest one, all of the chord.

    Attributes
    ----------
    camber, crest, thickness
        Its own values: 0.02, 0.4 and 0.12 of 2412. Without camber the crest is at 0.4, so that
        camber can be a variable.
    trailing_edge
        "sharp", by another last coefficient of the thickness, or "blunt" as published.
    outline
        How it is drawn.

    Notes
    -----
    Source: Jacobs, Ward and Pinkerton, NACA report 460, 1933. The second derivative by the crest
    jumps at the station where it is.
    """

    camber: float
    crest: float
    thickness: float
    trailing_edge: str = eqx.field(static=True)
    outline: Outline

    def __init__(
        self,
        designation: str = "0012",
        *,
        camber: float | None = None,
        crest: float | None = None,
        thickness: float | None = None,
        trailing_edge: Edge = "sharp",
        points_per_side: int = 101,
        spacing: Spacing | list[float] = "cosine",
        base_points: int = 0,
        chord: float = 1.0,
    ):
        own = read_four(designation)
        self.camber = float(own[0] if camber is None else camber)
        self.crest = float(own[1] if crest is None else crest)
        self.thickness = float(own[2] if thickness is None else thickness)
        check_edge(trailing_edge)
        check_crest(self.crest)
        check_thickness(self.thickness)
        self.trailing_edge = trailing_edge
        self.outline = outlined(self, points_per_side, spacing, base_points, chord)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return {name: np.array([i]) for i, name in enumerate(("camber", "crest", "thickness"))}

    @property
    @override
    def values(self) -> Vector:
        return np.array([self.camber, self.crest, self.thickness])

    @property
    @override
    def is_blunt(self) -> bool:
        return self.trailing_edge == "blunt"

    @property
    @override
    def name(self) -> str:
        return f"NACA {numbered(self.camber, self.crest)}{100 * self.thickness:02.0f}"

    @override
    def sides(self, parameters: Vector, stations: Float[Array, "c"]) -> Array:
        camber, crest, thickness = parameters
        height, slope = two_parabolas(camber, crest, stations)
        half = half_thickness(thickness, stations, self.trailing_edge)
        return around_camber(height, slope, half, stations)


def half_thickness(thickness: Scalar, stations: Array, edge: str) -> Array:
    """Half the thickness of sections of four and of five digits; its nose radius is 1.1019 t²."""
    x = jnp.asarray(stations)
    rest = x * (-0.1260 + x * (-0.3516 + x * (0.2843 - x * LAST[edge])))
    half = 5 * thickness * (0.2969 * root(x) + rest)
    return jnp.where(x < 1, half, 0.0) if edge == "sharp" else half  # rounding leaves a gap


def two_parabolas(camber: Scalar, crest: Scalar, stations: Array) -> tuple[Array, Array]:
    """Height and slope of the camber line of sections of four digits."""
    x = jnp.asarray(stations)
    is_front = x < crest
    scale = camber / jnp.where(is_front, crest, 1 - crest) ** 2
    start = jnp.where(is_front, 0.0, 1 - 2 * crest)
    return scale * (start + x * (2 * crest - x)), 2 * scale * (crest - x)


def numbered(camber: float, crest: float) -> str:
    """The two digits of a camber line."""
    return f"{100 * camber:.0f}{10 * crest:.0f}" if camber else "00"


def digits(designation: Any, count: int, example: str) -> list[int]:
    """The digits of a designation, with or without NACA before them."""
    found = str(designation).upper().replace("NACA", "").replace("-", "").replace(" ", "")
    if len(found) != count or not found.isdigit():
        raise ParameterError(
            f"a section of this family is named by {count} digits, such as {example}; "
            f"got {designation!r}"
        )
    return [int(d) for d in found]


def read_four(designation: Any) -> tuple[float, float, float]:
    first, second, *last = digits(designation, 4, "2412")
    if bool(first) != bool(second):
        raise ParameterError(
            f"NACA {designation}: camber and its place are both 0 or neither is; got {first} and "
            f"{second}"
        )
    return first / 100, second / 10 or CREST, (10 * last[0] + last[1]) / 100
