"""The compiled loops of `cage_grid`: grid lines against triangles, in units of the spacing."""

import numba
import numpy as np

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy")

REACH = 2.6
"""How far from the cage an outside node can be that a look-up touches: 1.5 sqrt(3), rounded up."""

TIE = 1e-9
"""Places whose distances differ by less are equally near."""


@_compiled
def _turn(p: np.ndarray, i: int, j: int, x: float, y: float, b: int, c: int) -> float:
    """Twice the area of (p[i], p[j], (x, y)); of (j, i) exactly the opposite.

    So of two triangles that share an edge, exactly one takes a line that meets it.
    """
    if i < j:
        return (p[j, b] - p[i, b]) * (y - p[i, c]) - (p[j, c] - p[i, c]) * (x - p[i, b])
    return -((p[i, b] - p[j, b]) * (y - p[j, c]) - (p[i, c] - p[j, c]) * (x - p[j, b]))


@_compiled
def _left(p: np.ndarray, i: int, j: int, value: float, b: int, c: int) -> bool:
    """Whether (x, y) is left of the edge; on it, whether (x + e, y + e²) is, for a tiny e.

    So a line through a corner meets one triangle going in and one going out, as one beside it does.
    """
    if value == 0:
        value = p[i, c] - p[j, c]
    if value == 0:
        value = p[j, b] - p[i, b]
    return value > 0


@_compiled
def hits(
    p: np.ndarray,
    faces: np.ndarray,
    axis: int,
    shape: np.ndarray,
    line: np.ndarray,
    face: np.ndarray,
    shares: np.ndarray,
) -> int:
    """Where grid lines along one axis meet triangles: how many, and those there is room for.

    `shares` are barycentric weights of the triangle's corners.
    """
    b, c = (axis + 1) % 3, (axis + 2) % 3
    count = 0
    for f in range(len(faces)):
        i, j, k = faces[f]
        first_b = max(0, int(np.ceil(min(p[i, b], p[j, b], p[k, b]))))
        last_b = min(shape[b] - 1, int(np.floor(max(p[i, b], p[j, b], p[k, b]))))
        first_c = max(0, int(np.ceil(min(p[i, c], p[j, c], p[k, c]))))
        last_c = min(shape[c] - 1, int(np.floor(max(p[i, c], p[j, c], p[k, c]))))
        for x in range(first_b, last_b + 1):
            for y in range(first_c, last_c + 1):
                u = _turn(p, j, k, x, y, b, c)
                v = _turn(p, k, i, x, y, b, c)
                w = _turn(p, i, j, x, y, b, c)
                side = _left(p, j, k, u, b, c)
                if side != _left(p, k, i, v, b, c) or side != _left(p, i, j, w, b, c):
                    continue
                total = u + v + w
                if total == 0:
                    continue
                if count < len(line):
                    line[count] = x * shape[c] + y
                    face[count] = f
                    shares[count, 0] = u / total
                    shares[count, 1] = v / total
                    shares[count, 2] = w / total
                count += 1
    return count


@_compiled
def vote(
    axis: int, shape: np.ndarray, start: np.ndarray, place: np.ndarray, votes: np.ndarray
) -> None:
    """Add 1 to every node that has an odd number of hits below it along one axis."""
    b, c = (axis + 1) % 3, (axis + 2) % 3
    node = np.empty(3, np.int64)
    for x in range(shape[b]):
        node[b] = x
        for y in range(shape[c]):
            node[c] = y
            line = x * shape[c] + y
            h = start[line]
            for i in range(shape[axis]):
                while h < start[line + 1] and place[h] <= i:
                    h += 1
                node[axis] = i
                votes[node[0], node[1], node[2]] += (h - start[line]) % 2


@_compiled
def link(
    axis: int,
    shape: np.ndarray,
    start: np.ndarray,
    place: np.ndarray,
    first: int,
    index: np.ndarray,
    near: np.ndarray,
    gap: np.ndarray,
) -> None:
    """Neighbours of the inside nodes along one axis, below and above, and how far away they are.

    A neighbour is the row of a node, or -1 - (first + hit) where the cage comes before it.
    """
    b, c = (axis + 1) % 3, (axis + 2) % 3
    node, beside = np.empty(3, np.int64), np.empty(3, np.int64)
    for x in range(shape[b]):
        node[b] = beside[b] = x
        for y in range(shape[c]):
            node[c] = beside[c] = y
            line = x * shape[c] + y
            h = start[line]
            for i in range(shape[axis]):
                while h < start[line + 1] and place[h] <= i:
                    h += 1
                node[axis] = i
                row = index[node[0], node[1], node[2]]
                if row < 0:
                    continue
                for side in range(2):
                    hit = h - 1 + side
                    distance = (2 * side - 1) * (place[hit] - i)
                    if distance <= 1.0:
                        near[row, 2 * axis + side] = -1 - first - hit
                        gap[row, 2 * axis + side] = max(distance, 1e-12)
                    else:
                        beside[axis] = i + 2 * side - 1
                        near[row, 2 * axis + side] = index[beside[0], beside[1], beside[2]]
                        gap[row, 2 * axis + side] = 1.0


