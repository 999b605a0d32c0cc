"""The compiled loops of `inversion`; what is compiled is kept on disk."""

import numba
import numpy as np

from .cellwise_loops import _cell

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})

LIMIT = 60
"""Newton steps from one start."""

HALVINGS = 12
"""Of a step that does not bring the point nearer."""


@_compiled
def _map(terms, starts, offsets, scales, table, u, value, slope):
    """Place of box coordinates u, and its slopes: row place, column coordinate."""
    P, Q, R = len(terms[0]), len(terms[1]), len(terms[2])
    i, j, k = _cell(u[0], starts[0]), _cell(u[1], starts[1]), _cell(u[2], starts[2])
    sx, sy, sz = scales[0][i], scales[1][j], scales[2][k]
    x = (u[0] - offsets[0][i]) * sx
    y = (u[1] - offsets[1][j]) * sy
    z = (u[2] - offsets[2][k]) * sz
    c = table[(i * len(starts[1]) + j) * len(starts[2]) + k]
    for d in range(3):
        f = fx = fy = fz = 0.0
        for a in range(P - 1, -1, -1):
            g = gy = gz = 0.0
            for b in range(Q - 1, -1, -1):
                h = hz = 0.0
                for r in range(R - 1, -1, -1):
                    hz = hz * z + h
                    h = h * z + c[d, a, b, r]
                gy = gy * y + g
                gz = gz * y + hz
                g = g * y + h
            fx = fx * x + f
            fy = fy * x + gy
            fz = fz * x + gz
            f = f * x + g
        value[d] = f
        slope[d, 0], slope[d, 1], slope[d, 2] = fx * sx, fy * sy, fz * sz


@_compiled
def _solved(a, b, out):
    """Solve a 3x3 system by Cramer's rule; False where it is singular to rounding."""
    c0 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
    c1 = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c2 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
    det = a[0, 0] * c0 + a[0, 1] * c1 + a[0, 2] * c2
    size = 1.0
    for i in range(3):
        size *= np.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)
    if not abs(det) > 1e-12 * size:
        return False
    out[0] = (
        b[0] * c0
        + b[1] * (a[0, 2] * a[2, 1] - a[0, 1] * a[2, 2])
        + b[2] * (a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1])
    ) / det
    out[1] = (
        b[0] * c1
        + b[1] * (a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0])
        + b[2] * (a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2])
    ) / det
    out[2] = (
        b[0] * c2
        + b[1] * (a[0, 1] * a[2, 0] - a[0, 0] * a[2, 1])
        + b[2] * (a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0])
    ) / det
    return True


@_compiled
def _step(slope, miss, free, normal, right, step):
    """The step that Newton's method takes along the free coordinates, in the least squares."""
    if free[0] and free[1] and free[2] and _solved(slope, miss, step):
        return
    trace = 0.0
    for i in range(3):
        right[i] = 0.0
        for j in range(3):
            normal[i, j] = 0.0
            if free[i] and free[j]:
                for d in range(3):
                    normal[i, j] += slope[d, i] * slope[d, j]
        if free[i]:
            for d in range(3):
                right[i] += slope[d, i] * miss[d]
            trace += normal[i, i]
    for i in range(3):
        normal[i, i] += 1e-14 * trace if free[i] else 1.0
    if not _solved(normal, right, step):
        for i in range(3):  # along the gradient: a collapsed edge or face
            step[i] = right[i] / trace if trace > 0.0 else 0.0


@_compiled
def invert(terms, starts, offsets, scales, table, acts, points, tiny, u, miss, steps,
    part, start, stop):  # fmt: skip
    """Bring the box coordinates u of each point to where the map meets it, or comes nearest.

    `acts` tells which coordinates the map depends on, `tiny` is a distance that is no distance.
    """
    value, slope, gap = np.empty(3), np.empty((3, 3)), np.empty(3)
    trial, trial_value = np.empty(3), np.empty(3)
    trial_slope, normal, right, step = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    free = np.empty(3, np.bool_)
    for p in range(start, stop):
        at = u[p]
        _map(terms, starts, offsets, scales, table, at, value, slope)
        best = 0.0
        for d in range(3):
            gap[d] = points[p, d] - value[d]
            best += gap[d] * gap[d]
        for n in range(LIMIT):
            steps[p] = n
            if best <= tiny * tiny:
                break
            for i in range(3):
                pull = slope[0, i] * gap[0] + slope[1, i] * gap[1] + slope[2, i] * gap[2]
                held = (at[i] <= 0.0 and pull < 0.0) or (at[i] >= 1.0 and pull > 0.0)
                free[i] = acts[i] and not held
            _step(slope, gap, free, normal, right, step)
            better, length = False, 1.0
            for _ in range(HALVINGS):
                for i in range(3):
                    trial[i] = min(1.0, max(0.0, at[i] + length * step[i])) if free[i] else at[i]
                _map(terms, starts, offsets, scales, table, trial, trial_value, trial_slope)
                now = 0.0
                for d in range(3):
                    now += (points[p, d] - trial_value[d]) ** 2
                if now < best:
                    better = True
                    break
                length *= 0.5
            if not better:
                break
            gained = best - now
            best = now
            at[:] = trial
            slope[:] = trial_slope
            for d in range(3):
                gap[d] = points[p, d] - trial_value[d]
            if gained < 1e-10 * best:
                break
        miss[p] = np.sqrt(best)
