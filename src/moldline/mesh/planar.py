"""Triangulation of plane outlines between given points, none added and none left out."""

import heapq
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..errors import GeometryError

FLAT = 1e-12
"""An ear counts as flat if its height is below this part of its longest side."""

_TOUCHING = 1e-14


def triangulated(
    points: Float[np.ndarray, "n 2"],
    loops: list[Int[np.ndarray, "_"]],
    inner: Sequence[int] = (),
) -> Int[np.ndarray, "m 3"]:
    """Counter-clockwise triangles of the regions that loops enclose, with points inside of them.

    Outlines run counter-clockwise and holes clockwise, any number of both; none may cross itself or
    another. Points in a straight line are kept, so that neighbours fit edge by edge. Ears are cut
    off, and edges flipped until the circle around each triangle holds no other point that it sees:
    source: Meisters, Amer. Math. Monthly 82, 1975; Lawson, Mathematical Software III, 1977.
    """
    is_outline = [loop_area(points[loop]) > 0 for loop in loops]
    outlines = [loop for loop, is_out in zip(loops, is_outline, strict=True) if is_out]
    holes: list[list[np.ndarray]] = [[] for _ in outlines]
    for hole in (loop for loop, is_out in zip(loops, is_outline, strict=True) if not is_out):
        around = [k for k, loop in enumerate(outlines) if _is_inside(points[hole[0]], points[loop])]
        if not around:
            raise GeometryError(
                f"a hole near {_place(points[hole[0]])} lies in no outline; do the loops cross?"
            )
        holes[min(around, key=lambda k: loop_area(points[outlines[k]]))].append(hole)
    faces = [
        triangle
        for outline, inside in zip(outlines, holes, strict=True)
        for triangle in _ears(points, _bridged(points, outline, inside))
    ]
    for number in inner:
        _split(points, faces, number)
    return _flipped(points, faces)


def loop_area(corners: np.ndarray) -> float:
    """Enclosed by a loop, positive if it runs counter-clockwise."""
    x, y = (corners - corners[0]).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def _is_inside(place: np.ndarray, corners: np.ndarray) -> bool:
    """Whether a ray from the place to the right crosses the loop an odd number of times."""
    start, end = corners, np.roll(corners, -1, axis=0)
    spans = (start[:, 1] > place[1]) != (end[:, 1] > place[1])
    start, end = start[spans], end[spans]
    part = (place[1] - start[:, 1]) / (end[:, 1] - start[:, 1])
    return bool(np.sum(start[:, 0] + part * (end[:, 0] - start[:, 0]) > place[0]) % 2)


def _cross(o: np.ndarray, a: np.ndarray, b: np.ndarray) -> Any:
    """Twice the area of the triangle o, a, b; a number, or an array of them."""
    return (a[..., 0] - o[..., 0]) * (b[..., 1] - o[..., 1]) - (a[..., 1] - o[..., 1]) * (
        b[..., 0] - o[..., 0]
    )


def _bridged(points: np.ndarray, outline: np.ndarray, holes: list[np.ndarray]) -> list[int]:
    """One loop that goes out to each hole, around it and back the same way."""
    chain = outline.tolist()
    todo = sorted(holes, key=lambda hole: -points[hole, 0].max())
    for number, hole in enumerate(todo):
        first = int(np.argmax(points[hole, 0]))
        ring = np.roll(hole, -first).tolist()
        walls = [chain, *(other.tolist() for other in todo[number:])]
        at = _seen(points, ring[0], chain, walls)
        chain = [*chain[: at + 1], *ring, ring[0], *chain[at:]]
    return chain


def _seen(points: np.ndarray, start: int, chain: list[int], walls: list[list[int]]) -> int:
    """Place in a chain of the nearest point that can be seen from a point outside it."""
    one = np.concatenate([np.array(wall) for wall in walls])
    other = np.concatenate([np.roll(wall, -1) for wall in walls])
    here = points[start]
    for at in np.argsort(np.linalg.norm(points[chain] - here, axis=1)).tolist():
        end = chain[at]
        there, before, after = (
            points[end],
            points[chain[at - 1]],
            points[chain[at + 1 - len(chain)]],
        )
        sides = _cross(there, after, here) > 0, _cross(there, here, before) > 0
        if not (all(sides) if _cross(before, there, after) > 0 else any(sides)):
            continue  # where a point occurs twice, only one of its corners opens to the hole
        free = (one != start) & (one != end) & (other != start) & (other != end)
        a, b = points[one[free]], points[other[free]]
        crosses = (_cross(here, there, a) * _cross(here, there, b) <= 0) & (
            _cross(a, b, here) * _cross(a, b, there) <= 0
        )
        if not crosses.any():
            return int(at)
    raise GeometryError(f"a hole near {_place(here)} meets the loop around it")


