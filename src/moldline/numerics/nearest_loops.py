"""Compiled loops of the nearest points of triangles."""

import numba
import numpy as np

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy")


@_compiled
def nearest(places, corners, squares, weights, owners, part, start, stop):
    """Of triangles (f, 3, 3) the nearest to each place: squared distance, barycentric weights."""
    w = np.empty(3)
    for n in range(start, stop):
        best = np.inf
        for f in range(len(corners)):
            square = _towards(places[n], corners[f], w)
            if square < best:
                best = square
                owners[n] = f
                weights[n] = w
        squares[n] = best


@_compiled
def _towards(place, triangle, w):
    """Squared distance of a place from a triangle, and the nearest point's weights.

    Source: Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
    """
    a, b, c = triangle[0], triangle[1], triangle[2]
    ab0, ab1, ab2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    ac0, ac1, ac2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    ap0, ap1, ap2 = place[0] - a[0], place[1] - a[1], place[2] - a[2]
    d1 = ab0 * ap0 + ab1 * ap1 + ab2 * ap2
    d2 = ac0 * ap0 + ac1 * ap1 + ac2 * ap2
    bb = ab0 * ab0 + ab1 * ab1 + ab2 * ab2
    bc = ab0 * ac0 + ab1 * ac1 + ab2 * ac2
    cc = ac0 * ac0 + ac1 * ac1 + ac2 * ac2
    d3, d4, d5, d6 = d1 - bb, d2 - bc, d1 - bc, d2 - cc
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v, u = 0.0, 0.0
    if d1 <= 0 and d2 <= 0:
        pass
    elif d3 >= 0 and d4 <= d3:
        v = 1.0
    elif vc <= 0 and d1 >= 0 and d3 <= 0:
        v = d1 / (d1 - d3)
    elif d6 >= 0 and d5 <= d6:
        u = 1.0
    elif vb <= 0 and d2 >= 0 and d6 <= 0:
        u = d2 / (d2 - d6)
    elif va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        u = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - u
    else:
        total = va + vb + vc
        v, u = vb / total, vc / total
    w[0], w[1], w[2] = 1.0 - v - u, v, u
    r0 = ap0 - v * ab0 - u * ac0
    r1 = ap1 - v * ab1 - u * ac1
    r2 = ap2 - v * ab2 - u * ac2
    return r0 * r0 + r1 * r1 + r2 * r2
