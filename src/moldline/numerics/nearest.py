"""The nearest points of a triangulation, by trying all its triangles."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from . import nearest_loops
from .threads import spread

THREAD_WORTH = 256
"""Places that are worth a thread of their own."""


class Nearest(NamedTuple):
    """For each place the nearest point of a triangulation.

    Attributes
    ----------
    distances
        How far it is [m].
    faces
        Number of the triangle it is on.
    weights
        Its barycentric weights there.
    """

    distances: Float[np.ndarray, "n"]
    faces: Int[np.ndarray, "n"]
    weights: Float[np.ndarray, "n 3"]


def nearest(
    places: Float[np.ndarray, "n 3"],
    points: Float[np.ndarray, "p 3"],
    faces: Int[np.ndarray, "t 3"],
) -> Nearest:
    """The nearest point of triangles to each place: for thousands of triangles, not millions."""
    squares, weights = np.empty(len(places)), np.empty((len(places), 3))
    owners = np.empty(len(places), np.int64)
    given = np.ascontiguousarray(places, float), np.ascontiguousarray(points[faces])
    spread(nearest_loops.nearest, len(places), *given, squares, weights, owners, least=THREAD_WORTH)
    return Nearest(np.sqrt(squares), owners, weights)
