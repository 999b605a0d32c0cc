"""Symbolic expressions such as `CD + 10*(1 - CL/0.56)^2`, with exact derivatives."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import ParameterError
from .operations import OPERATIONS
from .syntax import Step, refuse, steps


@dataclass(frozen=True)
class Expression:
    """An expression that has been read.

    Attributes
    ----------
    text
        As it was written.
    steps
        What it does, in order.
    """

    text: str
    steps: tuple[Step, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The names in it, each once, in their order."""
        return tuple(dict.fromkeys(step.name for step in self.steps if step.what == "name"))

    def column(self, name: str) -> int:
        """Where a name stands first, counted from 1."""
        return next(step.column for step in self.steps if step.name == name)

    def value(self, values: Mapping[str, float]) -> float:
        """Its value, with those of its names given."""
        return self._results(values)[-1]

    def gradient(self, values: Mapping[str, float]) -> dict[str, float]:
        """Its derivative by each of its names."""
        return self.value_and_gradient(values)[1]

    def value_and_gradient(self, values: Mapping[str, float]) -> tuple[float, dict[str, float]]:
        """Both; the derivatives are those of the chain rule, from the last step to the first."""
        results = self._results(values)
        varies = self._varies()
        weights = [0.0] * len(results)
        weights[-1] = 1.0
        gradient = dict.fromkeys(self.names, 0.0)
        for i in reversed(range(len(results))):
            step, weight = self.steps[i], weights[i]
            if step.what == "name":
                gradient[step.name] += weight
            elif step.of and weight and varies[i]:
                slopes = self._slopes(i, results, varies)
                for part, slope in zip(step.of, slopes, strict=True):
                    if varies[part] and slope:  # what does not vary may have no finite slope
                        weights[part] += weight * slope
        for name, slope in gradient.items():
            if not math.isfinite(slope):
                refuse(self.text, self.column(name), f"the derivative by {name} is not finite")
        return results[-1], gradient

    def _results(self, values: Mapping[str, float]) -> list[float]:
        results: list[float] = []
        for step in self.steps:
            if step.what == "number":
                result = step.number
            elif step.what == "name":
                if step.name not in values:
                    refuse(self.text, step.column, f"{step.name!r} has no value")
                result = float(values[step.name])
            else:
                try:
                    result = OPERATIONS[step.what].value([results[i] for i in step.of])
                except OverflowError:
                    result = math.inf
                except ValueError as problem:
                    refuse(self.text, step.column, str(problem))
            if not math.isfinite(result):
                what = f"{step.name!r} is {result}" if step.name else "the result is too large"
                refuse(self.text, step.column, f"{what}, expected a finite number")
            results.append(result)
        return results

    def _varies(self) -> list[bool]:
        varies: list[bool] = []
        for step in self.steps:
            varies.append(step.what == "name" or any(varies[i] for i in step.of))
        return varies

    def _slopes(self, place: int, results: list[float], varies: list[bool]) -> list[float]:
        step = self.steps[place]
        try:
            return list(
                OPERATIONS[step.what].slopes(
                    [results[i] for i in step.of], results[place], [varies[i] for i in step.of]
                )
            )
        except (OverflowError, ZeroDivisionError):
            refuse(self.text, step.column, "the derivative is too large")
        except ValueError as problem:
            refuse(self.text, step.column, str(problem))


def parsed(text: str) -> Expression:
    """Read an expression; what cannot be read is refused with its column.

    Numbers, names, `+ - * / ^`, parentheses, and exp log sqrt sin cos tan abs min max. `^` binds
    strongest and from the right, then a sign before a value, then `* /`, then `+ -`.
    """
    if not text.strip():
        raise ParameterError("the expression is empty; write one such as CD + 10*(1 - CL/0.56)^2")
    return Expression(text, steps(text))
