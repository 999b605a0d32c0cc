"""Where points lie in curved spline volumes: box coordinates by Newton's method.

A volume is a tensor-product spline of its control points, a map from the unit box into space. Its
inverse is found point by point, from the nearest of a set of samples, with steps that are halved
until they bring the point nearer and that slide along the sides of the box.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree
from tqdm import tqdm

from . import inversion_loops as loops
from .bspline import Axis
from .cellwise import Weights, coefficients
from .threads import cores, spread

TOLERANCE = 1e-9
"""A point is in a volume if it misses it by less than this, in sizes of the volume."""

STARTS = 12
"""Nearest samples that are tried before a point counts as outside."""

CHUNK = 100_000
"""Points between two steps of the progress bar."""

MOST_SAMPLES = 200
"""Along one axis of a volume."""

ROUNDING = 4 * np.finfo(float).eps


class Volume(NamedTuple):
    """One volume: its splines, control points (nu, nv, nw, 3), and what the loops need."""

    axes: tuple[Axis, Axis, Axis]
    controls: np.ndarray
    weights: Weights
    table: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, axes: tuple[Axis, Axis, Axis], controls: np.ndarray) -> "Volume":
        """With its polynomials worked out."""
        weights = Weights.of(axes)
        flat = controls.reshape(-1, 3)
        table = coefficients(weights, weights.cells, controls)
        return cls(axes, controls, weights, table, flat.min(axis=0), flat.max(axis=0))

    @property
    def size(self) -> float:
        """Diagonal of the box along the axes of space that holds all control points."""
        return float(np.linalg.norm(self.high - self.low))

    def samples(self) -> np.ndarray:
        """Box coordinates to begin from, a few along each axis in each cell."""
        lines = [axis.samples(MOST_SAMPLES, axis.terms) for axis in self.axes]
        return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)

    def at(self, u: np.ndarray) -> np.ndarray:
        """Places of box coordinates (n, 3) in space."""
        value, cell = np.zeros((len(u), 3)), np.zeros(len(u), int)
        powers = []
        for i, axis in enumerate(self.axes):
            own = np.searchsorted(axis.starts, u[:, i], side="right") - 1
            local = (u[:, i] - axis.offsets[own]) * axis.scales[own]
            powers.append(local[:, None] ** np.arange(axis.terms))
            cell = cell * len(axis.starts) + own
        for d in range(3):
            value[:, d] = np.einsum("nabc,na,nb,nc->n", self.table[cell, d], *powers, optimize=True)
        return value


class Places(NamedTuple):
    """Which volume each point lies in (-1: none), where in it, and what finding it took.

    `miss` is the distance that is left [the points' unit], `steps` Newton's steps.
    """

    volume: np.ndarray
    u: np.ndarray
    miss: np.ndarray
    steps: np.ndarray


class Locator:
    """Finds points in some volumes; the samples are sorted once."""

    def __init__(self, volumes: Sequence[Volume]):
        self.volumes = tuple(volumes)
        found = [volume.samples() for volume in volumes]
        self._starts = np.concatenate(found)
        self._owner = np.repeat(np.arange(len(found)), [len(u) for u in found])
        places = [volume.at(u) for volume, u in zip(volumes, found, strict=True)]
        self._tree = KDTree(np.concatenate(places))

    def __call__(self, points: np.ndarray, progress: bool = False) -> Places:
        """Places of points (n, 3); of a point in several volumes the first that is found."""
        result = Places(
            np.full(len(points), -1, np.int32),
            np.full((len(points), 3), np.nan),
            np.full(len(points), np.inf),
            np.zeros(len(points), np.int32),
        )
        chunks = range(0, len(points), CHUNK)
        quiet = not progress or len(chunks) < 2
        for first in tqdm(chunks, desc="embedding", delay=2, leave=False, disable=quiet):
            rows = slice(first, min(first + CHUNK, len(points)))
            self._locate(points[rows], Places(*(array[rows] for array in result)))
        return result

    def _locate(self, points: np.ndarray, result: Places) -> None:
        """Fill the result of some points: from the nearest sample, then from others."""
        near = np.zeros(len(points), bool)
        for volume in self.volumes:
            room = TOLERANCE * volume.size
            near |= np.all((points >= volume.low - room) & (points <= volume.high + room), axis=1)
        left = np.flatnonzero(near)
        samples = min(STARTS, len(self._starts))
        for tries in (range(1), range(1, samples)):
            if not len(left):
                return
            _, rows = self._tree.query(points[left], k=tries.stop, workers=cores())
            rows = rows.reshape(len(left), -1)
            for column in tries:
                todo = np.flatnonzero(result.volume[left] < 0)
                self._try(points, left[todo], rows[todo, column], result)
            left = left[result.volume[left] < 0]

    def _try(self, points: np.ndarray, which: np.ndarray, start: np.ndarray, found: Places) -> None:
        for number, volume in enumerate(self.volumes):
            own = self._owner[start] == number
            rows = which[own]
            if not len(rows):
                continue
            u, miss = self._starts[start[own]].copy(), np.empty(len(rows))
            steps = np.empty(len(rows), np.int32)
            spread(
                loops.invert,
                len(rows),
                volume.weights.terms,
                *(tuple(getattr(axis, name) for axis in volume.axes) for name in _TABLES),
                volume.table,
                np.array([axis.size > 1 for axis in volume.axes]),
                points[rows],
                ROUNDING * volume.size,
                u,
                miss,
                steps,
                least=64,
            )
            better = miss < found.miss[rows]
            found.u[rows[better]], found.miss[rows[better]] = u[better], miss[better]
            found.steps[rows] += steps
            found.volume[rows[miss <= TOLERANCE * volume.size]] = number


_TABLES = ("starts", "offsets", "scales")
