"""Compiled loops of mean value coordinates."""

import numba
import numpy as np

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy")

CLOSE = 1e-14
"""A point this near to a vertex, in sizes of the cage, lies on it."""

STRAIGHT = 1e-13
"""Sine below which two corners are seen in one direction, or in opposite ones."""

FLAT = 1e-15
"""Volume below which three directions lie in a plane."""

SMALL = 1e-3
"""Below it a series takes the place of arcsin(x) / x."""


@_compiled
def weights(points, corners, faces, sides, edges, size, out, part, start, stop):
    """Weights of the corners at points, on whatever side of the cage they are.

    `edges` are pairs of corners, and `sides` the edge opposite each corner of each face.
    """
    unit, length = np.empty((len(corners), 3)), np.empty(len(corners))
    angle, sine = np.empty(len(edges)), np.empty(len(edges))
    for n in range(start, stop):
        own = out[n]
        own[:] = 0.0
        at_corner = _seen(points[n], corners, CLOSE * size, unit, length)
        if at_corner >= 0:
            own[at_corner] = 1.0
            continue
        for e in range(len(edges)):
            angle[e], sine[e] = _between(unit[edges[e, 0]], unit[edges[e, 1]])
        for t in range(len(faces)):
            if _add(faces[t], sides[t], unit, length, angle, sine, own):
                break
        total = own.sum()
        for j in range(len(corners)):
            own[j] /= total


@_compiled
def _seen(place, corners, close, unit, length):
    """Directions and distances of the corners; the number of one that is too close, else -1."""
    for j in range(len(corners)):
        x, y, z = corners[j, 0] - place[0], corners[j, 1] - place[1], corners[j, 2] - place[2]
        length[j] = np.sqrt(x * x + y * y + z * z)
        if length[j] <= close:
            return j
        unit[j, 0], unit[j, 1], unit[j, 2] = x / length[j], y / length[j], z / length[j]
    return -1


@_compiled
def _between(u, v):
    """The angle between unit vectors, exact near 0 and pi too, and its sine."""
    apart, along = 0.0, 0.0
    for d in range(3):
        apart += (u[d] - v[d]) ** 2
        along += (u[d] + v[d]) ** 2
    apart, along = np.sqrt(apart), np.sqrt(along)
    return 2 * np.arctan2(apart, along), 2 * apart * along / (apart * apart + along * along)


@_compiled
def _add(face, side, unit, length, angle, sine, own):
    """Add a face's weights; whether the point lies on it, which leaves no others.

    The sides a, b, c of the spherical triangle have the half sum s, and its corners span the volume
    2 sqrt(sin s sin(s-a) sin(s-b) sin(s-c)). Near a face's plane, outside the face, sin(s-a) of the
    longest side is lost to rounding, but the volume is not: there the one follows from the other.
    """
    i = 0
    for k in range(1, 3):
        if angle[side[k]] > angle[side[i]]:
            i = k
    j, k = (i + 1) % 3, (i + 2) % 3
    a, b, c = angle[side[i]], angle[side[j]], angle[side[k]]
    sin_a, sin_b, sin_c = sine[side[i]], sine[side[j]], sine[side[k]]
    if a > 2 and sin_a < STRAIGHT:  # on the edge
        own[:] = 0.0
        own[face[j]], own[face[k]] = 1 / length[face[j]], 1 / length[face[k]]
        return True
    if min(sin_a, sin_b, sin_c) < STRAIGHT:
        return False  # on an edge's line, beyond it
    volume = _spanned(unit[face[i]], unit[face[j]], unit[face[k]])
    half = (a + b + c) / 2
    whole, less_a = np.sin(half), np.sin(half - a)
    less_b, less_c = np.sin(half - b), np.sin(half - c)
    is_on = whole < less_a and abs(volume) < FLAT
    if is_on:
        own[:], volume = 0.0, 1.0
    if whole < less_a:
        over_a = 2 * whole * less_a / (sin_b * sin_c) - 1
        over_b = 2 * whole * less_b / (sin_a * sin_c) - 1
        over_c = 2 * whole * less_c / (sin_a * sin_b) - 1
        at_a = a - b * over_c - c * over_b
        at_b = b - a * over_c - c * over_a
        at_c = c - a * over_b - b * over_a
        scale = 1 / (2 * volume)
    else:
        scale = volume / (4 * whole * less_b * less_c)
        x = scale * volume  # sin(s-a)
        ratio = np.arcsin(x) / x if x > SMALL else 1 + x * x * (1 / 6 + x * x * (3 / 40))
        at_a = b * less_b / (sin_a * sin_b) + c * less_c / (sin_a * sin_c) - ratio
        at_b = a * less_b / (sin_a * sin_b) - c * whole / (sin_b * sin_c) + ratio
        at_c = a * less_c / (sin_a * sin_c) - b * whole / (sin_b * sin_c) + ratio
    own[face[i]] += scale * at_a * sin_a / length[face[i]]
    own[face[j]] += scale * at_b * sin_b / length[face[j]]
    own[face[k]] += scale * at_c * sin_c / length[face[k]]
    return is_on


@_compiled
def _spanned(u, v, w):
    """Volume of the parallelepiped of three vectors."""
    return (
        u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
    )
