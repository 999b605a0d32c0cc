"""Numbers of variables that bring points where they are wanted, within bounds."""

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import scipy.sparse

from .._types import Array
from ..parameters.variable import Variable

STAY = 1e-4
"""Weight of points that are to stay, beside those that are to move: these come first."""

SLIGHT = 2e-7
"""Points that are asked to move by less than this part of their distance from the origin are not
asked: a hand that works in single precision moves them so far unasked."""

MOST_STEPS = 20
SETTLED = 1e-13
"""Of a step of the typical changes, relative to the largest so far."""

MOST_KEPT = 16
"""Inverses, one for each choice of points and of numbers that are free."""


class Reach:
    """The numbers of some variables, one after the other, and their bounds, in designers' units."""

    def __init__(self, variables: Sequence[Variable]):
        self.variables = tuple(variables)
        self.lower = _joined([v.lower for v in variables])
        self.upper = _joined([v.upper for v in variables])
        self.typical = _joined([[v.typical] * v.size for v in variables])
        self.labels = [label for v in variables for label in v.labels()]
        self._kept: OrderedDict[bytes, np.ndarray] = OrderedDict()
        self._is_separate: bool | None = None

    def numbers(self, values: Mapping[str, Array]) -> np.ndarray:
        """Their numbers among the values."""
        return _joined([values[v.name] for v in self.variables])

    def named(self, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Values by name, within bounds to the bit."""
        ends = np.cumsum([0, *(v.size for v in self.variables)])
        return {v.name: numbers[ends[i] : ends[i + 1]] for i, v in enumerate(self.variables)}

    def at_bounds(self, numbers: np.ndarray, wish: np.ndarray) -> list[str]:
        """Labels of those that are held at a bound although the wish goes on."""
        is_held = (wish < 0) & (numbers <= self.lower) | (wish > 0) & (numbers >= self.upper)
        return [self.labels[i] for i in np.flatnonzero(is_held)]

    def step(
        self,
        slopes: scipy.sparse.csc_array,
        gaps: np.ndarray,
        weights: np.ndarray,
        numbers: np.ndarray,
        is_fixed: bool,
    ) -> tuple[np.ndarray, np.ndarray]:
        """The least change that closes the gaps, (p, 3), within bounds; and what it would be.

        `weights` are one for each point. With `is_fixed` the slopes are always the same.
        """
        low, high = self.lower - numbers, self.upper - numbers
        rows = np.repeat(weights, 3)
        scaled = slopes * self.typical
        if is_fixed and self._separate(slopes):
            squares = slopes.power(2).T @ rows**2
            wish = (slopes.T @ (rows**2 * gaps.ravel())) / np.where(squares > 0, squares, 1.0)
            return np.clip(wish, low, high), wish
        dense = scaled.toarray() * rows[:, None]
        wanted = rows * gaps.ravel()
        key = weights.tobytes() if is_fixed else None
        free = np.ones(len(numbers), bool)
        change, first = np.zeros(len(numbers)), np.zeros(len(numbers))
        for turn in range(len(numbers) + 1):
            left = wanted - dense @ (change / self.typical * ~free)
            own = self.typical * self._solved(dense, free, left, key)
            first = own if turn == 0 else first
            change = np.where(free, own, change)
            beyond = free & ((change < low) | (change > high))
            change = np.clip(change, low, high)
            if not beyond.any():
                break
            free &= ~beyond
        return change, first

    def _solved(
        self, dense: np.ndarray, free: np.ndarray, wanted: np.ndarray, key: bytes | None
    ) -> np.ndarray:
        """Least numbers that close what is wanted, zero for those that are not free."""
        found = np.zeros(len(free))
        if key is None:
            found[free] = np.linalg.lstsq(dense[:, free], wanted, rcond=1e-12)[0]
            return found
        key += free.tobytes()
        if key not in self._kept:
            self._kept[key] = np.linalg.pinv(dense[:, free], rcond=1e-12)
            while len(self._kept) > MOST_KEPT:
                self._kept.popitem(last=False)
        found[free] = self._kept[key] @ wanted
        return found

    def _separate(self, slopes: scipy.sparse.csc_array) -> bool:
        """Whether each number moves points by itself, whatever weights these have."""
        if self._is_separate is None:
            rng = np.random.default_rng(0)
            weights = np.repeat(rng.uniform(0.5, 1.5, slopes.shape[0] // 3), 3)
            products = (slopes.T @ (slopes * weights[:, None])).tocoo()
            sizes = np.sqrt(products.diagonal())
            scale = sizes[products.row] * sizes[products.col]
            is_off = products.row != products.col
            self._is_separate = bool(np.all(np.abs(products.data[is_off]) <= 1e-12 * scale[is_off]))
        return self._is_separate


def fitted(
    reach: Reach,
    start: np.ndarray,
    moved: np.ndarray,
    touched: np.ndarray | None,
    places: Callable[[np.ndarray], np.ndarray],
    slopes: Callable[[np.ndarray], scipy.sparse.csc_array],
    is_fixed: bool,
) -> tuple[np.ndarray, float, list[str]]:
    """Numbers from a start that bring points where they are wanted, how far off, and what is held.

    `touched` points come first, the others stay where the start has them as far as they can.
    Without it those are touched that are wanted elsewhere. Gauss and Newton's method, steps halved
    where they do not help.
    """
    numbers, here = np.clip(start, reach.lower, reach.upper), places(start)
    if is_fixed:  # then no more places need be asked for
        fixed, first, begin = slopes(start), here, start
        slopes, places = lambda x: fixed, lambda x: first + _apart(fixed @ (x - begin))
    if touched is None:
        far = np.linalg.norm(moved - here, axis=1)
        touched = far > SLIGHT * np.abs(moved).max(initial=0.0)
    else:
        moved = np.where(touched[:, None], moved, here)
    weights = np.where(touched, 1.0, STAY) if touched.any() else np.ones(len(moved))
    wish = np.zeros(len(numbers))
    if len(numbers):
        numbers, wish = _descended(reach, numbers, moved, weights, places, slopes, is_fixed)
    far = np.linalg.norm(moved - places(numbers), axis=1)
    chosen = far[touched] if touched.any() else far
    return numbers, float(chosen.max(initial=0.0)), reach.at_bounds(numbers, wish)


def _descended(
    reach: Reach,
    numbers: np.ndarray,
    moved: np.ndarray,
    weights: np.ndarray,
    places: Callable[[np.ndarray], np.ndarray],
    slopes: Callable[[np.ndarray], scipy.sparse.csc_array],
    is_fixed: bool,
) -> tuple[np.ndarray, np.ndarray]:
    gaps = moved - places(numbers)
    wish, longest = np.zeros(len(numbers)), 0.0
    for _ in range(1 if is_fixed else MOST_STEPS):
        change, wish = reach.step(slopes(numbers), gaps, weights, numbers, is_fixed)
        size = float(np.abs(change / reach.typical).max(initial=0.0))
        longest = max(longest, size)
        if size <= SETTLED * longest or size == 0:
            break
        before = np.linalg.norm(weights[:, None] * gaps)
        for part in (1.0, 0.5, 0.25, 0.125, 1 / 64):
            trial = np.clip(numbers + part * change, reach.lower, reach.upper)
            there = moved - places(trial)
            if is_fixed or np.linalg.norm(weights[:, None] * there) < before:
                break
        else:
            break
        numbers, gaps = trial, there
    return numbers, wish


def _apart(coordinates: np.ndarray) -> np.ndarray:
    return coordinates.reshape(-1, 3)


def _joined(parts: Sequence[Sequence[float] | Array]) -> np.ndarray:
    return np.concatenate([np.zeros(0), *(np.asarray(part, float) for part in parts)])