def _ears(points: np.ndarray, chain: list[int]) -> list[tuple[int, int, int]]:
    """Cut triangles off a loop, the roundest first, until nothing is left."""
    ids = np.array(chain)
    corners = points[ids]
    touching = _TOUCHING * float(np.ptp(corners, axis=0).max()) ** 2
    before = np.roll(np.arange(len(ids)), 1).tolist()
    after = np.roll(np.arange(len(ids)), -1).tolist()
    is_left = np.ones(len(ids), bool)
    faces: list[tuple[int, int, int]] = []
    todo: list[tuple[float, int, int, int]] = []

    def consider(here: int) -> None:
        triangle = before[here], here, after[here]
        roundness = _roundness(*corners[list(triangle)])
        if roundness > FLAT:
            heapq.heappush(todo, (-roundness, *triangle))

    cut = -1
    while len(faces) < len(ids) - 2:
        if not todo:  # what was no ear may have become one when another point went
            if cut == len(faces):
                place = _place(corners[np.argmax(is_left)])
                raise GeometryError(
                    f"a plane outline crosses or touches itself, perhaps at {place}"
                )
            cut = len(faces)
            for here in np.flatnonzero(is_left).tolist():
                consider(here)
            continue
        _, a, b, c = heapq.heappop(todo)
        is_there = is_left[b] and before[b] == a and after[b] == c
        if is_there and _is_empty(corners, ids, is_left, [a, b, c], touching):
            faces.append((chain[a], chain[b], chain[c]))
            after[a], before[c], is_left[b] = c, a, False
            consider(a)
            consider(c)
    return faces


def _roundness(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Height by longest side of a triangle, below 0 if it runs clockwise."""
    longest = max(float(np.dot(side, side)) for side in (b - a, c - b, a - c))
    return float(_cross(a, b, c)) / longest if longest else 0.0


def _is_empty(
    corners: np.ndarray, ids: np.ndarray, is_left: np.ndarray, triangle: list[int], touching: float
) -> bool:
    """Whether a triangle holds no other point of the loop."""
    a, b, c = corners[triangle]
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    near = np.flatnonzero(is_left & ((low <= corners) & (corners <= high)).all(axis=1))
    p = corners[near[~np.isin(ids[near], ids[triangle])]]
    inside = [_cross(*side, p) >= -touching for side in ((a, b), (b, c), (c, a))]
    return not np.logical_and.reduce(inside).any()


def _split(points: np.ndarray, faces: list[tuple[int, int, int]], number: int) -> None:
    """Put a point into the triangle where it lies, which becomes three."""
    corners = points[np.array(faces)]
    sides = [_cross(corners[:, k - 1], corners[:, k], points[number]) for k in range(3)]
    around = int(np.argmax(np.min(sides, axis=0)))
    if min(side[around] for side in sides) < 0:
        raise GeometryError(f"a point at {_place(points[number])} lies inside of no outline")
    a, b, c = faces[around]
    faces[around] = (a, b, number)
    faces += [(b, c, number), (c, a, number)]


def _flipped(points: np.ndarray, faces: list[tuple[int, int, int]]) -> Int[np.ndarray, "m 3"]:
    """The same region with its inner edges flipped until they are Delaunay's."""
    apex = {
        (face[k - 2], face[k - 1]): face[k] for face in faces for k in range(3)
    }  # the third point of the triangle to the left of each directed edge
    todo = list(apex)
    most = len(faces) ** 2 + len(todo)  # Lawson's limit; rounding might go on for ever
    while todo and (most := most - 1):
        a, b = todo.pop()
        c, d = apex.get((a, b)), apex.get((b, a))
        if c is None or d is None or not _is_better_flipped(*points[[a, b, c, d]]):
            continue
        del apex[a, b], apex[b, a]
        for x, y, z in ((c, a, d), (d, b, c)):
            apex[x, y], apex[y, z], apex[z, x] = z, x, y
        todo += [(a, d), (d, b), (b, c), (c, a)]
    triangles = {(a, b, c) for (a, b), c in apex.items() if a < b and a < c}
    return np.array(sorted(triangles), dtype=np.int64).reshape(-1, 3)


def _is_better_flipped(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> bool:
    """Whether the angles opposite the edge a, b at c and d are more than 180 degrees together."""
    (ca, cb), (da, db) = (a - c, b - c), (a - d, b - d)
    sine = _cross(c, a, b) * np.dot(da, db) + np.dot(ca, cb) * _cross(d, b, a)
    return bool(sine < -1e-12 * np.sqrt(np.prod([np.dot(v, v) for v in (ca, cb, da, db)])))


def _place(point: np.ndarray) -> str:
    return "({:.6g}, {:.6g})".format(*point)
