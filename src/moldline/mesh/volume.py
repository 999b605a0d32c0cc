"""Volume meshes of mixed cells, in two or three dimensions, with named boundary markers."""

from typing import NamedTuple

import equinox as eqx
import numpy as np
from jaxtyping import Int

from .._types import Array, ArrayLike, Points, is_concrete
from ..errors import GeometryError
from .surface import as_points, check_indices

NODES_PER_CELL = {3: 2, 5: 3, 9: 4, 10: 4, 12: 8, 13: 6, 14: 5}
"""VTK cell types that flow meshes use: line, triangle, quad, tetra, hexa, prism, pyramid."""


class Cells(NamedTuple):
    """Cells of mixed types in their file's order.

    `types` holds VTK's number of each cell; cell c joins the nodes
    `nodes[starts[c]:starts[c + 1]]`.
    """

    types: Int[Array, "c"]
    starts: Int[Array, "c+1"]
    nodes: Int[Array, "w"]


class VolumeMesh(eqx.Module):
    """Points joined by cells, and the named parts of its boundary.

    Attributes
    ----------
    points
        Nodes; z = 0 where the mesh is two-dimensional.
    cells
        All cells, in the file's order.
    markers
        The boundary cells (lines or faces) of each named marker.
    dimension
        2 or 3.
    extra
        What else the file says, word for word, such as SU2's control boxes; lengths in it stay
        in the file's unit.
    """

    points: Points
    cells: Cells
    markers: dict[str, Cells]
    dimension: int = eqx.field(static=True)
    extra: str = eqx.field(static=True)

    def __init__(
        self,
        points: ArrayLike,
        cells: Cells,
        markers: dict[str, Cells] | None = None,
        dimension: int = 3,
        extra: str = "",
    ):
        self.points = as_points(points)
        self.cells = cells
        self.markers = dict(markers or {})
        self.dimension = dimension
        self.extra = extra

    def __check_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise GeometryError(f"a volume mesh has 2 or 3 dimensions, got {self.dimension}")
        if is_concrete(self.points):
            for cells in (self.cells, *self.markers.values()):
                check_indices(np.asarray(cells.nodes)[:, None], len(self.points), "cell node")

    def moved(self, points: Array) -> "VolumeMesh":
        """The same cells on other points."""
        return eqx.tree_at(lambda m: m.points, self, points)
