"""The area that an airfoil encloses."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int
from typing_extensions import override

from .._types import Points, Vector
from ..mesh import Geometry
from .base import AbstractMeasure
from .needs import section_of


class SectionArea(AbstractMeasure):
    """Area within a loop of points in the x-y plane [m2], by the shoelace formula.

    The last point is joined to the first. Positive where the loop runs counter-clockwise, seen from
    +z.

    Attributes
    ----------
    start, end
        Ends of the sides, counted among the points read.
    """

    reads: np.ndarray
    start: Int[np.ndarray, "s"]
    end: Int[np.ndarray, "s"]

    def __init__(self, loop: Sequence[int] | Int[np.ndarray, "s"]):
        self.reads, self.start = np.unique(np.asarray(loop, int), return_inverse=True)
        self.end = np.roll(self.start, -1)

    @classmethod
    @override
    def build(cls, geometry: Geometry) -> "SectionArea":
        """Of a section, positive whichever way it runs."""
        section = section_of(geometry, "a section's area")
        loop = np.arange(len(section.points))
        turned = float(cls(loop)(section.points)[0]) < 0
        return cls(loop[::-1] if turned else loop)

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        flat = places[:, :2] - places[0, :2]  # or digits would cancel
        (x, y), (u, v) = flat[self.start].T, flat[self.end].T
        return 0.5 * jnp.sum(x * v - u * y)[None]
