"""Compiled products of a table of weights with motions, dense and sparse.

Weights in single precision become double ones as they are read, so that sums are of doubles.
"""

import numba
import numpy as np

_fast = numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=True)

WIDTH = 32
"""Points whose weights lie side by side, so that one instruction serves several."""


@_fast
def forward(blocks, moves, rest, out, part, start, stop):
    """Motion of points from that of the cage: blocks of weights (b, m, WIDTH)."""
    x, y, z = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    count = blocks.shape[1]
    for b in range(start, stop):
        x[:] = 0.0
        y[:] = 0.0
        z[:] = 0.0
        for j in range(0, count - 1, 2):  # two at a time: half the sums to load and store
            dx, dy, dz = moves[j, 0], moves[j, 1], moves[j, 2]
            ex, ey, ez = moves[j + 1, 0], moves[j + 1, 1], moves[j + 1, 2]
            for k in range(WIDTH):
                v, w = blocks[b, j, k], blocks[b, j + 1, k]
                x[k] += v * dx + w * ex
                y[k] += v * dy + w * ey
                z[k] += v * dz + w * ez
        if count % 2:
            dx, dy, dz = moves[count - 1, 0], moves[count - 1, 1], moves[count - 1, 2]
            for k in range(WIDTH):
                w = blocks[b, count - 1, k]
                x[k] += w * dx
                y[k] += w * dy
                z[k] += w * dz
        first = b * WIDTH
        for k in range(min(WIDTH, len(out) - first)):
            n = first + k
            if len(rest):
                out[n, 0] = rest[n, 0] + x[k]
                out[n, 1] = rest[n, 1] + y[k]
                out[n, 2] = rest[n, 2] + z[k]
            else:
                out[n, 0], out[n, 1], out[n, 2] = x[k], y[k], z[k]


@_fast
def backward(blocks, vectors, total, part, start, stop):
    """The transpose: cotangents of the cage's points, one total for each part."""
    x, y, z = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    count = blocks.shape[1]
    own = total[part]
    for b in range(start, stop):
        first = b * WIDTH
        x[:] = 0.0
        y[:] = 0.0
        z[:] = 0.0
        for k in range(min(WIDTH, len(vectors) - first)):
            x[k], y[k], z[k] = vectors[first + k, 0], vectors[first + k, 1], vectors[first + k, 2]
        for j in range(count):
            sx, sy, sz = 0.0, 0.0, 0.0
            for k in range(WIDTH):
                w = blocks[b, j, k]
                sx += w * x[k]
                sy += w * y[k]
                sz += w * z[k]
            own[j, 0] += sx
            own[j, 1] += sy
            own[j, 2] += sz


@_fast
def forward_sparse(weights, columns, starts, moves, rest, out, part, start, stop):
    """Motion of points from that of the cage, by the weights of each that are not zero."""
    for n in range(start, stop):
        x, y, z = 0.0, 0.0, 0.0
        for e in range(starts[n], starts[n + 1]):
            w, j = weights[e], columns[e]
            x += w * moves[j, 0]
            y += w * moves[j, 1]
            z += w * moves[j, 2]
        if len(rest):
            out[n, 0], out[n, 1], out[n, 2] = rest[n, 0] + x, rest[n, 1] + y, rest[n, 2] + z
        else:
            out[n, 0], out[n, 1], out[n, 2] = x, y, z


@_fast
def backward_sparse(weights, columns, starts, vectors, total, part, start, stop):
    """The transpose, one total for each part."""
    own = total[part]
    for n in range(start, stop):
        x, y, z = vectors[n, 0], vectors[n, 1], vectors[n, 2]
        for e in range(starts[n], starts[n + 1]):
            w, j = weights[e], columns[e]
            own[j, 0] += w * x
            own[j, 1] += w * y
            own[j, 2] += w * z
