"""Compiled loops that find which edges of one triangulation run through which faces of another.

Every decision is the sign of a determinant that is computed once and the same way for all who ask
for it: on which side of a face a point lies, and how an edge passes an edge. So an edge that runs
through what two faces share is found at one of them, and a point that lies in a face counts as
outside of it. Both are choices, and the same for all neighbours, so that curves stay closed.
"""

import numba
import numpy as np

LEAF = 4
"""Triangles in a leaf of the trees of boxes."""

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy")


@_compiled
def refit(points: np.ndarray, faces: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Boxes of a complete binary tree, root 1 and children 2v and 2v + 1, over runs of faces."""
    leaves = len(low) // 2
    for v in range(leaves):
        for axis in range(3):
            least, most = np.inf, -np.inf
            for f in range(v * LEAF, min((v + 1) * LEAF, len(faces))):
                for corner in range(3):
                    x = points[faces[f, corner], axis]
                    least, most = min(least, x), max(most, x)
            low[leaves + v, axis], high[leaves + v, axis] = least, most
    for v in range(leaves - 1, 0, -1):
        for axis in range(3):
            low[v, axis] = min(low[2 * v, axis], low[2 * v + 1, axis])
            high[v, axis] = max(high[2 * v, axis], high[2 * v + 1, axis])


@_compiled
def search(
    x: np.ndarray,
    faces_a: np.ndarray,
    owned_a: np.ndarray,
    low_a: np.ndarray,
    high_a: np.ndarray,
    faces_b: np.ndarray,
    owned_b: np.ndarray,
    low_b: np.ndarray,
    high_b: np.ndarray,
    near: float,
    found: np.ndarray,
    places: np.ndarray,
    flat: np.ndarray,
) -> tuple[int, int]:
    """Fill `found` with crossings and `flat` with faces in one plane; say how many there are.

    A row of `found` is: the two ends of an edge, the face (of a, or of b counted on from a's), and
    1 where the first end is outside of the face, else -1; `places` is the part of the way from
    the first end. `owned` says, bit by bit, which edges a face answers for: each edge has one such
    face, or none where it is not to be looked at. A row of `flat` is two faces whose boxes meet
    and all of whose corners lie within `near` of the other's plane. More than fit are only counted.
    """
    stack = np.empty((256, 2), np.int64)
    leaves_a, leaves_b = len(low_a) // 2, len(low_b) // 2
    stack[0, 0], stack[0, 1] = 1, 1
    size, count, flats = 1, 0, 0
    while size:
        size -= 1
        v, w = stack[size, 0], stack[size, 1]
        if _apart(low_a[v], high_a[v], low_b[w], high_b[w]):
            continue
        if v < leaves_a and (
            w >= leaves_b or _extent(low_a[v], high_a[v]) >= _extent(low_b[w], high_b[w])
        ):
            stack[size, 0], stack[size, 1] = 2 * v, w
            stack[size + 1, 0], stack[size + 1, 1] = 2 * v + 1, w
            size += 2
            continue
        if w < leaves_b:
            stack[size, 0], stack[size, 1] = v, 2 * w
            stack[size + 1, 0], stack[size + 1, 1] = v, 2 * w + 1
            size += 2
            continue
        first_a, first_b = (v - leaves_a) * LEAF, (w - leaves_b) * LEAF
        for i in range(first_a, min(first_a + LEAF, len(faces_a))):
            for j in range(first_b, min(first_b + LEAF, len(faces_b))):
                if _boxes_apart(x, faces_a[i], faces_b[j]):
                    continue
                count, is_flat = _cross(
                    x, faces_a[i], owned_a[i], i, faces_b[j], owned_b[j], j + len(faces_a),
                    near, found, places, count,
                )  # fmt: skip
                if is_flat:
                    if flats < len(flat):
                        flat[flats, 0], flat[flats, 1] = i, j
                    flats += 1
    return count, flats


@_compiled
def _cross(
    x: np.ndarray,
    a: np.ndarray,
    owned_a: int,
    number_a: int,
    b: np.ndarray,
    owned_b: int,
    number_b: int,
    near: float,
    found: np.ndarray,
    places: np.ndarray,
    count: int,
) -> tuple[int, bool]:
    """Add the crossings of two faces; are both in one plane?"""
    a0, a1, a2 = _out(x, b, a[0]), _out(x, b, a[1]), _out(x, b, a[2])
    b0, b1, b2 = _out(x, a, b[0]), _out(x, a, b[1]), _out(x, a, b[2])
    cross_a = (a0 >= 0) != (a1 >= 0) or (a1 >= 0) != (a2 >= 0)
    cross_b = (b0 >= 0) != (b1 >= 0) or (b1 >= 0) != (b2 >= 0)
    is_flat = max(abs(a0), abs(a1), abs(a2)) <= near * _twice_area(x, b) and max(
        abs(b0), abs(b1), abs(b2)
    ) <= near * _twice_area(x, a)
    if not (cross_a or cross_b):
        return count, is_flat
    # how each edge of a passes each edge of b: 1 or -1
    s00, s01, s02 = _pass(x, a, 0, b, 0), _pass(x, a, 0, b, 1), _pass(x, a, 0, b, 2)
    s10, s11, s12 = _pass(x, a, 1, b, 0), _pass(x, a, 1, b, 1), _pass(x, a, 1, b, 2)
    s20, s21, s22 = _pass(x, a, 2, b, 0), _pass(x, a, 2, b, 1), _pass(x, a, 2, b, 2)
    if cross_a:
        if owned_a & 1 and (a0 >= 0) != (a1 >= 0) and s00 == s01 == s02:
            count = _add(found, places, count, a[0], a[1], number_b, a0, a1)
        if owned_a & 2 and (a1 >= 0) != (a2 >= 0) and s10 == s11 == s12:
            count = _add(found, places, count, a[1], a[2], number_b, a1, a2)
        if owned_a & 4 and (a2 >= 0) != (a0 >= 0) and s20 == s21 == s22:
            count = _add(found, places, count, a[2], a[0], number_b, a2, a0)
    if cross_b:
        if owned_b & 1 and (b0 >= 0) != (b1 >= 0) and s00 == s10 == s20:
            count = _add(found, places, count, b[0], b[1], number_a, b0, b1)
        if owned_b & 2 and (b1 >= 0) != (b2 >= 0) and s01 == s11 == s21:
            count = _add(found, places, count, b[1], b[2], number_a, b1, b2)
        if owned_b & 4 and (b2 >= 0) != (b0 >= 0) and s02 == s12 == s22:
            count = _add(found, places, count, b[2], b[0], number_a, b2, b0)
    return count, is_flat


@_compiled
def _add(
    found: np.ndarray,
    places: np.ndarray,
    count: int,
    start: int,
    end: int,
    face: int,
    there: float,
    beyond: float,
) -> int:
    if count < len(found):
        if start > end:
            start, end, there, beyond = end, start, beyond, there
        found[count, 0], found[count, 1], found[count, 2] = start, end, face
        found[count, 3] = 1 if there >= 0 else -1
        places[count] = there / (there - beyond)
    return count + 1


@_compiled
def _out(x: np.ndarray, face: np.ndarray, p: int) -> float:
    """Six times the volume of face and point; positive where the point is outside."""
    a, b, c = face[0], face[1], face[2]
    ux, uy, uz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    vx, vy, vz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
    wx, wy, wz = x[p, 0] - x[a, 0], x[p, 1] - x[a, 1], x[p, 2] - x[a, 2]
    return wx * (uy * vz - uz * vy) + wy * (uz * vx - ux * vz) + wz * (ux * vy - uy * vx)


@_compiled
def _pass(x: np.ndarray, a: np.ndarray, i: int, b: np.ndarray, j: int) -> int:
    """On which side the edge i of a passes the edge j of b, both in the direction of their face."""
    p, q = a[i], a[(i + 1) % 3]
    r, s = b[j], b[(j + 1) % 3]
    turn = 1
    if p > q:
        p, q, turn = q, p, -turn
    if r > s:
        r, s, turn = s, r, -turn
    ux, uy, uz = x[q, 0] - x[p, 0], x[q, 1] - x[p, 1], x[q, 2] - x[p, 2]
    vx, vy, vz = x[r, 0] - x[p, 0], x[r, 1] - x[p, 1], x[r, 2] - x[p, 2]
    wx, wy, wz = x[s, 0] - x[p, 0], x[s, 1] - x[p, 1], x[s, 2] - x[p, 2]
    volume = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
    return turn if volume >= 0 else -turn


@_compiled
def _twice_area(x: np.ndarray, face: np.ndarray) -> float:
    a, b, c = x[face[0]], x[face[1]], x[face[2]]
    n0 = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
    n1 = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
    n2 = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)


@_compiled
def _apart(low_a: np.ndarray, high_a: np.ndarray, low_b: np.ndarray, high_b: np.ndarray) -> bool:
    return (
        low_a[0] > high_b[0]
        or high_a[0] < low_b[0]
        or low_a[1] > high_b[1]
        or high_a[1] < low_b[1]
        or low_a[2] > high_b[2]
        or high_a[2] < low_b[2]
    )


@_compiled
def _boxes_apart(x: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    for axis in range(3):
        p, q, r = x[a[0], axis], x[a[1], axis], x[a[2], axis]
        s, t, u = x[b[0], axis], x[b[1], axis], x[b[2], axis]
        if min(p, q, r) > max(s, t, u) or max(p, q, r) < min(s, t, u):
            return True
    return False


@_compiled
def _extent(low: np.ndarray, high: np.ndarray) -> float:
    return (high[0] - low[0]) + (high[1] - low[1]) + (high[2] - low[2])


@_compiled
def in_plane(
    flat: np.ndarray, one: np.ndarray, other: np.ndarray, found: np.ndarray, places: np.ndarray
) -> int:
    """Fill `found` with crossings of edges in a plane, and say how many there are.

    `flat` are plane coordinates. A row of `found` is: the ends of an edge of one, the number of
    the edge of the other, and the side on which the first end is.
    """
    count = 0
    for i in range(len(one)):
        p, q = one[i, 0], one[i, 1]
        for j in range(len(other)):
            r, s = other[j, 0], other[j, 1]
            p_side, q_side = _left(flat, r, s, p), _left(flat, r, s, q)
            if (p_side >= 0) == (q_side >= 0):
                continue
            if (_left(flat, p, q, r) >= 0) == (_left(flat, p, q, s) >= 0):
                continue
            if count < len(found):
                found[count, 0], found[count, 1], found[count, 2] = p, q, j
                found[count, 3] = 1 if p_side >= 0 else -1
                places[count] = p_side / (p_side - q_side)
            count += 1
    return count


@_compiled
def _left(flat: np.ndarray, a: int, b: int, c: int) -> float:
    """Twice the area of three points, the same whichever end of the edge a, b comes first."""
    turn = 1.0
    if a > b:
        a, b, turn = b, a, -1.0
    ux, uy = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
    vx, vy = flat[c, 0] - flat[a, 0], flat[c, 1] - flat[a, 1]
    return turn * (ux * vy - uy * vx)
