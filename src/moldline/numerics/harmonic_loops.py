"""The compiled loops of `harmonic`: weights of a cage's vertices at points."""

import numba
import numpy as np

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})

STEPS = 100
"""Of Newton's method at most, for one point."""

BALANCED = 1e-14
"""A point is met where its shares miss it by less, in cells."""

ENOUGH = 1e-11
"""What a point on the cage, or outside by rounding, may be missed by, in cells."""

QUADRATIC = 0.5
"""Below this square of Newton's decrement the whole step is taken."""

EDGE_ON = 1e-10
"""A triangle that a line sees under so small a part of its size has no place where they meet."""

PIVOT = 1e-16
"""Least pivot of a covariance; of a point on the cage it is singular."""

SPREAD = 5.0
"""How far apart the sites around a point are, about, in cells."""


@_compiled
def _solved(h: np.ndarray, g: np.ndarray, out: np.ndarray) -> None:
    """Solve h out = g for a symmetric positive 3x3 matrix, given as xx, xy, xz, yy, yz, zz."""
    a = np.sqrt(max(h[0], PIVOT))
    b, c = h[1] / a, h[2] / a
    d = np.sqrt(max(h[3] - b * b, PIVOT))
    e = (h[4] - b * c) / d
    f = np.sqrt(max(h[5] - c * c - e * e, PIVOT))
    u = g[0] / a
    v = (g[1] - b * u) / d
    w = (g[2] - c * u - e * v) / f
    out[2] = w / f
    out[1] = (v - e * out[2]) / d
    out[0] = (u - b * out[1] - c * out[2]) / a


@_compiled
def tilt(prior: np.ndarray, off: np.ndarray, share: np.ndarray) -> float:
    """Shares of sites that are off a point by `off` and whose mean is the point.

    Of all such shares those nearest to `prior` by relative entropy, prior exp(pull . off) / sum.
    Returns what the mean is off by.
    """
    pull, g, h, step = np.zeros(3), np.empty(3), np.empty(6), np.empty(3)
    miss = np.inf
    for _ in range(STEPS):
        top = -np.inf
        for k in range(27):
            share[k] = pull[0] * off[k, 0] + pull[1] * off[k, 1] + pull[2] * off[k, 2]
            if prior[k] > 0:
                top = max(top, share[k])
        total = 0.0
        for k in range(27):
            share[k] = prior[k] * np.exp(share[k] - top) if prior[k] > 0 else 0.0
            total += share[k]
        g[:] = 0.0
        h[:] = 0.0
        for k in range(27):
            share[k] /= total
            a, x, y, z = share[k], off[k, 0], off[k, 1], off[k, 2]
            g[0] += a * x
            g[1] += a * y
            g[2] += a * z
            h[0] += a * x * x
            h[1] += a * x * y
            h[2] += a * x * z
            h[3] += a * y * y
            h[4] += a * y * z
            h[5] += a * z * z
        miss = max(abs(g[0]), abs(g[1]), abs(g[2]))
        if miss <= BALANCED or not miss < np.inf:
            break
        h[0] -= g[0] * g[0]
        h[1] -= g[0] * g[1]
        h[2] -= g[0] * g[2]
        h[3] -= g[1] * g[1]
        h[4] -= g[1] * g[2]
        h[5] -= g[2] * g[2]
        _solved(h, g, step)
        decrement = g[0] * step[0] + g[1] * step[1] + g[2] * step[2]
        length = SPREAD * np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
        damped = np.log1p(length) / length if decrement > QUADRATIC else 1.0
        for i in range(3):
            pull[i] -= damped * step[i]
    return miss


