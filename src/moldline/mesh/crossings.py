"""Where the edges of surfaces run through the faces of others, for points that move."""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from ..numerics import box_tree

FLAT = 1e-9
"""Faces lie in one plane if their corners are no farther off it than this part of the extent."""


class Crossings(NamedTuple):
    """What crosses what, edge by edge and along each edge in order.

    Two states of the same surfaces with equal `pairs` are joined in the same way.

    Attributes
    ----------
    pairs
        The two ends of an edge, a face, and 1 where the first end is outside of it, else -1. Faces
        are counted through all surfaces. For edges in a plane, see `Search`, the face is
        -1 - the number of the edge in the plane.
    places
        How far along the edge from its first end, 0 to 1.
    coplanar
        Pairs of faces of different surfaces that lie in one plane, and may overlap.
    """

    pairs: Int[np.ndarray, "p 4"]
    places: Float[np.ndarray, "p"]
    coplanar: Int[np.ndarray, "c 2"]


class _Tree(NamedTuple):
    """Triangles of a surface in the order of their boxes."""

    order: np.ndarray
    faces: np.ndarray
    owned: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Search:
    """Finds the crossings between surfaces with shared point numbers; made once, asked often.

    Attributes
    ----------
    faces
        Of all surfaces, one after the other.
    first
        The first face of each surface, and the number of faces.
    axis
        Normal of the plane x, y or z = 0 that `plane_edges` lie in: these are compared among
        themselves, in the plane, whatever their third coordinate.
    plane_edges
        Of each surface, edges in the direction of their faces.
    """

    def __init__(
        self,
        points: Array,
        surfaces: Sequence[Int[np.ndarray, "_ 3"]],
        axis: int = 1,
        plane_edges: Sequence[Int[np.ndarray, "_ 2"]] = (),
    ):
        self.faces = np.concatenate(surfaces).astype(np.int64)
        self.first = np.cumsum([0, *map(len, surfaces)])
        self.axis = axis
        self.plane_edges = [np.asarray(e, np.int64).reshape(-1, 2) for e in plane_edges]
        apart = self.plane_edges or [np.empty((0, 2), np.int64)] * len(surfaces)
        points = np.asarray(points)
        self._trees = [_tree(points, f, e) for f, e in zip(surfaces, apart, strict=True)]

    def __call__(self, points: Array) -> Crossings:
        """All crossings of the surfaces at these points."""
        from ..numerics import pair_loops  # the compiler need not be loaded to read a file

        x = np.ascontiguousarray(points, float)
        for tree in self._trees:
            pair_loops.refit(x, tree.faces, tree.low, tree.high)
        near = FLAT * float(np.linalg.norm(np.ptp(x, axis=0)))
        found = [self._between(x, i, j, near) for i, j in combinations(range(len(self._trees)), 2)]
        found += [self._in_plane(x, i, j) for i in range(len(self.plane_edges)) for j in
                  range(len(self.plane_edges)) if i != j]  # fmt: skip
        pairs, places, coplanar = (np.concatenate(part) for part in zip(*found, strict=True))
        order = np.lexsort([pairs[:, 2], places, pairs[:, 1], pairs[:, 0]])
        return Crossings(pairs[order], places[order], coplanar)

    def _between(self, x: np.ndarray, i: int, j: int, near: float) -> Crossings:
        from ..numerics import pair_loops

        one, other = self._trees[i], self._trees[j]
        room, room_flat = 4096, 1024
        while True:
            found, places = np.empty((room, 4), np.int64), np.empty(room)
            flat = np.empty((room_flat, 2), np.int64)
            count, flats = pair_loops.search(x, *one[1:], *other[1:], near, found, places, flat)
            if count <= room and flats <= room_flat:
                break
            room, room_flat = max(room, count), max(room_flat, flats)
        found, places, flat = found[:count], places[:count], flat[:flats]
        numbers = np.concatenate([one.order + self.first[i], other.order + self.first[j]])
        found[:, 2] = numbers[found[:, 2]]
        flat[:, 0], flat[:, 1] = numbers[flat[:, 0]], numbers[len(one.order) + flat[:, 1]]
        return Crossings(found, places, flat)

    def _in_plane(self, x: np.ndarray, i: int, j: int) -> Crossings:
        from ..numerics import pair_loops

        one, other = np.sort(self.plane_edges[i], axis=1), self.plane_edges[j]
        flat = np.ascontiguousarray(np.delete(x, self.axis, axis=1))
        room = len(one) + len(other)
        found, places = np.empty((room, 4), np.int64), np.empty(room)
        count = pair_loops.in_plane(flat, one, other, found, places)
        if count > room:
            found, places = np.empty((count, 4), np.int64), np.empty(count)
            pair_loops.in_plane(flat, one, other, found, places)
        found, places = found[:count], places[:count]
        found[:, 2] = -1 - found[:, 2] - sum(map(len, self.plane_edges[:j]))
        return Crossings(found, places, np.empty((0, 2), np.int64))


def _tree(points: np.ndarray, faces: np.ndarray, apart: np.ndarray) -> _Tree:
    from ..numerics import pair_loops

    order = box_tree.along_curve(points[faces].mean(axis=1))
    ordered = np.ascontiguousarray(faces[order], np.int64)
    size = 2 * box_tree.leaves(len(order), pair_loops.LEAF)
    owned = _owned(ordered, apart)
    return _Tree(order, ordered, owned, np.empty((size, 3)), np.empty((size, 3)))


def _owned(faces: np.ndarray, apart: np.ndarray) -> np.ndarray:
    """Bits of those edges that each face answers for: the first face of each edge not `apart`."""
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    key = _key(ends)
    _, first = np.unique(key, return_index=True)
    is_own = np.zeros(len(key), bool)
    is_own[first] = True
    is_own &= ~np.isin(key, _key(apart))
    return is_own.reshape(-1, 3) @ np.array([1, 2, 4])


def _key(ends: np.ndarray) -> np.ndarray:
    ends = np.sort(ends.astype(np.int64), axis=1)
    return (ends[:, 0] << 32) | ends[:, 1]


def overlaps(
    points: Array, faces: Int[np.ndarray, "m 3"], pairs: Int[np.ndarray, "c 2"]
) -> tuple[Float[np.ndarray, "c"], Float[np.ndarray, "c 3"]]:
    """Area that pairs of faces in one plane have in common [m²], and a place there."""
    corners = np.asarray(points)[faces[pairs]]
    areas, places = np.zeros(len(pairs)), corners[:, 0, 0].copy()
    for k, (one, other) in enumerate(corners):
        clipped = _clipped(one, other)
        if len(clipped) > 2:
            fan = np.cross(clipped[1:-1] - clipped[0], clipped[2:] - clipped[0])
            areas[k], places[k] = np.linalg.norm(fan.sum(axis=0)) / 2, clipped.mean(axis=0)
    return areas, places


def _clipped(polygon: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """What of a polygon lies within a triangle in its plane; Sutherland and Hodgman, 1974."""
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    for k in range(3):
        inward = np.cross(normal, triangle[(k + 1) % 3] - triangle[k])
        depth = (polygon - triangle[k]) @ inward
        kept = []
        for here, there, d, e in zip(
            polygon, np.roll(polygon, -1, axis=0), depth, np.roll(depth, -1), strict=True
        ):
            if d >= 0:
                kept.append(here)
            if (d > 0) != (e > 0) and d != e:
                kept.append(here + d / (d - e) * (there - here))
        polygon = np.array(kept).reshape(-1, 3)
    return polygon
