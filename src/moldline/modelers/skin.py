"""Triangles between rows of points."""

from typing import Any

import numpy as np
from jaxtyping import Int

Index = Int[np.ndarray, "_"]

TIE = 1e-9
"""A diagonal is the shorter one only if it is so by more than this part."""


def between_rows(
    index: Int[np.ndarray, "rows columns"], points: np.ndarray, edge: np.ndarray | None = None
) -> Int[np.ndarray, "m 3"]:
    """Two triangles for each cell of a grid, cut along the shorter diagonal.

    Seen from the side to which along-a-row x from-row-to-row points they run counter-clockwise.
    Points that occur twice make a cell one triangle, or none. No diagonal joins two points of an
    `edge` at which two sheets of triangles meet: the other sheet could have the same one.
    """
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    d, c = index[1:, :-1].ravel(), index[1:, 1:].ravel()
    place = points[index]
    one, other = (
        np.einsum("jik,jik->ji", way, way).ravel()
        for way in (place[1:, 1:] - place[:-1, :-1], place[1:, :-1] - place[:-1, 1:])
    )
    swaps = other < (1 - TIE) * one
    if edge is not None:
        swaps = (swaps | (edge[a] & edge[c])) & ~(edge[b] & edge[d])
    faces = np.stack([a, b, np.where(swaps, d, c), np.where(swaps, b, a), c, d], axis=1)
    return without_repeats(faces.reshape(-1, 3))


def between_lines(
    one: Index, other: Index, places: Any = None, other_places: Any = None
) -> Int[np.ndarray, "m 3"]:
    """Triangles between two lines of different numbers of points, seen as `between_rows` does.

    `places` tell how far along its line each point is, evenly from 0 to 1 by default. Of the two
    edges that could come next it is the one that is less aslant.
    """
    places = np.linspace(0, 1, len(one)) if places is None else np.asarray(places)
    other_places = (
        np.linspace(0, 1, len(other)) if other_places is None else np.asarray(other_places)
    )
    middles = np.concatenate([places[1:] + places[:-1], other_places[1:] + other_places[:-1]])
    order = np.argsort(middles.round(12), kind="stable")
    is_one = order < len(one) - 1
    p, q = np.cumsum(is_one), np.cumsum(~is_one)
    faces = np.stack(
        [one[p - is_one], np.where(is_one, one[p], other[q]), other[q - ~is_one]], axis=1
    )
    return without_repeats(faces)


def without_repeats(faces: Int[np.ndarray, "m 3"]) -> Int[np.ndarray, "_ 3"]:
    """Without triangles that have a point twice."""
    a, b, c = faces.T
    is_triangle = (a != b) & (b != c) & (c != a)
    return faces if is_triangle.all() else faces[is_triangle]


def mirrored(
    faces: Int[np.ndarray, "m 3"], is_shared: np.ndarray
) -> tuple[Int[np.ndarray, "m 3"], Int[np.ndarray, "_"]]:
    """The faces of a mirror image, and which points are to be mirrored for it, in their order.

    Shared are the points that lie in the mirror; the others' images follow behind all points.
    """
    image = np.arange(len(is_shared), dtype=np.int32)
    moved = np.flatnonzero(~is_shared)
    image[moved] = len(is_shared) + np.arange(len(moved))
    return image[faces][:, ::-1], moved