@_compiled
def between(
    u: np.ndarray, spacing: np.ndarray, corners: np.ndarray, faces: np.ndarray, out: np.ndarray
) -> None:
    """Weights at a point from where the three lines through it, along the axes, meet the cage.

    They are positive and have the point as their mean; as in the stencil of a node, near hits
    count most, so that a point on the cage has the weights of its triangle. NaN where no line meets
    the cage on both sides.
    """
    gap, face = np.full(6, np.inf), np.full(6, -1, np.int64)
    share, e = np.empty((6, 3)), np.empty(3)
    for f in range(len(faces)):
        for axis in range(3):
            b, c = (axis + 1) % 3, (axis + 2) % 3
            for k in range(3):
                p, q = corners[faces[f, (k + 1) % 3]], corners[faces[f, (k + 2) % 3]]
                e[k] = (p[b] - u[b]) * (q[c] - u[c]) - (p[c] - u[c]) * (q[b] - u[b])
            total = e[0] + e[1] + e[2]
            size = 0.0
            for k in range(3):
                p, q = corners[faces[f, k]], corners[faces[f, (k + 1) % 3]]
                size += (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2
            if abs(total) <= EDGE_ON * size:
                continue
            if min(e[0] / total, e[1] / total, e[2] / total) < -ENOUGH:
                continue
            distance = 0.0
            for k in range(3):
                distance += e[k] / total * (corners[faces[f, k], axis] - u[axis])
            s = 2 * axis + (distance > 0)
            if abs(distance) < gap[s]:
                gap[s], face[s] = abs(distance), f
                for k in range(3):
                    share[s, k] = max(e[k] / total, 0.0)
    out[:] = 0.0
    total = 0.0
    for s in range(6):
        if face[s] >= 0 and (face[s ^ 1] >= 0 or gap[s] <= ENOUGH):
            near, far = max(gap[s], 1e-14), max(gap[s ^ 1], 1e-14) if face[s ^ 1] >= 0 else 1.0
            part = 1.0 / (spacing[s // 2] ** 2 * near * (near + far))
            total += part
            for k in range(3):
                out[faces[face[s], k]] += part * share[s, k]
    out /= total if total > 0 else np.nan


@_compiled
def _basis(t: float, out: np.ndarray) -> None:
    out[0], out[1], out[2] = 0.5 * (0.5 - t) ** 2, 0.75 - t * t, 0.5 * (0.5 + t) ** 2


@_compiled
def _around(
    point: np.ndarray, origin: np.ndarray, spacing: np.ndarray, site: np.ndarray,
    u: np.ndarray, first: np.ndarray, basis: np.ndarray, rows: np.ndarray, prior: np.ndarray,
) -> int:  # fmt: skip
    """A point's place in cells, the 27 sites around it, and their shares by the spline.

    Returns the largest number of a site, -1 where one of them does not exist.
    """
    known = True
    for d in range(3):
        u[d] = (point[d] - origin[d]) / spacing[d]
        known &= 1.0 <= u[d] <= site.shape[d] - 2.0
        if known:
            first[d] = int(np.floor(u[d] + 0.5)) - 1
            _basis(u[d] - first[d] - 1, basis[d])
    if not known:
        return -1
    most = -1
    for k in range(27):
        x, y, z = k // 9, k // 3 % 3, k % 3
        prior[k] = basis[0, x] * basis[1, y] * basis[2, z]
        rows[k] = site[first[0] + x, first[1] + y, first[2] + z]
        most = max(most, rows[k])
        known &= rows[k] >= 0
    return most if known else -1


@_compiled
def look_up(
    points: np.ndarray, origin: np.ndarray, spacing: np.ndarray, site: np.ndarray,
    sites: np.ndarray, inside: int, values: np.ndarray, corners: np.ndarray, faces: np.ndarray,
    out: np.ndarray, kind: np.ndarray, part: int, start: int, stop: int,
) -> None:  # fmt: skip
    """Weights (n, m) at points, and how each was found: 0 by nodes alone, 1 tilted, 2 `between`.

    `site` numbers the nodes and is -1 where there is none; `sites` are their places in cells, the
    first `inside` of them being the nodes themselves, and `values` their weights.
    """
    basis, prior, share = np.empty((3, 3)), np.empty(27), np.empty(27)
    rows, off = np.empty(27, np.int64), np.empty((27, 3))
    u, first = np.empty(3), np.empty(3, np.int64)
    columns = values.shape[1]
    for p in range(start, stop):
        most = _around(points[p], origin, spacing, site, u, first, basis, rows, prior)
        result = out[p]
        if most < 0:
            kind[p] = 2
            between(u, spacing, corners, faces, result)
            continue
        weight = prior
        kind[p] = 0
        if most >= inside:
            kind[p] = 1
            for k in range(27):
                for d in range(3):
                    off[k, d] = sites[rows[k], d] - u[d]
            if not tilt(prior, off, share) <= ENOUGH:
                kind[p] = 2
                between(u, spacing, corners, faces, result)
                continue
            weight = share
        result[:] = 0.0
        for k in range(27):
            a, row = weight[k], values[rows[k]]
            for j in range(columns):
                result[j] += a * row[j]


@_compiled
def _tilted_slopes(
    slope: np.ndarray, prior: np.ndarray, share: np.ndarray, off: np.ndarray
) -> None:
    """Turn slopes of the prior shares (27, 3), by the place, into those of the tilted ones.

    The pull changes with the place so that the shares' mean goes on being the point.
    """
    h, given, pull = np.zeros(6), np.empty(3), np.empty(3)
    for k in range(27):
        a, x, y, z = share[k], off[k, 0], off[k, 1], off[k, 2]
        h[0] += a * x * x
        h[1] += a * x * y
        h[2] += a * x * z
        h[3] += a * y * y
        h[4] += a * y * z
        h[5] += a * z * z
    for d in range(3):
        given[:] = 0.0
        given[d] = 1.0
        mean = 0.0
        for k in range(27):
            slope[k, d] *= share[k] / prior[k] if prior[k] > 0 else 0.0
            mean += slope[k, d]
            for i in range(3):
                given[i] -= slope[k, d] * off[k, i]
        _solved(h, given, pull)
        for k in range(27):
            along = pull[0] * off[k, 0] + pull[1] * off[k, 1] + pull[2] * off[k, 2]
            slope[k, d] += share[k] * (along - mean)


@_compiled
def slopes(
    points: np.ndarray, origin: np.ndarray, spacing: np.ndarray, site: np.ndarray,
    sites: np.ndarray, inside: int, values: np.ndarray, corners: np.ndarray, faces: np.ndarray,
    out: np.ndarray, kind: np.ndarray, part: int, start: int, stop: int,
) -> None:  # fmt: skip
    """Derivatives (n, c, 3) by the place of what `values` (sites, c) are; 0 where `kind` is 2."""
    basis, steep, prior, share = np.empty((3, 3)), np.empty((3, 3)), np.empty(27), np.empty(27)
    rows, off, slope = np.empty(27, np.int64), np.empty((27, 3)), np.empty((27, 3))
    u, first = np.empty(3), np.empty(3, np.int64)
    for p in range(start, stop):
        out[p] = 0.0
        most = _around(points[p], origin, spacing, site, u, first, basis, rows, prior)
        kind[p] = 2 if most < 0 else int(most >= inside)
        if kind[p] == 1:
            for k in range(27):
                for d in range(3):
                    off[k, d] = sites[rows[k], d] - u[d]
            if not tilt(prior, off, share) <= ENOUGH:
                kind[p] = 2
        if kind[p] == 2:
            continue
        for d in range(3):
            t = u[d] - first[d] - 1
            steep[d, 0], steep[d, 1], steep[d, 2] = t - 0.5, -2 * t, t + 0.5
        for k in range(27):
            x, y, z = k // 9, k // 3 % 3, k % 3
            slope[k, 0] = steep[0, x] * basis[1, y] * basis[2, z]
            slope[k, 1] = basis[0, x] * steep[1, y] * basis[2, z]
            slope[k, 2] = basis[0, x] * basis[1, y] * steep[2, z]
        if kind[p] == 1:
            _tilted_slopes(slope, prior, share, off)
        for k in range(27):
            for j in range(values.shape[1]):
                for d in range(3):
                    out[p, j, d] += slope[k, d] * values[rows[k], j] / spacing[d]
