"""Which points of a geometry are joined, whatever its kind."""

import numpy as np
from jaxtyping import Int

from . import Geometry, Grid, Section, Surface, VolumeMesh, topology

# corners of each VTK cell that an edge joins
_EDGES = {
    3: ((0, 1),),
    5: ((0, 1), (1, 2), (2, 0)),
    9: ((0, 1), (1, 2), (2, 3), (3, 0)),
    10: ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    12: (
        (0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
        (0, 4), (1, 5), (2, 6), (3, 7),
    ),
    13: ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    14: ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
}  # fmt: skip


def joined_points(geometry: Geometry) -> Int[np.ndarray, "e 2"]:
    """Pairs of joined points; a volume mesh may list a pair several times, a cloud has none."""
    if isinstance(geometry, Surface | Grid):
        return topology.edges(geometry.faces).ends
    if isinstance(geometry, Section):
        return geometry.segments
    pairs = [np.empty((0, 2), np.int64)]
    if isinstance(geometry, VolumeMesh):
        types, starts, nodes = (np.asarray(array) for array in geometry.cells)
        for kind, corners in _EDGES.items():
            first = starts[:-1][types == kind]
            pairs += [nodes[first[:, None] + np.array(pair)] for pair in corners]
    return np.concatenate(pairs)
