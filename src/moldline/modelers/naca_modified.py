"""NACA airfoils of four digits with another nose and another place of the greatest thickness."""

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
from .naca4 import digits, numbered, read_four, two_parabolas
from .naca5 import through
from .spacing import Spacing, root

FALL = np.array([[0.2, 0.200], [0.3, 0.234], [0.4, 0.315], [0.5, 0.465], [0.6, 0.700]])
"""Place of the greatest thickness, and the slope at the trailing edge (report 492, table I)."""

BASE = {"sharp": 0.0, "blunt": 0.002}
"""Half the thickness at the trailing edge, of a section 20 % thick."""


class NacaModified(AbstractAirfoil):
    """A section such as 0012-64: camber of the four digits, and a thickness in two pieces.

    Parameters are "camber", "crest" and "thickness" of the four digits; "nose", the index of the
    nose radius, which is 1.1019 (t nose / 6)²; and "thickest", where the thickness is greatest.

    Attributes
    ----------
    camber, crest, thickness, nose, thickest
        Its own values: 0, 0.4, 0.12, 6 and 0.4 of 0012-64.
    trailing_edge
        "sharp" or, as published, "blunt": 1 % of the thickness on each side.
    outline
        How it is drawn.

    Notes
    -----
    Source: Stack and von Doenhoff, NACA report 492, 1934; NASA TM 4741, 1996. The index 9 stands
    for three times the radius of 6, which is 6√3. The slope at the trailing edge is the published
    one at the published places, and a polynomial through those between them.
    """

    camber: float
    crest: float
    thickness: float
    nose: float
    thickest: float
    trailing_edge: str = eqx.field(static=True)
    outline: Outline

    def __init__(
        self,
        designation: str = "0012-64",
        *,
        camber: float | None = None,
        crest: float | None = None,
        thickness: float | None = None,
        nose: float | None = None,
        thickest: float | None = None,
        trailing_edge: Edge = "sharp",
        points_per_side: int = 101,
        spacing: Spacing | list[float] = "cosine",
        base_points: int = 0,
        chord: float = 1.0,
    ):
        own = _read(designation)
        given = (camber, crest, thickness, nose, thickest)
        chosen = [float(o if g is None else g) for o, g in zip(own, given, strict=True)]
        self.camber, self.crest, self.thickness, self.nose, self.thickest = chosen
        check_edge(trailing_edge)
        check_crest(self.crest)
        check_thickness(self.thickness)
        if not self.nose >= 0:
            raise ParameterError(f"the nose's index must be 0 or more, got {self.nose}")
        if not FALL[0, 0] <= self.thickest <= FALL[-1, 0]:
            raise ParameterError(
                f"thickest must lie between {FALL[0, 0]} and {FALL[-1, 0]} of chord, where the "
                f"thickness is published, got {self.thickest}"
            )
        self.trailing_edge = trailing_edge
        self.outline = outlined(self, points_per_side, spacing, base_points, chord)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        names = ("camber", "crest", "thickness", "nose", "thickest")
        return {name: np.array([i]) for i, name in enumerate(names)}

    @property
    @override
    def values(self) -> Vector:
        return np.array([self.camber, self.crest, self.thickness, self.nose, self.thickest])

    @property
    @override
    def is_blunt(self) -> bool:
        return self.trailing_edge == "blunt"

    @property
    @override
    def name(self) -> str:
        line = f"{numbered(self.camber, self.crest)}{100 * self.thickness:02.0f}"
        return f"NACA {line}-{self.nose:.0f}{10 * self.thickest:.0f}"

    @override
    def sides(self, parameters: Vector, stations: Float[Array, "c"]) -> Array:
        camber, crest, thickness, nose, thickest = parameters
        height, slope = two_parabolas(camber, crest, stations)
        half = thickness / 0.2 * half_modified(nose, thickest, stations, self.trailing_edge)
        return around_camber(height, slope, half, stations)


def half_modified(nose: Scalar, thickest: Scalar, stations: Array, edge: str) -> Array:
    """Half the thickness of a section 20 % thick.

    Behind the greatest thickness it is a cubic of the distance from the trailing edge; before it
    a root and a cubic, with the same height, slope and curvature there.
    """
    x, m, base = jnp.asarray(stations), thickest, BASE[edge]
    u, h = 1 - m, 0.1 - base
    d1 = through(FALL[:, 0], FALL[:, 1], m)
    d2, d3 = (3 * h - 2 * u * d1) / u**2, (u * d1 - 2 * h) / u**3
    v = 1 - x
    behind = base + v * (d1 + v * (d2 + v * d3))
    a0 = 0.296904 * nose / 6
    height = 0.1 - a0 * jnp.sqrt(m)
    slope = -a0 / (2 * jnp.sqrt(m))
    bend = 2 * d2 + 6 * d3 * u + a0 / (4 * m**1.5)
    last = (height - m * slope + m**2 * bend / 2) / m**3  # no height at the nose
    w = x - m
    before = a0 * root(x) + height + w * (slope + w * (bend / 2 + w * last))
    return jnp.where(x > 0, jnp.where(x < m, before, behind), 0.0)


def _read(designation: Any) -> tuple[float, float, float, float, float]:
    *four, index, tenths = digits(designation, 6, "0012-64")
    if not 2 <= tenths <= 6:
        raise ParameterError(
            f"NACA {designation}: the last digit, the place of the greatest thickness in tenths, "
            f"is 2 to 6, got {tenths}"
        )
    nose = 6 * np.sqrt(3) if index == 9 else index
    return *read_four("".join(map(str, four))), nose, tenths / 10
