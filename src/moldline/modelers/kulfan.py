"""Airfoils by class and shape functions (CST), and their fit to given coordinates."""

from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.special import comb
from typing_extensions import override

from .._types import Array, ArrayLike, Scalar, Vector
from ..errors import ParameterError
from ..mesh import Section
from .airfoil import AbstractAirfoil, Outline, outlined
from .quantities import finite
from .spacing import Spacing
from .tabulated import found, two_sides

TERMS = 100
"""More coefficients than this on a side only fit noise."""


class Kulfan(AbstractAirfoil):
    """Two sides, each a class function times Bernstein polynomials, and what may be added to both.

    y = x^a (1 - x)^b Σ c_i B_i(x) + nose x (1 - x)^(n + 1/2) + x (tail ± edge / 2), with n the
    number of coefficients on the side. Parameters are "upper" and "lower", the coefficients, and
    those of "edge", "tail" and "nose" that were given.

    Attributes
    ----------
    upper, lower
        Coefficients c; as many as wanted, also different numbers. Below, most are negative.
    exponents
        Class exponents a and b: 0.5 and 1 for a round nose and a pointed end.
    edge
        Thickness of a blunt trailing edge, in chords; None for a sharp one.
    tail
        Height of the trailing edge's middle, in chords; None for 0.
    nose
        Factor of a term that bends the nose; None for none.
    outline
        How it is drawn.

    Notes
    -----
    Source: Kulfan, J. Aircraft 45 (1), 2008; the term at the nose: Kulfan, Modification of CST
    Airfoil Representation Methodology.
    """

    upper: Float[np.ndarray, "u"]
    lower: Float[np.ndarray, "l"]
    exponents: tuple[float, float] = eqx.field(static=True)
    edge: float | None
    tail: float | None
    nose: float | None
    outline: Outline

    def __init__(
        self,
        upper: ArrayLike,
        lower: ArrayLike,
        *,
        exponents: tuple[float, float] = (0.5, 1.0),
        edge: float | None = None,
        tail: float | None = None,
        nose: float | None = None,
        points_per_side: int = 101,
        spacing: Spacing | list[float] = "cosine",
        base_points: int = 0,
        chord: float = 1.0,
    ):
        self.upper, self.lower = _coefficients("upper", upper), _coefficients("lower", lower)
        first, second = (float(e) for e in exponents)
        if not (0 < first < 10 and 0 <= second < 10):
            raise ParameterError(
                f"class exponents are above 0 at the nose and 0 or more behind, got {exponents}"
            )
        self.exponents = (first, second)
        if edge is not None and not edge > 0:
            raise ParameterError(
                f"the edge's thickness must be above 0 of chord, got {edge}; leave it out for a "
                "sharp trailing edge"
            )
        finite(edge=edge, tail=tail, nose=nose)
        self.edge, self.tail, self.nose = (
            None if given is None else float(given) for given in (edge, tail, nose)
        )
        self.outline = outlined(self, points_per_side, spacing, base_points, chord)

    @classmethod
    @override
    def build(
        cls,
        folder: Path,
        *,
        upper: list[float] | None = None,
        lower: list[float] | None = None,
        fit: str | None = None,
        order: int = 8,
        exponents: tuple[float, float] = (0.5, 1.0),
        edge: float | None = None,
        tail: float | None = None,
        nose: float | None = None,
        points_per_side: int = 101,
        spacing: Spacing | list[float] = "cosine",
        base_points: int = 0,
        chord: float = 1.0,
    ) -> "Kulfan":
        """From a case file: coefficients, or a table or file to `fit` them to."""
        drawn: dict[str, Any] = {
            "points_per_side": points_per_side, "spacing": spacing,
            "base_points": base_points, "chord": chord,
        }  # fmt: skip
        first, second = exponents
        if fit is not None:
            if not (upper is None and lower is None and edge is None and tail is None):
                raise ParameterError(
                    "a fit finds upper, lower, edge and tail itself; leave them out, or leave out "
                    "fit"
                )
            section = found(fit, folder)
            has_nose = nose is not None
            return cls.fitted(section, order, (first, second), has_nose, **drawn).airfoil
        if upper is None or lower is None:
            raise ParameterError("kulfan needs coefficients upper and lower, or fit = a section")
        return cls(
            upper, lower, exponents=(first, second), edge=edge, tail=tail, nose=nose, **drawn
        )

    @classmethod
    def fitted(
        cls,
        section: Section | ArrayLike,
        order: int = 8,
        exponents: tuple[float, float] = (0.5, 1.0),
        has_nose_term: bool = False,
        **options: Any,
    ) -> "Fit":
        """The airfoil of a Bernstein order that lies nearest to given coordinates.

        Least squares in the heights of the given points, nose at the origin and chord 1; the
        trailing edge is that of the coordinates. `options` say how it is drawn.
        """
        points = section.points if isinstance(section, Section) else section
        name = section.name if isinstance(section, Section) else "section"
        upper, lower = two_sides(np.asarray(points, float), name)
        if not 1 <= order < TERMS:
            raise ParameterError(f"the order must be 1 to {TERMS - 1}, got {order}")
        terms = order + 1
        middle, gap = (upper[-1, 1] + lower[-1, 1]) / 2, upper[-1, 1] - lower[-1, 1]
        columns, rows = 2 * terms + has_nose_term, []
        for side, first in ((upper, 0), (lower, terms)):
            row = np.zeros((len(side), columns))
            row[:, first : first + terms] = _shapes(side[:, 0], terms, exponents)
            if has_nose_term:
                row[:, -1] = _nose_shape(side[:, 0], terms)
            rows.append(row)
        tails = [
            side[:, 1] - side[:, 0] * (middle + half)
            for side, half in ((upper, gap / 2), (lower, -gap / 2))
        ]
        matrix, heights = np.concatenate(rows), np.concatenate(tails)
        if np.linalg.matrix_rank(matrix) < columns:
            raise ParameterError(
                f"{name}: {len(upper)} and {len(lower)} points on the sides do not fix "
                f"{columns} coefficients; give a lower order"
            )
        found, *_ = np.linalg.lstsq(matrix, heights, rcond=None)
        airfoil = cls(
            found[:terms],
            found[terms : 2 * terms],
            exponents=exponents,
            edge=float(gap) if gap > 1e-9 else None,
            tail=float(middle) if abs(middle) > 1e-9 else None,
            nose=float(found[-1]) if has_nose_term else None,
            **options,
        )
        return Fit(airfoil, matrix @ found - heights)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        u, count = len(self.upper), len(self.upper) + len(self.lower)
        extra = {name: np.array([count + i]) for i, name in enumerate(self._extras)}
        return {"upper": np.arange(u), "lower": np.arange(u, count)} | extra

    @property
    @override
    def values(self) -> Vector:
        return np.concatenate([self.upper, self.lower, list(self._extras.values())])

    @property
    @override
    def is_blunt(self) -> bool:
        return self.edge is not None

    @property
    @override
    def name(self) -> str:
        return f"Kulfan {len(self.upper)} + {len(self.lower)}"

    @override
    def sides(self, parameters: Vector, stations: Float[Array, "c"]) -> Array:
        x, u, count = jnp.asarray(stations), len(self.upper), len(self.upper) + len(self.lower)
        coefficients = parameters[:u], parameters[u:count]
        extra = dict(zip(self._extras, parameters[count:], strict=True))
        sides = []
        for given, sign in zip(coefficients, (1, -1), strict=True):
            y = _shapes(x, len(given), self.exponents) @ given
            y += x * (extra.get("tail", 0.0) + sign * extra.get("edge", 0.0) / 2)
            if "nose" in extra:
                y += extra["nose"] * _nose_shape(x, len(given))
            sides.append(jnp.stack([x, y], axis=1))
        return jnp.stack(sides)

    @property
    def _extras(self) -> dict[str, float]:
        """Values of what was given beside the coefficients."""
        given = {"edge": self.edge, "tail": self.tail, "nose": self.nose}
        return {name: value for name, value in given.items() if value is not None}


