"""Compiled loops that find the triangles of a soup that cross each other.

Every decision is the sign of a determinant. Where rounding could change the sign, of the products
or of the coordinates before, it counts as 0, which means touching; so faces that were meant to lie
in one plane do not cross. Coordinates must be of order 1: no product over- or underflows, and
their own rounding is known.

Sources: the tests of two triangles follow Guigue and Devillers, J. Graphics Tools 8 (1), 2003, the
error bounds are those of Shewchuk, Discrete & Computational Geometry 18, 1997.
"""

import numba
import numpy as np

LEAF = 4
"""Triangles in a leaf of the tree of boxes."""

_BOUND_3D = (7.0 + 56.0 * 2.0**-53) * 2.0**-53
_BOUND_2D = (3.0 + 16.0 * 2.0**-53) * 2.0**-53

_ROUNDED = 2.0**-53
"""What a coordinate of order 1 is off by."""

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy")


@_compiled
def search(
    points: np.ndarray,
    faces: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    last: np.ndarray,
    found: np.ndarray,
) -> int:
    """Fill `found` with pairs of faces that cross, and say how many; stop when it is full.

    `low` and `high` are the boxes of a complete binary tree's nodes, the children of node v being
    2v and 2v + 1 and the leaves the second half; `last` is the last face below each node.
    """
    stack = np.empty(128, np.int64)
    leaves = len(low) // 2
    count = 0
    for i in range(len(faces)):
        own = leaves + i // LEAF
        xl, yl, zl, xh, yh, zh = _box(points, faces[i])
        size = 1
        stack[0] = 1
        while size:
            size -= 1
            node = stack[size]
            if (
                last[node] <= i
                or low[node, 0] > xh
                or high[node, 0] < xl
                or low[node, 1] > yh
                or high[node, 1] < yl
                or low[node, 2] > zh
                or high[node, 2] < zl
            ):
                continue
            if node < leaves:
                stack[size] = 2 * node
                stack[size + 1] = 2 * node + 1
                size += 2
                continue
            first = i + 1 if node == own else (node - leaves) * LEAF
            for j in range(first, last[node] + 1):
                if cross(points, faces[i], faces[j]):
                    found[count, 0] = i
                    found[count, 1] = j
                    count += 1
                    if count == len(found):
                        return count
    return count


