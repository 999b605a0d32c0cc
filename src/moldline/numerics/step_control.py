"""Derivatives of what can only be evaluated: differences whose steps suit its noise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .._types import Array
from .noise import PROBES, noise_level

SPACING = 1e-4
"""Places that noise is measured at are this part of the trial step apart."""

SMALLEST = 1e-7
"""No step is a smaller part of the trial step."""

NEAR = 0.7
"""A trial step that is this part of the best one, or more, is good enough."""


@dataclass(frozen=True)
class Line:
    """A direction to differentiate along.

    Attributes
    ----------
    name
        By which what was measured along it is known again.
    direction
        For whoever evaluates.
    trial
        A step along it that matters, in units of the direction.
    below, above
        How far it may go back and on.
    group
        Lines of one group share what is measured along the first of them.
    """

    name: str
    direction: Any
    trial: float
    below: float = float("inf")
    above: float = float("inf")
    group: str = ""

    @property
    def known_as(self) -> str:
        """What is measured along it is kept by this."""
        return self.group or self.name


class Probe(NamedTuple):
    """A place to evaluate at: so far along a line."""

    line: Line
    offset: float


@dataclass(frozen=True)
class Slope:
    """A derivative, the step it was taken with, and about how wrong its worst number is."""

    column: np.ndarray
    step: float
    error: float


Evaluate = Callable[[Sequence[Probe]], Sequence[np.ndarray]]
"""Values at several places, which may be found at the same time."""


class _Rule(NamedTuple):
    """Differences: where, in steps, and what each value counts; the first value is that at 0."""

    offsets: tuple[int, ...]
    slope: tuple[float, ...]
    trials: tuple[int, ...]
    third: tuple[float, ...]
    truncation: float


_CENTRAL = _Rule((-1, 1), (0, -0.5, 0.5), (-2, -1, 1, 2), (0, -0.5, 1, -1, 0.5), 1 / 6)
_ONWARD = _Rule((1, 2), (-1.5, 2, -0.5), (1, 2, 3), (-1, 3, -3, 1), 1 / 3)


class StepControl:
    """Takes differences, and remembers what it found out about noise and steps.

    At first, noise is measured (`PROBES` evaluations) and, for each line, the third derivative by
    its trial step; from both the step of least error. Later each derivative takes two evaluations.
    Where there is no room on one side, differences are of the other, to second order too.

    Attributes
    ----------
    noise
        Standard deviation of the noise; None before it is measured.
    is_fixed
        Whether steps are the trial steps, as they are, and nothing is measured.
    least
        What the noise is at least, for whoever knows how values are rounded.
    """

    def __init__(self, is_fixed: bool = False, least: float = 0.0):
        self.noise: float | None = None
        self.is_fixed = is_fixed
        self.least = least
        self._known: dict[str, tuple[float, float]] = {}

    def slopes(self, evaluate: Evaluate, start: Array, lines: Sequence[Line]) -> list[Slope]:
        """Derivatives along lines; `start` is the value where they begin."""
        origin = np.asarray(start, float)
        new: dict[str, Line] = {}
        for line in lines:
            if line.known_as not in self._known and not self.is_fixed:
                new.setdefault(line.known_as, line)
        done = self._measure(evaluate, origin, list(new.values())) if new else {}
        rest = [line for line in lines if line.name not in done]
        probes = [
            Probe(line, offset * self._step(line))
            for line in rest
            for offset in _signed(line, _rule(line).offsets)
        ]
        values = iter(evaluate(probes) if probes else ())
        for line in rest:
            own = [origin, *(next(values) for _ in _rule(line).offsets)]
            step = self._step(line)
            done[line.name] = self._slope(line, own, step)
        return [done[line.name] for line in lines]

    def _measure(
        self, evaluate: Evaluate, origin: np.ndarray, lines: Sequence[Line]
    ) -> dict[str, Slope]:
        """Choose steps; the derivatives of those lines whose trial steps are good enough."""
        probes = []
        if self.noise is None:
            away = _signed(lines[0], range(1, PROBES + 1))
            probes += [Probe(lines[0], k * SPACING * lines[0].trial) for k in away]
        count = len(probes)
        for line in lines:
            size = _trial(line)
            probes += [Probe(line, k * size) for k in _signed(line, _rule(line).trials)]
        values = list(evaluate(probes))
        if self.noise is None:
            near_by = np.stack([origin, *values[:count]]).reshape(count + 1, -1)
            self.noise = max(noise_level(near_by), self.least)
        found, rest = {}, iter(values[count:])
        for line in lines:
            rule, size = _rule(line), _trial(line)
            own = [origin, *(next(rest) for _ in rule.trials)]
            third = np.abs(_weighted(rule.third, own)).max(initial=0.0) / size**3
            third = max(third, 2 * self.noise / size**3, np.finfo(float).tiny)
            # 2 noise / step + truncation third step² is least here
            best = (self.noise / (rule.truncation * third)) ** (1 / 3)
            step = float(np.clip(best, SMALLEST * size, size))
            is_near = step >= NEAR * size
            self._known[line.known_as] = (size if is_near else step, float(third))
            if is_near:
                near = dict(zip((0, *rule.trials), own, strict=True))
                own = [near[k] for k in (0, *rule.offsets)]
                found[line.name] = self._slope(line, own, size)
        return found

    def _slope(self, line: Line, values: Sequence[np.ndarray], step: float) -> Slope:
        rule = _rule(line)
        sign = 1.0 if rule is _CENTRAL or line.above >= line.below else -1.0
        column = sign * _weighted(rule.slope, values) / step
        if self.noise is None or line.known_as not in self._known:
            return Slope(column, step, float("nan"))
        third = self._known[line.known_as][1]
        return Slope(column, step, 2 * self.noise / step + rule.truncation * third * step**2)

    def _step(self, line: Line) -> float:
        return min(self._known.get(line.known_as, (np.inf, 0.0))[0], _trial(line))


def _rule(line: Line) -> _Rule:
    """One-sided where there is no room for a part of the trial step on one side."""
    return _CENTRAL if min(line.below, line.above) >= 1e-3 * line.trial else _ONWARD


def _trial(line: Line) -> float:
    """The trial step, or less where there is little room."""
    if _rule(line) is _CENTRAL:
        return min(line.trial, line.below / 2, line.above / 2)
    return min(line.trial, max(line.below, line.above) / 3)


def _signed(line: Line, offsets: Sequence[int]) -> list[int]:
    sign = 1 if _rule(line) is _CENTRAL or line.above >= line.below else -1
    return [sign * offset for offset in offsets]


def _weighted(weights: Sequence[float], values: Sequence[np.ndarray]) -> np.ndarray:
    total = np.zeros_like(values[0], dtype=float)
    for weight, value in zip(weights, values, strict=True):
        total += weight * value
    return total
