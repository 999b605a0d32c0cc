"""A program's points and their derivatives, each found once."""

import hashlib
import logging
from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from ..mesh import Geometry
from ..numerics.step_control import Line, Probe, Slope, StepControl
from .program_runs import AbstractRuns, Place

COMPLEX_STEP = 1e-20
"""Size of imaginary parts: its square is lost in rounding."""

INPUT_TRIAL = 1e-3
"""A motion of the file in that matters, as a part of its extent."""

MOST = 2**25
"""Numbers that are remembered of each kind."""

FILE_IN = "points of the file in"

Kept = TypeVar("Kept")

log = logging.getLogger("moldline.program")


class Change(NamedTuple):
    """A direction: of the parameters, and of the points of the file in."""

    numbers: np.ndarray
    points: np.ndarray | None


class Memory(Generic[Kept]):
    """The last few things by their keys; `MOST` numbers in all, of which `size` says how many."""

    def __init__(self, size: Callable[[Kept], int]):
        self._size = size
        self._held: OrderedDict[bytes, Kept] = OrderedDict()

    def kept(self, key: bytes) -> Kept | None:
        """What is remembered by a key."""
        if key in self._held:
            self._held.move_to_end(key)
        return self._held.get(key)

    def keep(self, key: bytes, value: Kept) -> Kept:
        """Remember it, and forget what was not asked for longest."""
        self._held[key] = value
        while len(self._held) > 1 and sum(map(self._size, self._held.values())) > MOST:
            self._held.popitem(last=False)
        return value


