"""The compiled loops of `multigrid`: a few right-hand sides at a time, side by side in memory."""

import numba
import numpy as np

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})

WIDTH = 8
"""Right-hand sides that are solved together: one line of the cache."""

SWEEPS = 40
"""On the coarsest grid."""


@_compiled
def average(near: np.ndarray, gap: np.ndarray, share: np.ndarray, stiffness: np.ndarray) -> None:
    """Shares of the neighbours in the average that a node is, from their distances.

    Along each axis they are those of the second difference on uneven spacing, 2 / (d (d + e)).
    """
    for i in range(len(near)):
        total = 0.0
        for s in range(6):
            share[i, s] = 2.0 / (gap[i, s] * (gap[i, s] + gap[i, s ^ 1]))
            total += share[i, s]
        for s in range(6):
            share[i, s] /= total
        stiffness[i] = total


@_compiled
def coarsen(
    near: np.ndarray,
    gap: np.ndarray,
    axis: int,
    coarse: np.ndarray,
    near_out: np.ndarray,
    gap_out: np.ndarray,
) -> None:
    """Links between every second node along an axis: one link, or two where nothing cuts them.

    `coarse` numbers the nodes that remain, -1 elsewhere.
    """
    for i in range(len(near)):
        row = coarse[i]
        if row < 0:
            continue
        for s in range(6):
            j, distance = near[i, s], gap[i, s]
            if s // 2 == axis and j >= 0:
                distance += gap[j, s]
                j = near[j, s]
            near_out[row, s] = coarse[j] if j >= 0 else -1
            gap_out[row, s] = distance


@_compiled
def _relax(
    near: np.ndarray, share: np.ndarray, f: np.ndarray, w: np.ndarray, first: int, last: int
) -> None:
    """Replace every value by the average of its neighbours, from row `first` to before `last`."""
    step = 1 if last > first else -1
    t = np.empty(WIDTH)
    for i in range(first, last, step):
        for q in range(WIDTH):
            t[q] = f[i, q]
        for s in range(6):
            j = near[i, s]
            if j >= 0:
                a = share[i, s]
                for q in range(WIDTH):
                    t[q] += a * w[j, q]
        for q in range(WIDTH):
            w[i, q] = t[q]


@_compiled
def _add_residual(
    near: np.ndarray, share: np.ndarray, f: np.ndarray, w: np.ndarray, i: int, scale: float,
    out: np.ndarray,
) -> None:  # fmt: skip
    for q in range(WIDTH):
        out[q] += scale * (f[i, q] - w[i, q])
    for s in range(6):
        j = near[i, s]
        if j >= 0:
            a = scale * share[i, s]
            for q in range(WIDTH):
                out[q] += a * w[j, q]


@_compiled
def _restrict(
    near: np.ndarray, share: np.ndarray, stiffness: np.ndarray, f: np.ndarray, w: np.ndarray,
    axis: int, coarse: np.ndarray, stiffness_out: np.ndarray, f_out: np.ndarray, w_out: np.ndarray,
) -> None:  # fmt: skip
    """The right-hand side of the coarser grid, half the transpose of `_prolong`; from zero on."""
    for i in range(len(near)):
        row = coarse[i]
        if row < 0:
            continue
        out = f_out[row]
        out[:] = 0.0
        w_out[row] = 0.0
        _add_residual(near, share, f, w, i, 0.5 * stiffness[i] / stiffness_out[row], out)
        for s in range(2 * axis, 2 * axis + 2):
            j = near[i, s]
            if j >= 0:
                part = share[j, s ^ 1] / (share[j, s] + share[j, s ^ 1])
                scale = 0.5 * part * stiffness[j] / stiffness_out[row]
                _add_residual(near, share, f, w, j, scale, out)


@_compiled
def _prolong(
    near: np.ndarray, share: np.ndarray, axis: int, coarse: np.ndarray, e: np.ndarray, w: np.ndarray
) -> None:
    """Add the coarser grid's correction, linear in between and zero on the cage."""
    for i in range(len(near)):
        row = coarse[i]
        if row >= 0:
            for q in range(WIDTH):
                w[i, q] += e[row, q]
            continue
        total = share[i, 2 * axis] + share[i, 2 * axis + 1]
        for s in range(2 * axis, 2 * axis + 2):
            j = near[i, s]
            if j >= 0:
                row = coarse[j]
                for q in range(WIDTH):
                    w[i, q] += share[i, s] / total * e[row, q]


@_compiled
def _cycle(
    start: np.ndarray, axes: np.ndarray, near: np.ndarray, share: np.ndarray,
    stiffness: np.ndarray, coarse: np.ndarray, f: np.ndarray, w: np.ndarray,
) -> None:  # fmt: skip
    """One V-cycle: a sweep on each grid on the way down, and one on the way up."""
    levels = len(start) - 1
    for k in range(levels - 1):
        a, b, c = start[k], start[k + 1], start[k + 2]
        _relax(near[a:b], share[a:b], f[a:b], w[a:b], 0, b - a)
        _restrict(near[a:b], share[a:b], stiffness[a:b], f[a:b], w[a:b], axes[k], coarse[a:b],
                  stiffness[b:c], f[b:c], w[b:c])  # fmt: skip
    a, b = start[levels - 1], start[levels]
    for _ in range(SWEEPS):
        _relax(near[a:b], share[a:b], f[a:b], w[a:b], 0, b - a)
    for k in range(levels - 2, -1, -1):
        a, b, c = start[k], start[k + 1], start[k + 2]
        _prolong(near[a:b], share[a:b], axes[k], coarse[a:b], w[b:c], w[a:b])
        _relax(near[a:b], share[a:b], f[a:b], w[a:b], b - a - 1, -1)


@_compiled
def solve(
    start: np.ndarray, axes: np.ndarray, near: np.ndarray, share: np.ndarray,
    stiffness: np.ndarray, coarse: np.ndarray, corners: np.ndarray, parts: np.ndarray,
    tolerance: float, limit: int, out: np.ndarray, changes: np.ndarray,
    part: int, first: int, last: int,
) -> int:  # fmt: skip
    """Values at the finest grid's nodes for the blocks `first` to before `last` of columns.

    Column v is 1 at the cage's vertex v: `corners` and `parts` are the vertices and barycentric
    weights of each hit, and a cut link is -1 - hit. `out` has the shape (nodes, columns), and
    `changes` gets the last cycle's largest change of each block. Returns the cycles.
    """
    nodes, columns = start[1], out.shape[1]
    f, w = np.zeros((len(near), WIDTH)), np.zeros((len(near), WIDTH))
    before = np.empty((nodes, WIDTH))
    most = 0
    for block in range(first, last):
        low, high = block * WIDTH, min((block + 1) * WIDTH, columns)
        f[:nodes] = 0.0
        w[:nodes] = 0.0
        for i in range(nodes):
            for s in range(6):
                hit = -1 - near[i, s]
                if hit >= 0:
                    for k in range(3):
                        if low <= corners[hit, k] < high:
                            f[i, corners[hit, k] - low] += share[i, s] * parts[hit, k]
        change = np.inf
        for n in range(limit):
            before[:] = w[:nodes]
            _cycle(start, axes, near, share, stiffness, coarse, f, w)
            last_change, change = change, 0.0
            for i in range(nodes):
                for q in range(WIDTH):
                    change = max(change, abs(w[i, q] - before[i, q]))
            most = max(most, n + 1)
            if change <= tolerance or (change < 1e-11 and change > 0.7 * last_change):
                break
        changes[block] = change
        for i in range(nodes):
            for q in range(high - low):
                out[i, low + q] = max(w[i, q], 0.0)
    return most
