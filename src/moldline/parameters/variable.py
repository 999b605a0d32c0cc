"""Variables: the named, bounded numbers a designer owns."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._types import Array, is_concrete
from ..errors import ParameterError

UNITS = {
    "": 1.0, "m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048,
    "rad": 1.0, "deg": math.pi / 180, "%": 0.01,
}  # fmt: skip
"""What one unit is inside moldline (SI and radians)."""


MOST = 2**20
"""Numbers of one variable; more are a slip of the pen."""


@dataclass(frozen=True, order=True)
class Variable:
    """One name for one or several numbers, in the designer's own unit.

    Attributes
    ----------
    name
        Unique in a pipeline.
    value, lower, upper
        Present values and bounds, one per number, in `unit`.
    typical
        A change that matters, in `unit`: what steps and optimisers are scaled by.
    unit
        One of `UNITS`; values are converted to SI and radians where a stage takes them.
    """

    name: str
    value: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    typical: float
    unit: str = ""

    @property
    def size(self) -> int:
        """How many numbers it has."""
        return len(self.value)

    @property
    def factor(self) -> float:
        """Its unit in SI."""
        return UNITS[self.unit]

    def labels(self) -> list[str]:
        """A name for each number: t for one, t[0] t[1] ... for several."""
        return [self.name] if self.size == 1 else [f"{self.name}[{i}]" for i in range(self.size)]

    def checked(self, value: Array) -> Array:
        """The value as a vector of the right length, finite where it can be looked at."""
        array = value if not is_concrete(value) else np.asarray(value, float)
        array = array.reshape(1) if array.ndim == 0 else array
        if array.shape != (self.size,):
            raise ParameterError(
                f"variable {self.name!r} has {self.size} numbers, got shape {array.shape}"
            )
        if is_concrete(value) and not np.all(np.isfinite(array)):
            raise ParameterError(f"variable {self.name!r} must be finite, got {array}")
        return array

    def outside(self, value: Array) -> list[str]:
        """A sentence for each number outside its bounds."""
        rows = zip(self.labels(), np.asarray(value), self.lower, self.upper, strict=True)
        return [
            f"{label} = {x:g} is outside [{low:g}, {high:g}] {self.unit}".rstrip()
            for label, x, low, high in rows
            if not low <= x <= high
        ]


def variable(
    name: str,
    size: int | None = None,
    value: float | Sequence[float] | Array = 0.0,
    bounds: tuple[float, float] | Sequence[tuple[float, float]] | Array = (-math.inf, math.inf),
    typical: float | None = None,
    unit: str = "",
) -> Variable:
    """A variable of `size` numbers; one value and one pair of bounds serve all of them.

    Without `typical`, a tenth of the narrowest bounds serves, or 1 where there are none.
    """
    if not name or not name.isidentifier():
        raise ParameterError(f"a variable's name is a word without spaces, got {name!r}")
    if unit not in UNITS:
        raise ParameterError(f"variable {name!r}: unit {unit!r} is none of {', '.join(UNITS)}")
    number = size if size is not None else np.atleast_1d(np.asarray(value, float)).size
    if number > MOST:
        raise ParameterError(f"variable {name!r}: size {number} is more than {MOST}; give fewer")
    if not np.isfinite(np.asarray(value, float)).all():
        raise ParameterError(f"variable {name!r}: its value must be finite, got {value}")
    pairs = np.asarray(bounds, float)
    try:
        values = np.broadcast_to(np.asarray(value, float), number)
        lower, upper = np.broadcast_to(pairs.reshape(-1, 2), (number, 2)).T
    except ValueError:
        raise ParameterError(
            f"variable {name!r} of size {number} takes one value and one pair of bounds, or "
            f"{number} of each; got value {value} and bounds {bounds}"
        ) from None
    if number < 1 or np.any(lower > upper) or np.isnan(pairs).any():
        raise ParameterError(
            f"variable {name!r}: size {number} and bounds {bounds} leave no choice; "
            f"give (lower, upper)"
        )
    if typical is None:
        span = float(np.min(upper - lower))
        typical = span / 10 if 0 < span < math.inf else 1.0
    if not 0 < typical < math.inf:
        raise ParameterError(f"variable {name!r}: typical must be above 0, got {typical}")
    return Variable(name, _floats(values), _floats(lower), _floats(upper), float(typical), unit)


def _floats(array: np.ndarray) -> tuple[float, ...]:
    return tuple(map(float, array))
