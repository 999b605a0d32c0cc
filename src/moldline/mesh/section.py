"""A section: one airfoil polyline in the x-y plane."""

import equinox as eqx
import numpy as np

from .._types import Array, ArrayLike, Points
from ..errors import GeometryError
from .surface import as_points


class Section(eqx.Module):
    """Points along one curve, z = 0; an airfoil runs from its trailing edge over the top side.

    Attributes
    ----------
    points
        Along the curve; the last one is joined to the first where `is_closed`.
    name
        What the file calls it.
    is_closed
        Whether a segment joins the last point to the first.
    """

    points: Points
    name: str = eqx.field(static=True)
    is_closed: bool = eqx.field(static=True)

    def __init__(self, points: ArrayLike, name: str = "section", is_closed: bool = False):
        self.points = as_points(points)
        self.name = name
        self.is_closed = is_closed

    def __check_init__(self) -> None:
        if len(self.points) < 2:
            raise GeometryError(f"a section needs at least 2 points, got {len(self.points)}")

    def moved(self, points: Array) -> "Section":
        """The same curve through other points."""
        return eqx.tree_at(lambda s: s.points, self, points)

    @property
    def segments(self) -> np.ndarray:
        """Pairs of joined points, shape (s, 2)."""
        start = np.arange(len(self.points) - (not self.is_closed))
        return np.stack([start, (start + 1) % len(self.points)], axis=1)