class Slopes:
    """Points of a program, and motions of them for changes of what it is given.

    Attributes
    ----------
    rest
        What it makes of its own values.
    control
        How differences are taken.
    input_trial
        A motion of the points of the file in that matters [m].
    found
        The last derivative by each parameter, by its label: its step and about its error.
    """

    def __init__(
        self,
        runs: AbstractRuns,
        rest: Geometry,
        derivatives: str,
        trials: np.ndarray,
        bounds: tuple[np.ndarray, np.ndarray],
    ):
        self.runs, self.rest, self.control = runs, rest, StepControl()
        self._derivatives, self._trials, self._bounds = derivatives, trials, bounds
        self.found: dict[str, Slope] = {}
        given = runs.given
        self.input_trial = 1.0 if given is None else INPUT_TRIAL * _extent(given)
        self._points: Memory[np.ndarray] = Memory(np.size)
        self._columns: Memory[dict[int, np.ndarray]] = Memory(
            lambda c: sum(map(np.size, c.values()))
        )
        self._along: Memory[np.ndarray] = Memory(np.size)

    def points(self, numbers: np.ndarray, points: np.ndarray | None) -> np.ndarray:
        """Where the points are."""
        kept = self._points.kept(_key(numbers, points))
        if kept is not None:
            return kept
        (found,) = self.runs.points([Place(numbers, points)], ["these values"], self.rest)
        return self._points.keep(_key(numbers, points), found)

    def motions(
        self, numbers: np.ndarray, points: np.ndarray | None, changes: Sequence[Change]
    ) -> list[np.ndarray]:
        """How points move for each of several changes; runs go on at the same time."""
        if self._derivatives == "complex":
            return self._by_complex_step(numbers, points, changes)
        turned = np.any([change.numbers != 0 for change in changes], axis=0)
        needed = np.flatnonzero(turned)
        moves = {
            k: change.points
            for k, change in enumerate(changes)
            if change.points is not None and change.points.any()
        }
        columns, along = self._slopes(numbers, points, needed.tolist(), moves)
        found = []
        for k, change in enumerate(changes):
            motion = np.zeros(self.rest.points.shape)
            for j in np.flatnonzero(change.numbers).tolist():
                motion += change.numbers[j] * columns[j]
            found.append(motion + along[k] if k in along else motion)
        return found

    def gradient(
        self, numbers: np.ndarray, points: np.ndarray | None, cotangent: np.ndarray
    ) -> np.ndarray:
        """Derivatives by all parameters of a scalar, from those by the points."""
        rows = np.eye(len(numbers))
        motions = self.motions(numbers, points, [Change(row, None) for row in rows])
        return np.array([np.sum(motion * cotangent) for motion in motions])

    def _slopes(
        self,
        numbers: np.ndarray,
        points: np.ndarray | None,
        needed: Sequence[int],
        moves: dict[int, np.ndarray],
    ) -> tuple[dict[int, np.ndarray], dict[int, Any]]:
        """Columns of parameters, and derivatives along motions of the file in."""
        key = _key(numbers, points)
        columns = self._columns.kept(key)
        if columns is None:
            columns = self._columns.keep(key, {})
        new = [j for j in needed if j not in columns]
        if new and self._derivatives == "linearised":
            read = self.runs.linearised(Place(numbers, points), self.rest)
            columns |= {j: read[label] for j, label in enumerate(self.runs.labels)}
            new = []
        lines = [self._line(j, numbers) for j in new]
        sizes = {k: float(np.abs(motion).max()) for k, motion in moves.items()}
        keys = {k: hashlib.sha256(key + motion.tobytes()).digest() for k, motion in moves.items()}
        along = {k: self._along.kept(keys[k]) for k in moves}
        fresh = [k for k in moves if along[k] is None]
        lines += [
            Line(f"motion {k}", moves[k] / sizes[k], self.input_trial, group=FILE_IN) for k in fresh
        ]
        if not lines:
            return columns, along
        start = self.points(numbers, points)
        slopes = self.control.slopes(
            lambda probes: self._probed(numbers, points, probes), start, lines
        )
        self._tell(lines, slopes)
        columns |= {j: slope.column for j, slope in zip(new, slopes, strict=False)}
        for k, slope in zip(fresh, slopes[len(new) :], strict=True):
            along[k] = self._along.keep(keys[k], sizes[k] * slope.column)
        return columns, along

    def _line(self, j: int, numbers: np.ndarray) -> Line:
        low, high = self._bounds[0][j], self._bounds[1][j]
        below, above = max(numbers[j] - low, 0.0), max(high - numbers[j], 0.0)
        return Line(self.runs.labels[j], j, float(self._trials[j]), below, above)

    def _probed(
        self, numbers: np.ndarray, points: np.ndarray | None, probes: Sequence[Probe]
    ) -> list[np.ndarray]:
        """Points at places of differences."""
        places, names = [], []
        for line, offset in probes:
            moved, shifted = numbers.copy(), points
            if isinstance(line.direction, int):
                moved[line.direction] += offset
                self.runs.check_seen(numbers, moved, line.name)
            else:
                assert points is not None
                shifted = points + offset * line.direction
            places.append(Place(moved, shifted))
            names.append(f"{line.name} {'+' if offset > 0 else '-'} {abs(offset):.3g}")
        return self.runs.points(places, names, self.rest)

    def _tell(self, lines: Sequence[Line], slopes: Sequence[Slope]) -> None:
        for line, slope in zip(lines, slopes, strict=True):
            self.found[line.known_as] = slope
            told = f"{line.known_as}: step {slope.step:.3g}, error about {slope.error:.2g}"
            log.info("differences by %s", told)

    def _by_complex_step(
        self, numbers: np.ndarray, points: np.ndarray | None, changes: Sequence[Change]
    ) -> list[np.ndarray]:
        found: dict[int, np.ndarray] = {}
        places, sizes = {}, {}
        for k, change in enumerate(changes):
            moves = change.points if _moves(change.points) else None
            parts = [change.numbers] if moves is None else [change.numbers, moves]
            size = max(float(np.abs(part).max(initial=0.0)) for part in parts)
            if size == 0.0:
                found[k] = np.zeros(self.rest.points.shape)
                continue
            step = COMPLEX_STEP / size
            sizes[k] = step
            parted = None if moves is None else step * moves
            places[k] = Place(numbers, points, step * change.numbers, parted)
        if places:
            names = [f"imaginary parts of direction {k}" for k in places]
            imaginary = self.runs.imaginary(list(places.values()), names, self.rest)
            found |= {k: part / sizes[k] for k, part in zip(places, imaginary, strict=True)}
        return [found[k] for k in range(len(changes))]


def _key(numbers: np.ndarray, points: np.ndarray | None) -> bytes:
    return numbers.tobytes() + (b"" if points is None else points.tobytes())


def _moves(points: np.ndarray | None) -> bool:
    return points is not None and bool(np.any(points))


def _extent(geometry: Geometry) -> float:
    return float(np.ptp(np.asarray(geometry.points), axis=0).max()) or 1.0
