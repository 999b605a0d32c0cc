"""Where a surface runs through itself."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .._types import Faces, Points
from ..numerics import box_tree
from . import topology

MOST = 100_000
"""Pairs after which the search stops: what is all tangled must not fill the memory."""

FARTHEST = 1e7
"""Along a line of two planes that is not `_PARALLEL` to nothing, in sizes of the surface."""

_PARALLEL = 1e-6
"""Planes whose normals' cross product is below this have no line in common worth computing."""


class Intersections(NamedTuple):
    """Pairs of faces that run through each other.

    Attributes
    ----------
    pairs
        Numbers of the faces, the smaller first, ascending.
    places
        A point of each pair that lies on both faces.
    """

    pairs: Int[np.ndarray, "i 2"]
    places: Float[np.ndarray, "i 3"]


def self_intersections(points: Points, faces: Faces, most: int = MOST) -> Intersections:
    """Pairs of faces that cross, overlap in one plane, or touch other than along their edges.

    Two faces count if they have a point in common that is inside at least one of them. Points in
    one place count as one, so an edge or corner that faces share is no intersection, and neither
    are edges and corners that only touch (but an edge on the inside of a face is). Faces without
    area and faces folded onto a neighbour are not looked at. After `most` pairs the search stops.
    """
    from ..numerics import crossing_loops  # the compiler need not be loaded to read a file

    points, faces = np.asarray(points), np.asarray(faces)
    looked_at = np.flatnonzero(np.isfinite(points[faces]).all(axis=(1, 2)))
    if not len(looked_at):
        return Intersections(np.empty((0, 2), np.int64), np.empty((0, 3)))
    used, own = np.unique(faces[looked_at], return_inverse=True)
    kept, index = topology.weld(points[used])
    own, used = index[own.reshape(-1, 3)], points[used[kept]]
    exponent = int(np.frexp(np.abs(used).max())[1])
    used = np.ldexp(used, -exponent)  # exact, and products stay in range
    order, low, high, last = _tree(used[own], crossing_loops.LEAF)
    found = np.empty((most, 2), np.int64)
    count = crossing_loops.search(used, own[order], low, high, last, found)
    rows = np.sort(order[found[:count]], axis=1)
    rows = rows[np.lexsort(rows.T[::-1])]
    places = _places(used[own[rows[:, 0]]], used[own[rows[:, 1]]])
    return Intersections(looked_at[rows], np.ldexp(places, exponent))


def _tree(corners: np.ndarray, leaf: int) -> tuple[np.ndarray, ...]:
    """Order of the triangles along a space-filling curve, and boxes over runs of them.

    The boxes are those of a complete binary tree, root 1, children 2v and 2v + 1; with them comes
    the last triangle of each.
    """
    order = box_tree.along_curve(corners.mean(axis=1))
    leaves = box_tree.leaves(len(order), leaf)
    low = np.full((leaves * leaf, 3), np.inf)
    high = -low
    low[: len(order)], high[: len(order)] = corners[order].min(axis=1), corners[order].max(axis=1)
    lows = [low.reshape(leaves, leaf, 3).min(axis=1)]
    highs = [high.reshape(leaves, leaf, 3).max(axis=1)]
    lasts = [np.minimum(np.arange(1, leaves + 1) * leaf, len(order)) - 1]
    while len(lows[0]) > 1:
        lows.insert(0, np.minimum(lows[0][::2], lows[0][1::2]))
        highs.insert(0, np.maximum(highs[0][::2], highs[0][1::2]))
        lasts.insert(0, lasts[0][1::2])
    nothing = np.full((1, 3), np.nan)  # nodes count from 1
    return (
        order,
        np.concatenate([nothing, *lows]),
        np.concatenate([nothing, *highs]),
        np.concatenate([[-1], *lasts]),
    )


def _places(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """A point that each pair of triangles has in common."""
    middle = one[:, :1]
    one, other = one - middle, other - middle
    n, m = _unit_normals(one), _unit_normals(other)
    along = np.cross(n, m)
    square = np.einsum("ij,ij->i", along, along)[:, None]
    is_line = square[:, 0] > _PARALLEL**2
    places = _common_middle(one, other, n, m)
    a, b, n, m, along = one[is_line], other[is_line], n[is_line], m[is_line], along[is_line]
    away = np.einsum("ij,ij->i", m, b[:, 0])[:, None] / square[is_line]
    start = away * np.cross(along, n)
    low, high = np.full(len(a), -np.inf), np.full(len(a), np.inf)
    for corners, normal in ((a, n), (b, m)):
        low, high = _clipped(start, along, low, high, corners, normal)
    low, high = np.clip((low, high), -FARTHEST, FARTHEST)  # where rounding leaves no end
    places[is_line] = start + ((low + high) / 2)[:, None] * along
    return middle[:, 0] + places


def _common_middle(one: np.ndarray, other: np.ndarray, n: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Mean of the middles of those parts of the sides that lie in the other, coplanar triangle."""
    total, parts = np.zeros((len(one), 3)), np.zeros((len(one), 1))
    for mine, its, normal in ((one, other, m), (other, one, n)):
        for i in range(3):
            start, side = mine[:, i], mine[:, (i + 1) % 3] - mine[:, i]
            low, high = _clipped(start, side, np.zeros(len(one)), np.ones(len(one)), its, normal)
            is_part = (low < high)[:, None]
            total += np.where(is_part, start + ((low + high) / 2)[:, None] * side, 0.0)
            parts += is_part
    return total / np.maximum(parts, 1)


def _clipped(
    start: np.ndarray,
    along: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    corners: np.ndarray,
    normal: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """What of start + t along, low <= t <= high, is within the sides of triangles."""
    for i in range(3):
        inward = np.cross(normal, corners[:, (i + 1) % 3] - corners[:, i])
        depth = np.einsum("ij,ij->i", inward, start - corners[:, i])
        slope = np.einsum("ij,ij->i", inward, along)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            t = -depth / slope
        low = np.where(slope > 0, np.maximum(low, t), low)
        high = np.where(slope < 0, np.minimum(high, t), high)
        high = np.where((slope == 0) & (depth < 0), low, high)
    return low, high


def _unit_normals(corners: np.ndarray) -> np.ndarray:
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(lengths > 0, lengths, 1.0)