@_compiled
def cross(x: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two triangles meet inside at least one of them.

    Corners and edges that only touch corners and edges do not count, and triangles that share an
    edge never cross.
    """
    shared = 0
    for i in range(3):
        for j in range(3):
            shared += a[i] == b[j]
    if shared > 1:
        return False
    b0 = _above(x, a[0], a[1], a[2], b[0])
    b1 = _above(x, a[0], a[1], a[2], b[1])
    b2 = _above(x, a[0], a[1], a[2], b[2])
    low_b, high_b = min(b0, b1, b2), max(b0, b1, b2)
    if low_b > 0 or high_b < 0:
        return False
    a0 = _above(x, b[0], b[1], b[2], a[0])
    a1 = _above(x, b[0], b[1], b[2], a[1])
    a2 = _above(x, b[0], b[1], b[2], a[2])
    low_a, high_a = min(a0, a1, a2), max(a0, a1, a2)
    if low_a > 0 or high_a < 0:
        return False
    if low_b == high_b or low_a == high_a:  # all 0
        return _overlap(x, a, b)
    if low_a * high_a >= 0 and low_b * high_b >= 0:
        return False  # neither has points on both sides of the other: edge on edge
    i, a_is_above = _alone(a0, a1, a2)
    j, b_is_above = _alone(b0, b1, b2)
    p, q, r = a[i], a[(i + 1) % 3], a[(i + 2) % 3]
    s, t, u = b[j], b[(j + 1) % 3], b[(j + 2) % 3]
    if not a_is_above:
        t, u = u, t
    if not b_is_above:
        q, r = r, q
    # on the line that both planes share, each triangle covers an interval; they must overlap
    return _above(x, p, q, s, t) < 0 and _above(x, p, r, u, s) < 0


@_compiled
def _alone(s0: int, s1: int, s2: int) -> tuple[int, bool]:
    """Which corner is on one side of a plane, the others being on it or beyond; is it above?

    Either of both ends of an edge from that corner is off the plane.
    """
    for sign in (1, -1):
        if (s0 == sign) + (s1 == sign) + (s2 == sign) == 1:
            return (0 if s0 == sign else 1 if s1 == sign else 2), sign == 1
    return (0 if s0 == 0 else 1 if s1 == 0 else 2), s0 + s1 + s2 < 0


@_compiled
def _overlap(x: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two triangles in one plane have area in common: no side of one separates them."""
    n = np.cross(x[a[1]] - x[a[0]], x[a[2]] - x[a[0]])
    n = np.abs(n)
    drop = 0 if n[0] >= n[1] and n[0] >= n[2] else 1 if n[1] >= n[2] else 2
    u, v = (drop + 1) % 3, (drop + 2) % 3
    for one, other in ((a, b), (b, a)):
        turn = _left(x, u, v, one[0], one[1], one[2])
        for i in range(3):
            is_inside = False
            for k in range(3):
                is_inside |= turn * _left(x, u, v, one[i], one[(i + 1) % 3], other[k]) > 0
            if not is_inside:
                return False
    return True


@_compiled
def _above(x: np.ndarray, a: int, b: int, c: int, d: int) -> int:
    """On which side of the plane through a, b, c, counter-clockwise from above, d lies."""
    ax, ay, az = x[a, 0] - x[d, 0], x[a, 1] - x[d, 1], x[a, 2] - x[d, 2]
    bx, by, bz = x[b, 0] - x[d, 0], x[b, 1] - x[d, 1], x[b, 2] - x[d, 2]
    cx, cy, cz = x[c, 0] - x[d, 0], x[c, 1] - x[d, 1], x[c, 2] - x[d, 2]
    bc, cb = bx * cy, cx * by
    ca, ac = cx * ay, ax * cy
    ab, ba = ax * by, bx * ay
    below = az * (bc - cb) + bz * (ca - ac) + cz * (ab - ba)
    size = (
        (abs(bc) + abs(cb)) * abs(az)
        + (abs(ca) + abs(ac)) * abs(bz)
        + (abs(ab) + abs(ba)) * abs(cz)
    )
    reach = max(abs(ax), abs(ay), abs(az), abs(bx), abs(by), abs(bz), abs(cx), abs(cy), abs(cz))
    bound = _BOUND_3D * size + 36 * _ROUNDED * reach * reach  # 18 differences, each of two
    return int(below < -bound) - int(below > bound)


@_compiled
def _left(x: np.ndarray, u: int, v: int, a: int, b: int, c: int) -> int:
    """In the plane of two coordinates, on which side of the line from a to b c lies."""
    au, av, bu, bv = x[a, u] - x[c, u], x[a, v] - x[c, v], x[b, u] - x[c, u], x[b, v] - x[c, v]
    one, other = au * bv, av * bu
    reach = abs(au) + abs(av) + abs(bu) + abs(bv)
    bound = _BOUND_2D * (abs(one) + abs(other)) + 2 * _ROUNDED * reach
    return int(one - other > bound) - int(one - other < -bound)


@_compiled
def _box(x: np.ndarray, face: np.ndarray) -> tuple[float, float, float, float, float, float]:
    a, b, c = x[face[0]], x[face[1]], x[face[2]]
    return (
        min(a[0], b[0], c[0]),
        min(a[1], b[1], c[1]),
        min(a[2], b[2], c[2]),
        max(a[0], b[0], c[0]),
        max(a[1], b[1], c[1]),
        max(a[2], b[2], c[2]),
    )
