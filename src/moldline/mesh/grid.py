"""Patched structured grids: surface patches, or control boxes."""

import equinox as eqx
import numpy as np

from .._types import Array, ArrayLike, Points
from ..errors import GeometryError
from .surface import as_points


class Grid(eqx.Module):
    """Structured blocks, one after the other in one array of points.

    Attributes
    ----------
    points
        All blocks' points; within a block the first index runs fastest, as PLOT3D has it.
    shapes
        Points (ni, nj, nk) of each block; nk = 1 is a surface patch.
    """

    points: Points
    shapes: tuple[tuple[int, int, int], ...] = eqx.field(static=True)

    def __init__(self, points: ArrayLike, shapes: tuple[tuple[int, int, int], ...]):
        self.points = as_points(points)
        self.shapes = tuple((int(i), int(j), int(k)) for i, j, k in shapes)

    def __check_init__(self) -> None:
        needed = sum(i * j * k for i, j, k in self.shapes)
        if needed != len(self.points):
            raise GeometryError(
                f"blocks {self.shapes} need {needed} points, got {len(self.points)}"
            )

    def moved(self, points: Array) -> "Grid":
        """The same blocks on other points."""
        return eqx.tree_at(lambda g: g.points, self, points)

    def block(self, number: int) -> Array:
        """Points of one block, shape (ni, nj, nk, 3)."""
        sizes = [i * j * k for i, j, k in self.shapes]
        start = sum(sizes[:number])
        ni, nj, nk = self.shapes[number]
        flat = self.points[start : start + sizes[number]]
        return flat.reshape(nk, nj, ni, 3).transpose(2, 1, 0, 3)

    @property
    def faces(self) -> np.ndarray:
        """Two triangles per cell of each surface patch (blocks with nk = 1), shape (m, 3)."""
        triangles, start = [np.empty((0, 3), np.int32)], 0
        for ni, nj, nk in self.shapes:
            if nk == 1:
                index = start + np.arange(ni * nj, dtype=np.int32).reshape(nj, ni)
                a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
                d, c = index[1:, :-1].ravel(), index[1:, 1:].ravel()
                triangles += [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
            start += ni * nj * nk
        return np.concatenate(triangles)
