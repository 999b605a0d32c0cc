"""How much of what a function returns is noise."""

import math

import numpy as np
from jaxtyping import Float

from .._types import Array

PROBES = 6
"""Evaluations beside the first that noise is measured from."""


def noise_level(values: Float[Array, "probes n"]) -> float:
    """Standard deviation of the noise in values at evenly spaced, close places.

    Differences of order k of a smooth function vanish with the spacing, those of noise of deviation
    s are of the size s √((2k)!/k!²), whatever the spacing; the least over k is taken, over all the
    values that change. It is at least the rounding of the largest.

    Source: Moré and Wild, Estimating computational noise, SIAM J. Sci. Comput. 33 (3), 2011.
    """
    table = np.asarray(values, float)
    largest = float(np.abs(table).max(initial=0.0))
    least = float(np.finfo(float).eps) * largest
    table = table[:, np.ptp(table, axis=0) > 0]
    if not table.size:
        return least
    levels = []
    for order in range(1, len(table)):
        table = np.diff(table, axis=0)
        factor = math.factorial(order) ** 2 / math.factorial(2 * order)
        levels.append(math.sqrt(factor * float(np.mean(table**2))))
    return max(least, min(levels))
