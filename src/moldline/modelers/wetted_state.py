"""What tells whether moved components still cross as they did."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Int

from .._types import Array
from ..mesh import topology
from ..mesh.crossings import Crossings, Search
from .solids import Plane, Solid


class WettedState:
    """The crossings of components as they are bound, and how to find them again.

    Attributes
    ----------
    crossings
        As they are bound.
    free
        Component and a point of each piece that crosses nothing.
    inside
        Whether each such piece lies in each component.
    """

    def __init__(self, solids: Sequence[Solid], plane: Plane | None):
        self._solids, self._plane = tuple(solids), plane
        self._first = np.cumsum([0, *(len(s.points) for s in solids)])
        points = np.concatenate([s.points for s in solids])
        faces = [s.faces + at for s, at in zip(solids, self._first, strict=False)]
        edges = [s.plane_edges + at for s, at in zip(solids, self._first, strict=False)]
        self._search = Search(points, faces, plane.axis if plane else 1, edges)
        self.crossings = self._search(points)
        self.free = self._free_points()
        self.inside = self._enclosed([s.nodes for s in solids])

    @property
    def faces(self) -> Int[np.ndarray, "m 3"]:
        """Of all components, one after the other, as crossings count them."""
        return self._search.faces

    def joins(self) -> Bool[np.ndarray, "s s"]:
        """Which components cross each other."""
        count = len(self._solids)
        ends, face, _ = self.crossings.pairs[:, [0, 2, 3]].T
        one = np.searchsorted(self._first, ends, side="right") - 1
        starts = np.cumsum([0, *(len(s.plane_edges) for s in self._solids)])
        other = np.where(
            face >= 0,
            np.searchsorted(self._search.first, face, side="right") - 1,
            np.searchsorted(starts, -1 - face, side="right") - 1,
        )
        table = np.zeros((count, count), bool)
        table[one, other] = table[other, one] = True
        return table

    def holds(self, points: Sequence[Array]) -> bool:
        """Whether all crossings are the same, and what crosses nothing lies where it did."""
        moved = [np.array(p, float) for p in points]
        if self._plane is not None:
            for p, solid in zip(moved, self._solids, strict=True):
                height = p[solid.sources, self._plane.axis]
                if np.any(np.abs(height) > self._plane.near):
                    return False
                p[solid.sources, self._plane.axis] = 0.0
        found: Crossings = self._search(np.concatenate(moved))
        if not np.array_equal(found.pairs, self.crossings.pairs):
            return False
        nodes = [
            np.concatenate([p, p[s.sources] + s.offset])
            for p, s in zip(moved, self._solids, strict=True)
        ]
        return np.array_equal(self._enclosed(nodes), self.inside)

    def _free_points(self) -> tuple[tuple[int, int], ...]:
        """A point of each piece that neither has an edge nor a face that crosses."""
        crossed = np.zeros(self._first[-1], bool)
        pairs = self.crossings.pairs
        crossed[pairs[:, :2].ravel()] = True
        crossed[self._search.faces[pairs[pairs[:, 2] >= 0, 2]].ravel()] = True
        found = []
        for k, solid in enumerate(self._solids):
            number, piece = topology.pieces(solid.faces)
            is_crossed = crossed[self._first[k] + solid.faces].any(axis=1)
            free = np.setdiff1d(np.arange(number), piece[is_crossed])
            found += [(k, int(solid.faces[np.argmax(piece == f), 0])) for f in free]
        return tuple(found)

    def _enclosed(self, nodes: Sequence[np.ndarray]) -> Bool[np.ndarray, "f s"]:
        from ..numerics.winding import winding  # the compiler need not be loaded to read a file

        inside = np.zeros((len(self.free), len(self._solids)), bool)
        for row, (k, point) in enumerate(self.free):
            for other, solid in enumerate(self._solids):
                if other != k:
                    around = winding(nodes[k][point][None], nodes[other], solid.all_faces)
                    inside[row, other] = around[0] > 0.5
        return inside
