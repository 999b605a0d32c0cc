"""Who joins whom: edges, loops, pieces, doubles; coordinates play no part but in welding."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Int, Shaped
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .._types import Array, Points
from ..errors import ParameterError

MOST_WELDED = 50
"""Points that one may be welded to, on average; with more, the tolerance is a mistake."""


class Edges(NamedTuple):
    """The edges of a triangulation, each once, by ascending point numbers.

    Attributes
    ----------
    ends
        Two points each, the smaller number first.
    uses
        How many faces have the edge.
    forward
        How many of them run along it from the smaller number to the larger.
    """

    ends: Int[np.ndarray, "e 2"]
    uses: Int[np.ndarray, "e"]
    forward: Int[np.ndarray, "e"]

    @property
    def open(self) -> Int[np.ndarray, "o 2"]:
        """Edges of one face only."""
        return self.ends[self.uses == 1]

    @property
    def nonmanifold(self) -> Int[np.ndarray, "x 2"]:
        """Edges of more than two faces."""
        return self.ends[self.uses > 2]

    @property
    def misoriented(self) -> Int[np.ndarray, "b 2"]:
        """Edges that two faces run along in the same direction: one of them is turned over."""
        return self.ends[(self.uses == 2) & (self.forward != 1)]


class Neighbours(NamedTuple):
    """Pairs of faces on either side of an edge that no third face has.

    Attributes
    ----------
    one, other
        The two faces of each edge.
    is_oriented
        Whether both show the same side.
    """

    one: Int[np.ndarray, "e"]
    other: Int[np.ndarray, "e"]
    is_oriented: Bool[np.ndarray, "e"]


class Turns(NamedTuple):
    """What would make the faces of each patch show the same side.

    Attributes
    ----------
    patch
        Faces joined through edges of two faces have the same number.
    is_turned
        Faces that show another side than the first one of their patch.
    is_orientable
        Of each patch, whether its faces can show the same side at all; a Moebius strip's cannot,
        and none of them counts as turned.
    """

    patch: Int[np.ndarray, "m"]
    is_turned: Bool[np.ndarray, "m"]
    is_orientable: Bool[np.ndarray, "p"]


class _Sides(NamedTuple):
    """Three sides of each face, ordered so that sides of one edge follow each other."""

    start: np.ndarray
    end: np.ndarray
    face: np.ndarray
    is_new: np.ndarray
    """Whether the side begins another edge."""


def edges(faces: Array) -> Edges:
    """All edges; faces that use a point twice have none."""
    sides = _sides(faces)
    first = np.flatnonzero(sides.is_new)
    if not len(first):
        return Edges(np.empty((0, 2), np.int32), np.empty(0, np.int64), np.empty(0, np.int64))
    low = np.minimum(sides.start, sides.end)[first]
    high = np.maximum(sides.start, sides.end)[first]
    forward = np.add.reduceat((sides.start < sides.end).astype(np.int64), first)
    uses = np.diff(np.append(first, len(sides.start)))
    return Edges(np.stack([low, high], axis=1), uses, forward)


def is_closed(faces: Array) -> bool:
    """Whether no edge belongs to one face only."""
    return len(edges(faces).open) == 0


def boundary_loops(faces: Array) -> list[Int[np.ndarray, "l"]]:
    """Chains of points along the open edges, in the direction of their faces.

    The last point of a loop is joined to its first. Where faces are turned over, a loop follows
    the edges against them; where it meets an edge of three faces, it may end without closing.
    """
    sides = _sides(faces)
    lone = sides.is_new & np.append(sides.is_new[1:], True)
    pairs = np.stack([sides.start[lone], sides.end[lone]], axis=1).tolist()
    outward: dict[int, list[int]] = {}
    inward: dict[int, list[int]] = {}
    for number, (start, end) in enumerate(pairs):
        outward.setdefault(start, []).append(number)
        inward.setdefault(end, []).append(number)
    unused = [True] * len(pairs)
    return [
        np.array(_chain(number, pairs, (outward, inward), unused))
        for number in range(len(pairs))
        if unused[number]
    ]


def nonmanifold_vertices(faces: Array) -> Int[np.ndarray, "v"]:
    """Points at which two or more fans of faces touch without sharing an edge, ascending."""
    proper = np.asarray(faces)
    proper = proper[_is_proper(proper)]
    sides = _sides(proper)
    twin = np.flatnonzero(~sides.is_new)  # shares its edge with the side before it
    low, high = np.minimum(sides.start, sides.end), np.maximum(sides.start, sides.end)
    here, before = sides.face[twin], sides.face[twin - 1]
    first = [3 * here + _corner(proper, here, end[twin]) for end in (low, high)]
    second = [3 * before + _corner(proper, before, end[twin]) for end in (low, high)]
    number, fans = _joined(np.concatenate(first), np.concatenate(second), proper.size)
    point_of_fan = np.empty(number, np.int64)
    point_of_fan[fans] = proper.ravel()
    return np.flatnonzero(np.bincount(point_of_fan) > 1)


def pieces(faces: Array) -> tuple[int, Int[np.ndarray, "m"]]:
    """How many pieces there are that no edge joins, and the piece of each face.

    Faces that use a point twice belong to none: -1.
    """
    faces = np.asarray(faces)
    label = np.full(len(faces), -1)
    proper = _is_proper(faces)
    sides = _sides(faces[proper])
    twin = np.flatnonzero(~sides.is_new)
    number, label[proper] = _joined(sides.face[twin], sides.face[twin - 1], int(proper.sum()))
    return number, label


def neighbours(faces: Array) -> Neighbours:
    """Who lies beyond each edge of exactly two faces."""
    sides = _sides(faces)
    is_new, is_last = sides.is_new, np.append(sides.is_new[1:], True)
    first = np.flatnonzero(is_new[:-1] & ~is_new[1:] & is_last[1:])
    second = first + 1
    return Neighbours(
        sides.face[first], sides.face[second], sides.start[first] == sides.end[second]
    )


def turns(faces: Array) -> Turns:
    """Which faces to turn over so that neighbours show the same side.

    Two nodes stand for each face, as it is and turned over, and neighbours join those that agree.
    """
    count = len(faces)
    near = neighbours(faces)
    _, patch = _joined(near.one, near.other, count)
    across = np.where(near.is_oriented, 0, count)
    _, side = _joined(
        np.concatenate([near.one, near.one + count]),
        np.concatenate([near.other + across, near.other + count - across]),
        2 * count,
    )
    as_is, over = side[:count], side[count:]
    patches = int(patch.max(initial=-1)) + 1
    is_orientable = np.ones(patches, bool)
    is_orientable[patch[as_is == over]] = False
    _, first = np.unique(patch, return_index=True)
    is_turned = (as_is != as_is[first][patch]) & is_orientable[patch]
    return Turns(patch, is_turned, is_orientable)


def duplicate_faces(faces: Array) -> Int[np.ndarray, "d"]:
    """Faces that have the same three points as an earlier one, in any order."""
    first = _first_equal(np.sort(faces, axis=1))
    return np.flatnonzero(first != np.arange(len(first)))


def back_to_back_faces(faces: Array) -> Int[np.ndarray, "d"]:
    """Faces that have the points of an earlier one in the other sense, and none in their own."""
    ordered = np.sort(faces, axis=1)
    a, b, c = np.asarray(faces).T
    is_forward = (a < b).astype(int) + (b < c) + (c < a) == 2
    first = _first_equal(ordered)
    own = _first_equal(np.column_stack([ordered, is_forward]))
    here = np.arange(len(first))
    return np.flatnonzero((own == here) & (first != here))


def duplicate_points(points: Points, tolerance: float = 0.0) -> Int[np.ndarray, "d"]:
    """Points that lie where an earlier one does, or within `tolerance` of it."""
    kept, _ = weld(points, tolerance)
    return np.setdiff1d(np.arange(len(points)), kept, assume_unique=True)


def weld(
    points: Points, tolerance: float = 0.0
) -> tuple[Int[np.ndarray, "k"], Int[np.ndarray, "n"]]:
    """Which points to keep, in their order, and for each point its place among those.

    Of points that lie within `tolerance` of each other [the points' unit], directly or through
    others, the first is kept; with 0 they must be equal (and 0.0 equals -0.0).
    """
    if not 0 <= tolerance < np.inf:
        raise ParameterError(f"a weld's tolerance must be a finite length, got {tolerance}")
    points = np.asarray(points)
    first = _first_equal(points)
    if tolerance > 0 and len(points):
        lone = np.flatnonzero(first == np.arange(len(first)))
        near = _pairs_within(points[lone], tolerance)
        _, group = _joined(near[:, 0], near[:, 1], len(lone))
        _, place = np.unique(group, return_index=True)
        leader = np.empty(len(points), np.int64)
        leader[lone] = lone[place[group]]
        first = leader[first]
    kept, index = np.unique(first, return_inverse=True)
    return kept, index


def _pairs_within(points: np.ndarray, tolerance: float) -> Int[np.ndarray, "p 2"]:
    tree = cKDTree(points)
    near = int(tree.count_neighbors(tree, tolerance)) // len(points) - 1
    if near > MOST_WELDED:
        raise ParameterError(
            f"a weld's tolerance of {tolerance:g} joins each point to {near} others on average; it "
            "must be well below the length of an edge: give a smaller one"
        )
    return tree.query_pairs(tolerance, output_type="ndarray")


def _sides(faces: Array) -> _Sides:
    faces = np.asarray(faces, np.int64)
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    face = np.repeat(np.arange(len(faces)), 3)
    real = np.repeat(_is_proper(faces), 3)
    start, end, face = start[real], end[real], face[real]
    key = (np.minimum(start, end) << 32) | np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    key = key[order]
    is_new = np.append(True, key[1:] != key[:-1])[: len(key)]
    return _Sides(start[order], end[order], face[order], is_new)


def _is_proper(faces: np.ndarray) -> np.ndarray:
    """Whether each face has three different points; others have no inside to go around."""
    a, b, c = faces.T
    return (a != b) & (b != c) & (c != a)


def _chain(
    number: int,
    pairs: list[list[int]],
    ways: tuple[dict[int, list[int]], dict[int, list[int]]],
    unused: list[bool],
) -> list[int]:
    """Follow unused edges from one of them, with the faces where possible, until none goes on."""
    chain = [pairs[number][0]]
    here = pairs[number][1]
    unused[number] = False
    while here != chain[0]:
        chain.append(here)
        for way, far in zip(ways, (1, 0), strict=True):
            onward = way.get(here, [])
            while onward and not unused[onward[-1]]:
                onward.pop()
            if onward:
                number = onward.pop()
                unused[number] = False
                here = pairs[number][far]
                break
        else:
            break
    return chain


def _corner(faces: np.ndarray, face: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Which corner of each face a point is."""
    return np.argmax(faces[face] == point[:, None], axis=1)


def _joined(one: np.ndarray, other: np.ndarray, count: int) -> tuple[int, np.ndarray]:
    graph = coo_array((np.ones(len(one), bool), (one, other)), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    return int(number), label


def _first_equal(rows: Shaped[np.ndarray, "n k"]) -> Int[np.ndarray, "n"]:
    """For each row, the number of the first row that equals it."""
    order = np.lexsort(rows.T)
    ordered = rows[order]
    is_new = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))[: len(rows)]
    first = np.empty(len(rows), np.int64)
    first[order] = order[is_new][np.cumsum(is_new) - 1]
    return first