class Fit(NamedTuple):
    """An airfoil fitted to coordinates, and how far it is from each of them.

    `residuals` are heights above the given points in chords, upper side first, both from the
    nose.
    """

    airfoil: Kulfan
    residuals: Float[np.ndarray, "p"]

    @property
    def largest(self) -> float:
        """Largest distance in height, in chords."""
        return float(np.abs(self.residuals).max())

    @property
    def rms(self) -> float:
        """Root of the mean square of the distances."""
        return float(np.sqrt(np.mean(self.residuals**2)))


def _shapes(x: Array, count: int, exponents: tuple[float, float]) -> Array:
    """Class function times each Bernstein polynomial, one column for each."""
    first, second = exponents
    degree = count - 1
    envelope = _power(x, first) * _power(1 - x, second)
    i = np.arange(count)
    inner = x[:, None] ** i * (1 - x[:, None]) ** (degree - i)
    return envelope[:, None] * comb(degree, i) * inner


def _nose_shape(x: Array, count: int) -> Array:
    return x * _power(1 - x, count + 0.5)


def _power(base: Array, exponent: Scalar) -> Array:
    """A power with the slope 0 where the base is 0, where the true one may be infinite."""
    is_inside = base > 0
    inside = jnp.where(is_inside, jnp.where(is_inside, base, 1.0) ** exponent, 0.0)
    return jnp.where(base == 0, 1.0, inside) if exponent == 0 else inside


def _coefficients(name: str, given: ArrayLike) -> np.ndarray:
    found = np.asarray(given, float)
    if found.ndim != 1 or not 1 <= len(found) <= TERMS or not np.isfinite(found).all():
        raise ParameterError(
            f"{name} must be a list of 1 to {TERMS} finite coefficients, got {given}"
        )
    return found
