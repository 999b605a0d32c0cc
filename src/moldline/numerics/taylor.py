"""Proof of a derivative by the order of its Taylor remainder."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np

STEPS = tuple(2.0**-k for k in range(8))


class Remainder(NamedTuple):
    """How what is left after the linear term falls with the step.

    `order` is 2 for a right derivative of a curved function; a function that is linear leaves
    only rounding, told by `is_linear`, and has no order.
    """

    steps: tuple[float, ...]
    sizes: tuple[float, ...]
    order: float
    is_linear: bool

    @property
    def is_right(self) -> bool:
        """Whether the derivative is proved."""
        return self.is_linear or abs(self.order - 2) < 0.1


def remainder(f: Callable[[Any], Any], at: Any, along: Any, accuracy: float = 0.0) -> Remainder:
    """Taylor remainder |f(x + h d) - f(x) - h f'(x) d| for falling steps h.

    `at` and `along` are arrays or dictionaries of arrays; f gives one array. The order is the slope
    between the two smallest steps whose remainders stand clear of rounding, and of the relative
    `accuracy` of a derivative that is known not to be exact.
    """
    value, slope = jax.jvp(f, (at,), (along,))
    value, slope = np.asarray(value), np.asarray(slope)
    sizes = []
    for h in STEPS:
        there = f(jax.tree.map(lambda x, d, h=h: x + h * d, at, along))
        sizes.append(float(np.linalg.norm(np.asarray(there) - value - h * slope)))
    # rounding of the values, and of the slope that is multiplied out
    noise = 64 * np.finfo(float).eps * (np.linalg.norm(value) + np.linalg.norm(slope))
    noise += accuracy * np.linalg.norm(slope)
    clear = [k for k, size in enumerate(sizes) if size > 1e3 * noise]
    if sizes[0] <= noise:
        return Remainder(STEPS, tuple(sizes), float("nan"), True)
    last = clear[-1] if len(clear) > 1 else 1
    order = float(np.log2(sizes[last - 1] / max(sizes[last], 1e-300)))
    return Remainder(STEPS, tuple(sizes), order, False)
