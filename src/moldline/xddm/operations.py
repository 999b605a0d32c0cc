"""What expressions can do: values, and slopes by what they are made of."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

FUNCTIONS = {
    **dict.fromkeys(("exp", "log", "sqrt", "sin", "cos", "tan", "abs"), (1, 1)),
    **dict.fromkeys(("min", "max"), (2, 1000)),
}
"""Least and most values that each takes."""

Numbers: TypeAlias = Sequence[float]


class Operation(NamedTuple):
    """A value, and its derivatives by each of what it is made of.

    `slopes` gets the values, the result, and which of them vary: a slope that does not exist is
    no error where nothing varies. Both raise ValueError where there is none.
    """

    value: Callable[[Numbers], float]
    slopes: Callable[[Numbers, float, Sequence[bool]], Numbers]


def _ratio(of: Numbers) -> float:
    if of[1] == 0.0:
        raise ValueError("division by zero")
    return of[0] / of[1]


def _ratio_slopes(of: Numbers, result: float, varies: Sequence[bool]) -> Numbers:
    return 1.0 / of[1], -result / of[1]


def _power(of: Numbers) -> float:
    base, exponent = of
    if base == 0.0 and exponent < 0.0:
        raise ValueError(f"division by zero: 0 to the power {exponent:g}")
    if base < 0.0 and exponent != math.floor(exponent):
        raise ValueError(f"{base:g} to the power {exponent:g} is no real number")
    return float(base**exponent)


def _power_slopes(of: Numbers, result: float, varies: Sequence[bool]) -> Numbers:
    base, exponent = of
    by_base = by_exponent = 0.0
    if varies[0] and exponent != 0.0:
        if base == 0.0 and exponent < 1.0:
            raise ValueError(f"0 to the power {exponent:g} has no finite slope there")
        by_base = exponent * base ** (exponent - 1.0)
    if varies[1]:
        if base < 0.0:
            raise ValueError(f"{base:g} to a power that varies has no slope")
        if base == 0.0 and exponent == 0.0:
            raise ValueError("0 to the power 0 has no slope by the power")
        by_exponent = result * math.log(base) if base > 0.0 else 0.0
    return by_base, by_exponent


def _log(of: Numbers) -> float:
    if of[0] <= 0.0:
        raise ValueError(f"the logarithm of {of[0]:g}, which is not above zero")
    return math.log(of[0])


def _root(of: Numbers) -> float:
    if of[0] < 0.0:
        raise ValueError(f"the square root of {of[0]:g}, which is below zero")
    return math.sqrt(of[0])


def _root_slopes(of: Numbers, result: float, varies: Sequence[bool]) -> Numbers:
    if result == 0.0:
        raise ValueError("the square root has no finite slope at zero")
    return (0.5 / result,)


def _first_slopes(of: Numbers, result: float, varies: Sequence[bool]) -> Numbers:
    chosen = list(of).index(result)  # of equal ones the first, as at a kink any will do
    return [float(i == chosen) for i in range(len(of))]


OPERATIONS = {
    "+": Operation(lambda of: of[0] + of[1], lambda of, result, varies: (1.0, 1.0)),
    "-": Operation(lambda of: of[0] - of[1], lambda of, result, varies: (1.0, -1.0)),
    "*": Operation(lambda of: of[0] * of[1], lambda of, result, varies: (of[1], of[0])),
    "/": Operation(_ratio, _ratio_slopes),
    "^": Operation(_power, _power_slopes),
    "neg": Operation(lambda of: -of[0], lambda of, result, varies: (-1.0,)),
    "exp": Operation(lambda of: math.exp(of[0]), lambda of, result, varies: (result,)),
    "log": Operation(_log, lambda of, result, varies: (1.0 / of[0],)),
    "sqrt": Operation(_root, _root_slopes),
    "sin": Operation(lambda of: math.sin(of[0]), lambda of, r, varies: (math.cos(of[0]),)),
    "cos": Operation(lambda of: math.cos(of[0]), lambda of, r, varies: (-math.sin(of[0]),)),
    "tan": Operation(lambda of: math.tan(of[0]), lambda of, r, varies: (1.0 + r * r,)),
    "abs": Operation(
        lambda of: abs(of[0]),
        lambda of, r, varies: (math.copysign(1.0, of[0]) if of[0] else 0.0,),
    ),
    "min": Operation(lambda of: min(of), _first_slopes),
    "max": Operation(lambda of: max(of), _first_slopes),
}
"""By sign or name; `neg` is a minus before one value."""
