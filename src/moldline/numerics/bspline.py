"""One axis of a tensor-product spline, as polynomials of a local coordinate in each cell."""

import math
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import BSpline

from ..errors import ParameterError

Ends = Literal["clamped", "blender"]
Outside = Literal["keep", "extend"]

ROUNDING = 1e-12
"""A point this far beyond an end, in lengths of the axis, still counts as on it."""

_UNIFORM_CUBIC = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6.0


class Axis(NamedTuple):
    """Weights of the control points along one axis, whose box runs from 0 to 1.

    Cell c begins at `starts[c]`; the first begins at minus infinity. In it the weight of control
    point k is the sum over a of `powers[c, a, k] * t**a`, t = (u - offsets[c]) * scales[c].
    `interior` are the knots inside (0, 1), as often as they count.
    """

    rest: Float[np.ndarray, "count"]
    starts: Float[np.ndarray, "cells"]
    offsets: Float[np.ndarray, "cells"]
    scales: Float[np.ndarray, "cells"]
    powers: Float[np.ndarray, "cells terms count"]
    interior: Float[np.ndarray, "inner"]

    @property
    def size(self) -> int:
        """Control points."""
        return self.powers.shape[2]

    @property
    def terms(self) -> int:
        """Coefficients of each polynomial: its degree plus one."""
        return self.powers.shape[1]

    @property
    def degree(self) -> int:
        """Of the polynomials; 0 where nothing depends on the axis."""
        return self.terms - 1

    @property
    def knots(self) -> np.ndarray:
        """All of a clamped spline's, those at its ends included."""
        return _knots(self.interior, self.degree)

    def samples(self, most: int, per_cell: int = 4) -> np.ndarray:
        """Places from 0 to 1, some in each cell."""
        if self.size == 1:
            return self.rest
        return np.linspace(0, 1, min(most, per_cell * (len(self.starts) - 2) + 1))


def clamped(
    count: int, degree: int, outside: str, interior: tuple[float, ...] | None = None
) -> Axis:
    """B-spline with clamped ends; control points rest at the Greville positions.

    Too few control points lower the degree. With `degree = count - 1` it is the Bernstein basis.
    `interior` are the knots inside (0, 1), even by default: count - degree - 1 of them. One that
    is there k times leaves degree - k continuous derivatives.
    Source: Piegl and Tiller, The NURBS Book, 2nd ed., chapter 2.
    """
    degree = min(degree, count - 1)
    if degree == 0:
        return _constant()
    even_ones = np.linspace(0, 1, count - degree + 1)[1:-1]
    inner = even_ones if interior is None else np.array(interior, float)
    knots = _knots(inner, degree)
    # without the two outermost, none may be there more than `degree` times, those at the ends too
    inmost = knots[1:-1]
    rises = np.all(np.diff(inmost) >= 0) and np.all(inmost[degree:] > inmost[:-degree])
    if len(inner) != count - degree - 1 or not rises:
        raise ParameterError(
            f"{count} control points of degree {degree} need {count - degree - 1} knots, "
            f"ascending inside (0, 1), each {degree} times at most, got {list(inner)}"
        )
    breaks = np.unique(knots)
    widths = np.diff(breaks)
    # About its middle a polynomial of high degree is better conditioned; about its start a low
    # one is exact at the end of the box, which keeps points on a symmetry plane there.
    centre = 0.5 if degree > 3 else 0.0
    offsets = breaks[:-1] + centre * widths
    basis = BSpline(knots, np.eye(count), degree)
    powers = np.stack(
        [
            basis(offsets, nu=a) * widths[:, None] ** a / math.factorial(a)
            for a in range(degree + 1)
        ],
        axis=1,
    )
    rest = np.array([knots[k + 1 : k + degree + 1].mean() for k in range(count)])
    return _enclosed(rest, breaks, offsets, powers, outside, inner)


def even(count: int, outside: str) -> Axis:
    """Blender's rule: evenly spaced control points, neighbours beyond an end are the end's.

    Source: Blender's lattice modifier with B-spline interpolation; the formula was checked
    against its output (docs/decisions/0004-end-rule-of-the-lattice.md).
    """
    if count == 1:
        return _constant()
    first, last = (0, count - 2) if outside == "keep" else (-1, count - 1)
    cells = np.arange(first, last + 1)
    powers = np.zeros((len(cells), 4, count))
    for row, cell in enumerate(cells):
        for tap in range(4):
            powers[row, :, np.clip(cell + tap - 1, 0, count - 1)] += _UNIFORM_CUBIC[:, tap]
    breaks = np.append(cells, last + 1) / (count - 1)
    inner = breaks[(breaks > 0) & (breaks < 1)]
    return _enclosed(np.linspace(0, 1, count), breaks, breaks[:-1], powers, outside, inner)


def _constant() -> Axis:
    """One control point: it moves everything, wherever it is."""
    one, none = np.ones((1, 1, 1)), np.empty(0)
    return Axis(np.array([0.5]), np.array([-np.inf]), np.zeros(1), np.zeros(1), one, none)


def _knots(interior: np.ndarray, degree: int) -> np.ndarray:
    return np.concatenate([np.zeros(degree + 1), interior, np.ones(degree + 1)])


def _enclosed(
    rest: np.ndarray,
    breaks: np.ndarray,
    offsets: np.ndarray,
    powers: np.ndarray,
    outside: str,
    interior: np.ndarray,
) -> Axis:
    """Add the two cells beyond the ends: unmoved, or moved as the end control point is."""
    beyond = np.zeros((2, *powers.shape[1:]))
    if outside == "extend":
        beyond[0, 0, 0] = beyond[1, 0, -1] = 1.0
    starts = np.concatenate([[-np.inf], breaks])
    starts[1] -= ROUNDING
    starts[-1] += ROUNDING
    return Axis(
        rest,
        starts,
        np.concatenate([[0.0], offsets, [0.0]]),
        np.concatenate([[0.0], 1 / np.diff(breaks), [0.0]]),
        np.concatenate([beyond[:1], powers, beyond[1:]]),
        interior,
    )
