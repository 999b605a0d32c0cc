"""A cloud: points that nothing joins."""

import equinox as eqx

from .._types import Array, ArrayLike, Points
from .surface import as_points


class Cloud(eqx.Module):
    """Points without connectivity, such as a structural model's or a solver's own."""

    points: Points

    def __init__(self, points: ArrayLike):
        self.points = as_points(points)

    def moved(self, points: Array) -> "Cloud":
        """A cloud of other points."""
        return Cloud(points)
