"""Compiled loops of the closest pair of two triangulations."""

import numba
import numpy as np

from .nearest_loops import _towards

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy")

DEEP = 128
"""Boxes that wait in a search; a tree of halves has fewer levels than half as many."""


@_compiled
def grow(corners, leaf):
    """Boxes around triangles (n, 3, 3), each halved until `leaf` are left; a tree from the root.

    Returns the triangles' order, lows and highs of the boxes, where each box's triangles begin and
    end in that order, and its first child or -1; the second follows it.
    """
    count = len(corners)
    order = np.arange(count)
    centres = (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3
    low, high = np.empty((2 * count, 3)), np.empty((2 * count, 3))
    start, stop = np.zeros(2 * count, np.int64), np.zeros(2 * count, np.int64)
    child = np.full(2 * count, -1)
    stop[0], boxes, box = count, 1, 0
    while box < boxes:
        own = order[start[box] : stop[box]]
        for k in range(3):
            low[box, k], high[box, k] = np.inf, -np.inf
        first, last = np.full(3, np.inf), np.full(3, -np.inf)
        for f in own:
            for k in range(3):
                first[k] = min(first[k], centres[f, k])
                last[k] = max(last[k], centres[f, k])
                for i in range(3):
                    low[box, k] = min(low[box, k], corners[f, i, k])
                    high[box, k] = max(high[box, k], corners[f, i, k])
        if len(own) > leaf:
            axis = np.argmax(last - first)
            order[start[box] : stop[box]] = own[np.argsort(centres[own, axis])]
            middle = (start[box] + stop[box]) // 2
            child[box] = boxes
            start[boxes], stop[boxes] = start[box], middle
            start[boxes + 1], stop[boxes + 1] = middle, stop[box]
            boxes += 2
        box += 1
    return order, low[:boxes], high[:boxes], start[:boxes], stop[:boxes], child[:boxes]


@_compiled
def closest(triangles, corners, tree, squares, pairs, weights, part, begin, end):
    """Of triangles and those of a tree the closest two: squared distance, numbers, weights.

    Each part writes its own; zero, with the pair that does, where two run through each other.
    """
    order, low, high, start, stop, child = tree
    best, own = np.inf, np.empty((2, 3))
    waiting, box_low, box_high = np.empty(DEEP, np.int64), np.empty(3), np.empty(3)
    for step in range(begin, end):
        one = triangles[step]
        for k in range(3):
            box_low[k] = min(one[0, k], one[1, k], one[2, k])
            box_high[k] = max(one[0, k], one[1, k], one[2, k])
        waiting[0], depth = 0, 1
        while depth > 0 and best > 0:
            depth -= 1
            box = waiting[depth]
            if _apart(box_low, box_high, low[box], high[box]) >= best:
                continue
            if child[box] >= 0:
                near, far = child[box], child[box] + 1
                if _apart(box_low, box_high, low[far], high[far]) < _apart(
                    box_low, box_high, low[near], high[near]
                ):
                    near, far = far, near
                waiting[depth], waiting[depth + 1] = far, near
                depth += 2
                continue
            for f in order[start[box] : stop[box]]:
                square = _between(one, corners[f], own)
                if square < best:
                    best = square
                    pairs[part, 0], pairs[part, 1] = step, f
                    weights[part] = own
    squares[part] = best


@_compiled
def nearest_in_tree(places, corners, tree, squares, weights, owners, part, begin, end):
    """Of a tree's triangles the nearest to each place: squared distance, barycentric weights."""
    order, low, high, start, stop, child = tree
    waiting, w = np.empty(DEEP, np.int64), np.empty(3)
    for n in range(begin, end):
        place, best = places[n], np.inf
        waiting[0], depth = 0, 1
        while depth > 0:
            depth -= 1
            box = waiting[depth]
            if _apart(place, place, low[box], high[box]) >= best:
                continue
            if child[box] >= 0:
                near, far = child[box], child[box] + 1
                if _apart(place, place, low[far], high[far]) < _apart(
                    place, place, low[near], high[near]
                ):
                    near, far = far, near
                waiting[depth], waiting[depth + 1] = far, near
                depth += 2
                continue
            for f in order[start[box] : stop[box]]:
                square = _towards(place, corners[f], w)
                if square < best:
                    best = square
                    owners[n] = f
                    weights[n] = w
        squares[n] = best


@_compiled
def _apart(low, high, other_low, other_high):
    """Squared distance of two boxes."""
    total = 0.0
    for k in range(3):
        gap = max(low[k] - other_high[k], other_low[k] - high[k])
        if gap > 0:
            total += gap * gap
    return total


@_compiled
def _between(one, other, weights):
    """Squared distance of two triangles, and the weights of the closest points of each."""
    best, w = np.inf, np.empty(3)
    for i in range(3):
        square = _towards(one[i], other, w)
        if square < best:
            best = square
            weights[0] = 0.0
            weights[0, i] = 1.0
            weights[1] = w
        square = _towards(other[i], one, w)
        if square < best:
            best = square
            weights[0] = w
            weights[1] = 0.0
            weights[1, i] = 1.0
    for i in range(3):
        for j in range(3):
            if _pierces(one[i], one[(i + 1) % 3], other) or _pierces(
                other[j], other[(j + 1) % 3], one
            ):
                return 0.0
            square, s, t = _between_edges(one[i], one[(i + 1) % 3], other[j], other[(j + 1) % 3])
            if square < best:
                best = square
                weights[:] = 0.0
                weights[0, i], weights[0, (i + 1) % 3] = 1 - s, s
                weights[1, j], weights[1, (j + 1) % 3] = 1 - t, t
    return best


@_compiled
def _between_edges(p, q, r, s):
    """Squared distance of two segments where it is between their insides, else infinite.

    Source: Ericson, Real-Time Collision Detection, 2005, section 5.1.9.
    """
    a, b, c, d, e = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        u, v, w = q[k] - p[k], s[k] - r[k], p[k] - r[k]
        a += u * u
        b += u * v
        c += v * v
        d += u * w
        e += v * w
    total = a * c - b * b
    if total <= 1e-14 * a * c:  # parallel: an end is as near
        return np.inf, 0.0, 0.0
    x, y = (b * e - c * d) / total, (a * e - b * d) / total
    if not (0.0 < x < 1.0 and 0.0 < y < 1.0):
        return np.inf, 0.0, 0.0
    square = 0.0
    for k in range(3):
        gap = p[k] + x * (q[k] - p[k]) - r[k] - y * (s[k] - r[k])
        square += gap * gap
    return square, x, y


@_compiled
def _pierces(p, q, triangle):
    """Whether a segment runs through a triangle."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    above, below = _volume(a, b, c, p), _volume(a, b, c, q)
    if above * below >= 0:
        return False
    first, second, third = _volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)
    return (first > 0) == (second > 0) and (second > 0) == (third > 0)


@_compiled
def _volume(a, b, c, d):
    """Six times the volume of a tetrahedron."""
    u0, u1, u2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    v0, v1, v2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    w0, w1, w2 = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    return u0 * (v1 * w2 - v2 * w1) + u1 * (v2 * w0 - v0 * w2) + u2 * (v0 * w1 - v1 * w0)
