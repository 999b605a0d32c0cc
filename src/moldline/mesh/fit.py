"""Smooth surfaces fitted to structured patches within a tolerance."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import BSpline, make_interp_spline
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .._types import ArrayLike
from ..errors import GeometryError, ParameterError
from .grid import Grid
from .stitch import TOLERANCE, layouts, welded

DEGREE = 3
"""Of the surfaces along both directions, so that curvature is continuous; less on fewer points."""


@dataclass(frozen=True)
class SplinePatch:
    """A tensor-product B-spline surface with clamped ends, over the unit square."""

    degrees: tuple[int, int]
    knots: tuple[np.ndarray, np.ndarray]
    poles: Float[np.ndarray, "nu nv 3"]
    deviation: float
    """Largest distance of a given point from the surface at its parameters [the points' unit]; the
    nearest place of the surface may be nearer."""

    def __call__(
        self, u: Float[np.ndarray, "a"], v: Float[np.ndarray, "b"]
    ) -> Float[np.ndarray, "a b 3"]:
        """Points at all pairs of parameters."""
        first = BSpline(self.knots[0], self.poles, self.degrees[0])(u)
        return BSpline(self.knots[1], first.transpose(1, 0, 2), self.degrees[1])(v).swapaxes(0, 1)


class _Axis(NamedTuple):
    """How points along one direction become poles."""

    degree: int
    knots: np.ndarray
    basis: np.ndarray
    """Weights of the poles at each point's parameter."""
    solution: np.ndarray
    """Poles by points."""


class _Strips(NamedTuple):
    """Directions of patches that share borders: they have parameters and knots in common.

    Direction d of patch p has the number 2 p + d.
    """

    strip: Int[np.ndarray, "d"]
    is_reversed: np.ndarray


def fitted(grid: Grid, tolerance: float) -> tuple[SplinePatch, ...]:
    """One surface per patch, no farther than `tolerance` from any of its points [their unit].

    Knots are added where the distance is too large, in the end one per point. The corners are met;
    a border is fitted to its own points alone, with the parameters and knots of the patch across,
    so that patches which share a whole border have the same curve there and leave no gap.
    """
    if not 0 < tolerance < np.inf:
        raise ParameterError(f"a fit's tolerance must be a length above 0, got {tolerance}")
    points, numbers = np.asarray(grid.points), layouts(grid)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise GeometryError(f"{len(bad)} points are not finite (first: {bad[0]}); none can be met")
    strips = _strips(numbers, welded(points, numbers, TOLERANCE))
    patches = [
        points[_turned(layout, strips.is_reversed[2 * p : 2 * p + 2])]
        for p, layout in enumerate(numbers)
    ]
    axes: dict[int, _Axis] = {}
    for strip in np.unique(strips.strip).tolist():
        members = np.flatnonzero(strips.strip == strip).tolist()
        rows = [np.moveaxis(patches[m // 2], m % 2, 0) for m in members]
        names = f"block {', '.join(str(m // 2 + 1) for m in members)}"
        axes[strip] = _axis(np.concatenate(rows, axis=1), tolerance, names)
    made = []
    for p, patch in enumerate(patches):
        u, v = (axes[int(strips.strip[2 * p + d])] for d in range(2))
        poles = np.einsum("ai,ijk,bj->abk", u.solution, patch, v.solution, optimize=True)
        there = np.einsum("ia,abk,jb->ijk", u.basis, poles, v.basis, optimize=True)
        deviation = float(np.linalg.norm(there - patch, axis=2).max())
        if deviation > tolerance:
            raise GeometryError(
                f"block {p + 1} cannot be met within {tolerance:g}, the best is {deviation:.3g}; "
                "give a larger tolerance"
            )
        made.append(SplinePatch((u.degree, v.degree), (u.knots, v.knots), poles, deviation))
    return tuple(made)


def lofted(sections: Sequence[ArrayLike]) -> Grid:
    """One patch through curves of as many points each, shape (n, 3), in their order."""
    curves = [np.asarray(section, np.float64) for section in sections]
    shapes = {curve.shape for curve in curves}
    if len(curves) < 2 or len(shapes) != 1 or next(iter(shapes))[1:] != (3,):
        told = ", ".join(map(str, sorted(shapes)))
        raise GeometryError(
            f"a loft needs at least 2 sections of one shape (n, 3), got {len(curves)} of {told}"
        )
    return Grid(np.concatenate(curves), ((len(curves[0]), len(curves), 1),))


def _turned(layout: np.ndarray, is_reversed: np.ndarray) -> np.ndarray:
    return layout[:: -1 if is_reversed[0] else 1, :: -1 if is_reversed[1] else 1]


def _strips(numbers: list[np.ndarray], leader: np.ndarray) -> _Strips:
    """Two nodes stand for each direction, as it is and reversed; shared borders join them."""
    count = 2 * len(numbers)
    known: dict[tuple[int, ...], int] = {}
    links = []
    for p, layout in enumerate(numbers):
        own = leader[layout]
        for d, border in ((0, own[:, 0]), (0, own[:, -1]), (1, own[0]), (1, own[-1])):
            line, here = tuple(border.tolist()), 2 * p + d
            if len(set(line)) == 1:
                continue  # collapsed to a point
            for key, shift in ((line, 0), (line[::-1], count)):
                if key in known:
                    links += [
                        (here, known[key] + shift),
                        (here + count, known[key] + count - shift),
                    ]
            known.setdefault(line, here)
    one, other = np.array(links, int).reshape(-1, 2).T
    graph = coo_array((np.ones(len(one), bool), (one, other)), shape=(2 * count, 2 * count))
    _, label = connected_components(graph, directed=False)
    as_is, over = label[:count], label[count:]
    return _Strips(np.minimum(as_is, over), over < as_is)


def _axis(rows: Float[np.ndarray, "n r 3"], tolerance: float, names: str) -> _Axis:
    """Parameters and knots that let every row be met within a third of the tolerance.

    The rest is for the other direction, whose poles these are fitted to.
    """
    place, degree = _parameters(rows, names), min(DEGREE, len(rows) - 1)
    inner = np.empty(0)
    while True:
        axis = _least_squares(place, inner, degree)
        missed = np.einsum("ia,aj,jrk->irk", axis.basis, axis.solution, rows, optimize=True) - rows
        is_bad = np.linalg.norm(missed, axis=2).max(axis=1) > tolerance / 3
        if not is_bad.any():
            return axis
        more = _split(place, inner, is_bad)
        if not len(more) or len(inner) + len(more) + degree + 1 >= len(place):
            return _interpolating(place, degree)
        inner = np.union1d(inner, more)


def _parameters(rows: Float[np.ndarray, "n r 3"], names: str) -> Float[np.ndarray, "n"]:
    """Lengths along the rows from 0 to 1, the mean of all that have not collapsed."""
    steps = np.linalg.norm(np.diff(rows, axis=0), axis=2)
    whole = steps.sum(axis=0)
    if not (whole > 0).any():
        raise GeometryError(f"{names} has no extent along one of its directions; leave it out")
    step = (steps[:, whole > 0] / whole[whole > 0]).mean(axis=1)
    if not (step > 0).all():
        at = int(np.argmin(step))
        raise GeometryError(
            f"{names} repeats a whole row of points ({at} and {at + 1}); drop one of the two"
        )
    place = np.append(0.0, np.cumsum(step))
    return place / place[-1]


def _least_squares(place: np.ndarray, inner: np.ndarray, degree: int) -> _Axis:
    """The ends are met, the points between as well as may be."""
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    basis = BSpline.design_matrix(place, knots, degree).toarray()
    solution = np.zeros(basis.T.shape)
    solution[0, 0] = solution[-1, -1] = 1.0
    rest = np.eye(len(place)) - basis @ solution
    solution[1:-1] = np.linalg.lstsq(basis[:, 1:-1], rest, rcond=None)[0]
    return _Axis(degree, knots, basis, solution)


def _interpolating(place: np.ndarray, degree: int) -> _Axis:
    knots = make_interp_spline(place, place, k=degree).t
    basis = BSpline.design_matrix(place, knots, degree).toarray()
    return _Axis(degree, knots, basis, np.linalg.inv(basis))


def _split(place: np.ndarray, inner: np.ndarray, is_bad: np.ndarray) -> np.ndarray:
    """New knots in the middle of the points of each span that has a bad one, if it has enough."""
    breaks = np.concatenate([[0.0], inner, [1.0]])
    span = np.clip(np.searchsorted(breaks, place, side="right") - 1, 0, len(inner))
    made = []
    for number in np.unique(span[is_bad]).tolist():
        own = place[span == number]
        if len(own) >= 4:
            made.append((own[len(own) // 2 - 1] + own[len(own) // 2]) / 2)
    return np.array(made)
