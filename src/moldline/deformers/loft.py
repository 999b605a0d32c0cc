"""The net behind wing and body skeletons: affine maps of sections, lofted between stations."""

from collections.abc import Sequence
from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import BSpline
from typing_extensions import override

from .._types import Array, Points, Vector, is_concrete
from ..errors import ParameterError
from ..numerics import bspline
from ..numerics.tensor_spline import evaluated
from .base import AbstractBinding, DefinedBinding
from .embedding import EmbeddedBinding, Embedding, Part
from .net import AXES, AbstractControlNet, grid_lines

Lofting = Literal["linear", "cubic"]

MIRROR = np.array([1.0, -1.0, 1.0])
"""Takes a place, or a displacement, to the other side of y = 0."""


class Loft(AbstractControlNet):
    """Move sections by affine maps that are given at stations along x or y, and lofted between.

    A place has a station coordinate and two section coordinates: its distance from a line of
    origins, in scales, both of which run from station to station as the motion does. So what is
    straight from one station to the next, at a fixed part of the chord, stays straight. Each
    station has four control points. Their motion holds as an affine map all over its plane, not
    only between them; beyond the first and last station sections move as the nearest one does.

    Attributes
    ----------
    axis
        Along which the stations are: "x" or "y".
    stations
        [m], ascending.
    origins
        Where the section coordinates begin, in the other two axes, for each station [m].
    scales
        Length of a unit of the section coordinates at each station [m].
    ends
        Section coordinates of the control points: the lower and the upper of each axis.
    sides
        1 for y >= 0, -1 for its mirror image, which moves as its image does.
    axes
        Splines of the section coordinates, with that along the stations in the middle, whose
        control points are the rows of the net.
    rows
        Takes values at the stations to those of the rows whose spline interpolates them.
    """

    stations: Float[np.ndarray, "s"]
    origins: Float[np.ndarray, "s 2"]
    scales: Float[np.ndarray, "s"]
    ends: Float[np.ndarray, "2 2"]
    axes: tuple[bspline.Axis, bspline.Axis, bspline.Axis]
    rows: Float[np.ndarray, "s s"]
    frozen: np.ndarray
    axis: str = eqx.field(static=True)
    sides: tuple[int, ...] = eqx.field(static=True)

    def __init__(
        self,
        axis: str,
        stations: Any,
        origins: Any,
        scales: Any,
        ends: Any,
        sides: Sequence[int] = (1,),
        loft: str = "linear",
    ):
        self.axis, self.sides = axis, tuple(sides)
        self.stations, self.scales = np.asarray(stations, float), np.asarray(scales, float)
        self.origins, self.ends = np.asarray(origins, float), np.asarray(ends, float)
        self._check(loft)
        count = len(self.stations)
        places = (self.stations - self.stations[0]) / (self.stations[-1] - self.stations[0])
        inner = places[1:-1] if loft == "linear" else places[2:-2]
        degree = 1 if loft == "linear" else 3
        spline = bspline.clamped(count, degree, "extend", tuple(inner.tolist()))
        self.axes = (_affine(self.ends[0]), spline, _affine(self.ends[1]))
        weights = BSpline.design_matrix(places, spline.knots, spline.degree)
        self.rows = np.linalg.inv(weights.toarray())
        self.rows[[0, -1]] = np.eye(count)[[0, -1]]  # to the bit, for what lies on y = 0
        self.frozen = np.zeros((len(self.sides), 2, count, 2), bool)
        self._check_scales()

    def _check(self, loft: str) -> None:
        if loft not in ("linear", "cubic"):
            raise ParameterError(f"loft must be linear or cubic, got {loft!r}")
        arrays = (self.stations, self.origins, self.scales, self.ends)
        rises = len(self.stations) > 1 and np.all(np.diff(self.stations) > 0)
        if not rises or not all(np.isfinite(array).all() for array in arrays):
            raise ParameterError(
                f"a skeleton needs two or more ascending stations, got {self.stations.tolist()}"
            )
        if not np.all(self.scales > 0):
            station = int(np.argmin(self.scales))
            raise ParameterError(
                f"the section at {self.axis} = {self.stations[station]:.6g} has the size "
                f"{self.scales[station]:.6g}; it must be above 0"
            )

    def _check_scales(self) -> None:
        spline = self.axes[1]
        along = BSpline(spline.knots, self.rows @ self.scales, spline.degree)
        if along(np.linspace(0, 1, 16 * len(self.stations))).min() <= 0:
            raise ParameterError(
                f"a cubic through the sizes {self.scales.tolist()} of the sections falls below 0 "
                "between them; use loft = 'linear' or more stations"
            )

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Sides, and control points along the first section axis, the stations and the second."""
        return (len(self.sides), 2, len(self.stations), 2)

    @property
    def _reach(self) -> Any:
        return self.stations[-1] - self.stations[0]

    @property
    def across(self) -> list[int]:
        """Numbers of the two section axes."""
        return [axis for axis in range(3) if axis != AXES[self.axis]]

    @property
    @override
    def size(self) -> int:
        return 3 * int(np.prod(self.counts))

    @property
    @override
    def rest(self) -> Float[np.ndarray, "sides 2 s 2 3"]:
        """Control points at rest [m]; rows of a cubic loft do not lie at the stations."""
        places = np.empty((2, len(self.stations), 2, 3))
        places[..., AXES[self.axis]] = (self.rows @ self.stations)[:, None]
        offsets = self.rows @ self._corners().reshape(2, len(self.stations), 4)
        origins = (self.rows @ self.origins)[:, None]
        places[..., self.across] = offsets.reshape(2, -1, 2, 2) + origins
        return np.stack([places if side > 0 else MIRROR * places for side in self.sides])

    def _corners(self) -> Float[np.ndarray, "2 s 2 2"]:
        """Of the sections at the stations, from their origins [m]."""
        first, second = np.meshgrid(*self.ends, indexing="ij")
        return self.scales[:, None, None] * np.stack([first, second], axis=-1)[:, None]

    def carried(
        self, shifts: Float[Array, "s 3"], slopes: Float[Array, "s 3 2"]
    ) -> Float[Array, "k"]:
        """The net's controls for a map of each station: displacements of its origin [m] and slopes.

        A place of the section, `offset` from its origin, moves by shift + slope @ offset.
        """
        moves = shifts[:, None] + jnp.einsum("sij,asbj->asbi", slopes, self._corners())
        moves = jnp.einsum("rs,asbi->arbi", self.rows, moves)
        return jnp.stack([moves if side > 0 else MIRROR * moves for side in self.sides]).ravel()

    @override
    def moves(self, controls: Vector) -> Float[Array, "sides 2 s 2 3"]:
        return controls.reshape(*self.counts, 3)

    @override
    def numbers(self, index: Any) -> Int[np.ndarray, "c"]:
        rows = np.asarray(index, int)
        if rows.ndim != 2 or rows.shape[1] != 4 or np.any((rows < 0) | (rows >= self.counts)):
            raise ParameterError(
                f"indices (side, i, station, j) of a loft of {self.counts}, got {index}"
            )
        return np.ravel_multi_index(tuple(rows.T), self.counts)

    @override
    def direction(self, axis: str) -> Float[np.ndarray, "3"]:
        return np.eye(3)[AXES[axis]]

    @property
    @override
    def lines(self) -> Int[np.ndarray, "l 2"]:
        numbers = np.arange(self.size // 3).reshape(self.counts)
        return np.concatenate([grid_lines(side) for side in numbers])

    @override
    def samples(self, most: int) -> Points:
        each = int((most / len(self.sides)) ** (1 / 3))
        lines = [np.linspace(low, high, min(each, 5)) for low, high in self.ends]
        grid = np.meshgrid(lines[0], self.axes[1].samples(each), lines[1], indexing="ij")
        first, along, second = (line.ravel() for line in grid)
        origin, scale = self._frame(along)
        places = np.empty((len(along), 3))
        places[:, AXES[self.axis]] = self.stations[0] + along * self._reach
        places[:, self.across] = origin + scale * np.stack([first, second], axis=1)
        return np.concatenate([places if side > 0 else MIRROR * places for side in self.sides])

    @override
    def tears(self, points: Points, edges: Array, controls: Vector) -> tuple[Array, Array]:
        """None: it moves all of space, and where sides meet they move alike."""
        return np.empty((0, 3)), np.empty(0)

    @override
    def __call__(self, points: Points, controls: Vector) -> Points:
        return points + self.field(points, self.moves(controls))

    def field(self, points: Points, moves: Float[Array, "sides 2 s 2 3"]) -> Points:
        """Displacements of points by displacements of the control points [m]."""
        u = self.coordinates(points)
        found = [evaluated(self.axes, u, side) for side in moves]
        return jnp.where(self._is_first(points)[:, None], found[0], found[-1])

    @override
    def bind(self, points: Points) -> AbstractBinding:
        if not is_concrete(points):
            return DefinedBinding(self, points)
        points = np.asarray(points)
        index = np.arange(self.size // 3).reshape(self.counts)
        u, is_first = np.asarray(self.coordinates(points)), np.asarray(self._is_first(points))
        parts = [Part(self.axes, index[0], u, None)]
        if len(self.sides) > 1:
            rows = [np.flatnonzero(is_own) for is_own in (is_first, ~is_first)]
            parts = [Part(self.axes, index[i], u[own], own) for i, own in enumerate(rows)]

        def field(moves: Array) -> Array:
            return self.field(points, moves.reshape(*self.counts, 3))

        return EmbeddedBinding(self, Embedding(points, parts, self.size // 3, field))

    def _is_first(self, points: Points) -> Array:
        """Whether each point is on the first side; all are where there is one side only."""
        is_there = jnp.asarray(points)[:, 1] * self.sides[0] >= 0
        return is_there if len(self.sides) > 1 else jnp.ones_like(is_there)

    def coordinates(self, points: Points) -> Points:
        """First section coordinate, station coordinate from 0 to 1, second section coordinate."""
        side = jnp.where(self._is_first(points), self.sides[0], self.sides[-1])
        places = jnp.asarray(points).at[:, 1].multiply(side)
        along = (places[:, AXES[self.axis]] - self.stations[0]) / self._reach
        origin, scale = self._frame(along)
        section = (places[:, self.across] - origin) / scale
        return jnp.stack([section[:, 0], along, section[:, 1]], axis=1)

    def _frame(self, along: Float[Array, "n"]) -> tuple[Float[Array, "n 2"], Float[Array, "n 1"]]:
        """Origin and scale of the section at each station coordinate."""
        one = bspline.clamped(1, 1, "extend")
        frame = self.rows @ jnp.column_stack([self.origins, self.scales])
        u = jnp.repeat(jnp.asarray(along)[:, None], 3, axis=1)
        found = evaluated((one, self.axes[1], one), u, frame[None, :, None])
        return found[:, :2], found[:, 2:]


def _affine(ends: Float[np.ndarray, "2"]) -> bspline.Axis:
    """Two control points whose weights are linear everywhere, also beyond them."""
    low, high = ends
    powers = np.array([[[high, -low], [-1.0, 1.0]]]) / (high - low)
    return bspline.Axis(ends, np.array([-np.inf]), np.zeros(1), np.ones(1), powers, np.empty(0))