@_compiled
def _nearest(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, x: np.ndarray, share: np.ndarray
) -> float:
    """Squared distance to a triangle; fills in the barycentric weights of its nearest point."""
    ab, ac, ax = b - a, c - a, x - a
    d00, d01, d11 = np.dot(ab, ab), np.dot(ab, ac), np.dot(ac, ac)
    d20, d21 = np.dot(ax, ab), np.dot(ax, ac)
    det = d00 * d11 - d01 * d01
    if det > 0:
        v, w = (d11 * d20 - d01 * d21) / det, (d00 * d21 - d01 * d20) / det
        if v >= 0 and w >= 0 and v + w <= 1:
            share[0], share[1], share[2] = 1 - v - w, v, w
            gap = ax - v * ab - w * ac
            return np.dot(gap, gap)
    best = np.inf
    for i in range(3):
        start = a if i == 0 else b if i == 1 else c
        end = b if i == 0 else c if i == 1 else a
        edge, off = end - start, x - start
        t = min(1.0, max(0.0, np.dot(edge, off) / np.dot(edge, edge)))
        gap = off - t * edge
        distance = np.dot(gap, gap)
        if distance < best:
            best = distance
            share[:] = 0.0
            share[i], share[(i + 1) % 3] = 1 - t, t
    return best


@_compiled
def _rank(p: np.ndarray, corners: np.ndarray, share: np.ndarray) -> float:
    """Of two nearest places the one that ranks higher counts, however the cage is triangulated."""
    rank = 0.0
    for k in range(3):
        x = p[corners[k]]
        rank += share[k] * (x[0] + 0.618 * x[1] + 0.786 * x[2])
    return rank


@_compiled
def approach(
    p: np.ndarray,
    faces: np.ndarray,
    index: np.ndarray,
    distance: np.ndarray,
    face: np.ndarray,
    shares: np.ndarray,
) -> None:
    """For every outside node near the cage its nearest place on it.

    `index` is -1 at outside nodes; `distance` is squared, infinite to begin with, and `face` and
    `shares` are written where it is below REACH squared.
    """
    x, share, node = np.empty(3), np.empty(3), np.empty(3, np.int64)
    for f in range(len(faces)):
        a, b, c = p[faces[f, 0]], p[faces[f, 1]], p[faces[f, 2]]
        normal = np.cross(b - a, c - a)
        length = np.sqrt(np.dot(normal, normal))
        if length == 0:
            continue
        normal /= length
        w = int(np.argmax(np.abs(normal)))
        u, v = (w + 1) % 3, (w + 2) % 3
        for i in range(*_span(a[u], b[u], c[u], index.shape[u])):
            for j in range(*_span(a[v], b[v], c[v], index.shape[v])):
                plane = a[w] - ((i - a[u]) * normal[u] + (j - a[v]) * normal[v]) / normal[w]
                slack = REACH / abs(normal[w])
                first = max(0, int(np.ceil(plane - slack)))
                for k in range(first, min(index.shape[w], int(np.floor(plane + slack)) + 1)):
                    node[u], node[v], node[w] = i, j, k
                    at = node[0], node[1], node[2]
                    if index[at] >= 0:
                        continue
                    x[:] = node
                    found = _nearest(a, b, c, x, share)
                    if found > min(distance[at] + TIE, REACH * REACH):
                        continue
                    rank = _rank(p, faces[f], share)
                    is_tie = found >= distance[at] - TIE
                    if not is_tie or rank > _rank(p, faces[face[at]], shares[at]) + TIE:
                        distance[at] = found
                        face[at] = f
                        shares[at] = share


@_compiled
def _span(a: float, b: float, c: float, count: int) -> tuple[int, int]:
    first = max(0, int(np.ceil(min(a, b, c) - REACH)))
    return first, min(count, int(np.floor(max(a, b, c) + REACH)) + 1)
