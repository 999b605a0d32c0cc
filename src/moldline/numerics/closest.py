"""The closest two triangles of two triangulations, by a tree of boxes."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from . import closest_loops
from .nearest import Nearest
from .threads import spread

LEAF = 4
"""Triangles in the smallest boxes."""

THREAD_WORTH = 2048
"""Triangles or places that are worth a thread of their own."""


class Tree(NamedTuple):
    """Triangles, in boxes within boxes.

    Attributes
    ----------
    corners
        Of each triangle.
    boxes
        What `closest_loops.grow` returns.
    """

    corners: Float[np.ndarray, "t 3 3"]
    boxes: tuple[np.ndarray, ...]


class Closest(NamedTuple):
    """The closest points of two triangulations.

    Attributes
    ----------
    distance
        How far they are apart [m], 0 where the surfaces meet.
    faces
        The triangle of each.
    weights
        Their barycentric weights there; of no meaning where the surfaces meet.
    """

    distance: float
    faces: tuple[int, int]
    weights: Float[np.ndarray, "2 3"]


def tree(points: Float[np.ndarray, "p 3"], faces: Int[np.ndarray, "t 3"]) -> Tree:
    """Sort triangles into boxes."""
    corners = np.ascontiguousarray(points[faces], float)
    return Tree(corners, closest_loops.grow(corners, LEAF))


def closest(
    points: Float[np.ndarray, "p 3"], faces: Int[np.ndarray, "t 3"], among: Tree
) -> Closest:
    """The closest points of triangles and of those in a tree, exact for faces and edges."""
    count = len(faces)
    corners = np.ascontiguousarray(points[faces], float)
    # far-flung ones first: they bound what the others have to look at
    stride = max(1, int(np.sqrt(count)))
    mixed = np.argsort(np.arange(count) % stride, kind="stable")
    squares, pairs = np.full(count, np.inf), np.zeros((count, 2), np.int64)
    weights = np.zeros((count, 2, 3))
    given = corners[mixed], among.corners, among.boxes, squares, pairs, weights
    spread(closest_loops.closest, count, *given, least=THREAD_WORTH)
    part = int(squares.argmin())
    one, other = pairs[part].tolist()
    return Closest(float(np.sqrt(squares[part])), (int(mixed[one]), other), weights[part])


def nearest(places: Float[np.ndarray, "n 3"], among: Tree) -> Nearest:
    """The nearest point of the triangles in a tree to each place."""
    squares, weights = np.empty(len(places)), np.empty((len(places), 3))
    owners = np.empty(len(places), np.int64)
    given = np.ascontiguousarray(places, float), among.corners, among.boxes
    spread(
        closest_loops.nearest_in_tree,
        len(places), *given, squares, weights, owners, least=THREAD_WORTH,
    )  # fmt: skip
    return Nearest(np.sqrt(squares), owners, weights)
