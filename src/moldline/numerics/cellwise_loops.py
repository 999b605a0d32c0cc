"""The compiled loops of `cellwise`; what is compiled is kept on disk.

The first argument of most is `terms`, one tuple per axis with as many entries as a polynomial has
coefficients: the length of a tuple is part of its type, so each size gets its own loops.
"""

import numba
import numpy as np

Terms = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]

STRETCH = 128
"""Moving points taken together; those of one cell that follow each other share its polynomial."""

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
_reordering = numba.njit(
    nogil=True, cache=True, error_model="numpy", fastmath={"contract", "reassoc"}
)


@_compiled
def fill(terms, first, near, cells, moves, table):
    """Coefficients of each cell from the displacements of its control points, axis by axis."""
    P, Q, R = len(terms[0]), len(terms[1]), len(terms[2])
    na, nb, nc = near[0].shape[2], near[1].shape[2], near[2].shape[2]
    one, two = np.empty((P, nb, nc, 3)), np.empty((P, Q, nc, 3))
    for m in range(len(cells)):
        k = cells[m] % len(first[2])
        j = cells[m] // len(first[2]) % len(first[1])
        i = cells[m] // (len(first[2]) * len(first[1]))
        u, v, w = first[0][i], first[1][j], first[2][k]
        one[:] = 0.0
        for p in range(P):
            for a in range(na):
                for b in range(nb):
                    for c in range(nc):
                        for d in range(3):
                            one[p, b, c, d] += near[0][i, p, a] * moves[u + a, v + b, w + c, d]
        two[:] = 0.0
        for p in range(P):
            for q in range(Q):
                for b in range(nb):
                    for c in range(nc):
                        for d in range(3):
                            two[p, q, c, d] += near[1][j, q, b] * one[p, b, c, d]
        for d in range(3):
            for p in range(P):
                for q in range(Q):
                    for r in range(R):
                        s = 0.0
                        for c in range(nc):
                            s += near[2][k, r, c] * two[p, q, c, d]
                        table[m, d, p, q, r] = s


@_compiled
def collect(terms, first, near, cells, moments, result):
    """The transpose of `fill`."""
    P, Q, R = len(terms[0]), len(terms[1]), len(terms[2])
    na, nb, nc = near[0].shape[2], near[1].shape[2], near[2].shape[2]
    one, two = np.empty((P, nb, nc, 3)), np.empty((P, Q, nc, 3))
    for m in range(len(cells)):
        k = cells[m] % len(first[2])
        j = cells[m] // len(first[2]) % len(first[1])
        i = cells[m] // (len(first[2]) * len(first[1]))
        u, v, w = first[0][i], first[1][j], first[2][k]
        for p in range(P):
            for q in range(Q):
                for c in range(nc):
                    for d in range(3):
                        s = 0.0
                        for r in range(R):
                            s += near[2][k, r, c] * moments[m, d, p, q, r]
                        two[p, q, c, d] = s
        one[:] = 0.0
        for p in range(P):
            for q in range(Q):
                for b in range(nb):
                    for c in range(nc):
                        for d in range(3):
                            one[p, b, c, d] += near[1][j, q, b] * two[p, q, c, d]
        for p in range(P):
            for a in range(na):
                for b in range(nb):
                    for c in range(nc):
                        for d in range(3):
                            result[u + a, v + b, w + c, d] += near[0][i, p, a] * one[p, b, c, d]


@_compiled
def forward(terms, x, y, z, order, cells, table, rest, out, part, start, stop):
    """A component that no control moves costs nothing."""
    P, Q, R = len(terms[0]), len(terms[1]), len(terms[2])
    size = x.shape[1]
    moved = np.empty((3, size))
    for i in range(start, stop):
        c = table[cells[i]]
        for d in range(3):
            if not np.any(c[d]):
                moved[d] = 0.0
                continue
            for p in range(size):
                fx = 0.0
                for a in range(P - 1, -1, -1):
                    fy = 0.0
                    for b in range(Q - 1, -1, -1):
                        fz = 0.0
                        for k in range(R - 1, -1, -1):
                            fz = fz * z[i, p] + c[d, a, b, k]
                        fy = fy * y[i, p] + fz
                    fx = fx * x[i, p] + fy
                moved[d, p] = fx
        if len(rest):
            for p in range(size):
                r = order[i, p]
                if r >= 0:
                    out[r, 0] = rest[r, 0] + moved[0, p]
                    out[r, 1] = rest[r, 1] + moved[1, p]
                    out[r, 2] = rest[r, 2] + moved[2, p]
        else:
            for p in range(size):
                r = order[i, p]
                if r >= 0:
                    out[r, 0] = moved[0, p]
                    out[r, 1] = moved[1, p]
                    out[r, 2] = moved[2, p]


@_reordering
def _gather(terms, local, vectors, first, end, left, right, total):
    """Moments of vectors over a run of points in one cell."""
    P, Q, R = len(terms[0]), len(terms[1]), len(terms[2])
    for p in range(first, end):
        left[0, p] = 1.0
    for a in range(1, P):
        for p in range(first, end):
            left[a * Q, p] = left[(a - 1) * Q, p] * local[0, p]
    for a in range(P):
        for b in range(1, Q):
            for p in range(first, end):
                left[a * Q + b, p] = left[a * Q + b - 1, p] * local[1, p]
    for d in range(3):
        for p in range(first, end):
            right[d * R, p] = vectors[d, p]
        for k in range(1, R):
            for p in range(first, end):
                right[d * R + k, p] = right[d * R + k - 1, p] * local[2, p]
    last = P * Q - 1
    for d in range(3):
        for k in range(R):
            for ab in range(0, P * Q, 4):  # four sums at once read the vectors only once
                i, j, m = min(ab + 1, last), min(ab + 2, last), min(ab + 3, last)
                s0 = s1 = s2 = s3 = 0.0
                for p in range(first, end):
                    v = right[d * R + k, p]
                    s0 += left[ab, p] * v
                    s1 += left[i, p] * v
                    s2 += left[j, p] * v
                    s3 += left[m, p] * v
                total[d, ab // Q, ab % Q, k] += s0
                if ab + 1 <= last:
                    total[d, i // Q, i % Q, k] += s1
                if ab + 2 <= last:
                    total[d, j // Q, j % Q, k] += s2
                if ab + 3 <= last:
                    total[d, m // Q, m % Q, k] += s3


@_compiled
def moments(terms, x, y, z, order, cells, vectors, count, part, start, stop):
    """Moments of vectors, cell by cell."""
    P, Q, R = len(terms[0]), len(terms[1]), len(terms[2])
    size = x.shape[1]
    sums = np.zeros((count, 3, P, Q, R))
    local, row = np.empty((3, size)), np.zeros((3, size))
    left, right = np.empty((P * Q, size)), np.empty((3 * R, size))
    for i in range(start, stop):
        local[0], local[1], local[2] = x[i], y[i], z[i]
        for p in range(size):
            r = order[i, p]
            for d in range(3):
                row[d, p] = vectors[r, d] if r >= 0 else 0.0
        _gather(terms, local, row, 0, size, left, right, sums[cells[i]])
    return sums


@_compiled
def _cell(u, starts):
    """Last cell that begins at or before u: a guess from even spacing, then steps."""
    last = len(starts) - 1
    if last == 0:
        return 0
    guess = 1 + (u - starts[1]) * ((last - 1) / (starts[last] - starts[1]))
    c = 0
    if guess >= last:
        c = last
    elif guess > 0:  # false for NaN, which so stays harmless
        c = int(guess)
    while c > 0 and u < starts[c]:
        c -= 1
    while c < last and u >= starts[c + 1]:
        c += 1
    return c


@_compiled
def _place(points, start, stop, origin, inverse, starts, offsets, scales, cell, local, scale):
    """Cell, local coordinates and their scales of the points start .. stop."""
    for p in range(stop - start):
        x = points[start + p, 0] - origin[0]
        y = points[start + p, 1] - origin[1]
        z = points[start + p, 2] - origin[2]
        cell[p] = 0
        for i in range(3):
            u = x * inverse[0, i] + y * inverse[1, i] + z * inverse[2, i]
            c = _cell(u, starts[i])
            cell[p] = cell[p] * len(starts[i]) + c
            scale[i, p] = scales[i][c]
            local[i, p] = (u - offsets[i][c]) * scales[i][c]


@_compiled
def _run_end(cell, first, count):
    """Where the run of points in one cell that begins at `first` ends."""
    end = first + 1
    while end < count and cell[end] == cell[first]:
        end += 1
    return end


@_compiled
def _field(terms, c, local, first, end, out):
    """Its values along a run of points."""
    P, Q, R = len(terms[0]), len(terms[1]), len(terms[2])
    for p in range(first, end):
        fx = 0.0
        for a in range(P - 1, -1, -1):
            fy = 0.0
            for b in range(Q - 1, -1, -1):
                fz = 0.0
                for k in range(R - 1, -1, -1):
                    fz = fz * local[2, p] + c[a, b, k]
                fy = fy * local[1, p] + fz
            fx = fx * local[0, p] + fy
        out[p] = fx


@_compiled
def _slopes(terms, c, local, first, end, out):
    """Its three local slopes along a run of points."""
    P, Q, R = len(terms[0]), len(terms[1]), len(terms[2])
    for p in range(first, end):
        x, y, z = local[0, p], local[1, p], local[2, p]
        f = fx = fy = fz = 0.0
        for a in range(P - 1, -1, -1):
            g = gy = gz = 0.0
            for b in range(Q - 1, -1, -1):
                h = hz = 0.0
                for k in range(R - 1, -1, -1):
                    hz = hz * z + h
                    h = h * z + c[a, b, k]
                gy = gy * y + g
                gz = gz * y + hz
                g = g * y + h
            fx = fx * x + f
            fy = fy * x + gy
            fz = fz * x + gz
            f = f * x + g
        out[0, p], out[1, p], out[2, p] = fx, fy, fz


@_compiled
def follow(terms, origin, inverse, starts, offsets, scales, table, points, out, part, start, stop):
    """Value at each point."""
    cell = np.empty(STRETCH, np.int64)
    work = np.empty((3, 3, STRETCH))
    local, scale, moved = work[0], work[1], work[2]
    for begin in range(start, stop, STRETCH):
        count = min(STRETCH, stop - begin)
        _place(
            points, begin, begin + count,
            origin, inverse, starts, offsets, scales, cell, local, scale,
        )  # fmt: skip
        first = 0
        while first < count:
            end = _run_end(cell, first, count)
            for d in range(3):
                _field(terms, table[cell[first], d], local, first, end, moved[d])
            first = end
        for p in range(count):
            for d in range(3):
                out[begin + p, d] = points[begin + p, d] + moved[d, p]


@_compiled
def push(terms, origin, inverse, starts, offsets, scales, table, change, points, motion, out,
    part, start, stop,):  # fmt: skip
    """Forward derivative at each point."""
    cell = np.empty(STRETCH, np.int64)
    work = np.empty((4, 3, STRETCH))
    local, scale, slope, steps = work[0], work[1], work[2], work[3]
    moved = np.empty(STRETCH)
    for begin in range(start, stop, STRETCH):
        count = min(STRETCH, stop - begin)
        _place(
            points, begin, begin + count,
            origin, inverse, starts, offsets, scales, cell, local, scale,
        )  # fmt: skip
        for p in range(count):
            m = motion[begin + p]
            for i in range(3):
                along = m[0] * inverse[0, i] + m[1] * inverse[1, i] + m[2] * inverse[2, i]
                steps[i, p] = scale[i, p] * along
        first = 0
        while first < count:
            end = _run_end(cell, first, count)
            for d in range(3):
                _field(terms, change[cell[first], d], local, first, end, moved)
                _slopes(terms, table[cell[first], d], local, first, end, slope)
                for p in range(first, end):
                    out[begin + p, d] = (
                        motion[begin + p, d]
                        + moved[p]
                        + slope[0, p] * steps[0, p]
                        + slope[1, p] * steps[1, p]
                        + slope[2, p] * steps[2, p]
                    )
            first = end


@_reordering
def pull(
    terms, origin, inverse, starts, offsets, scales, table, points, vectors, out, part, start, stop
):
    """Reverse derivative at each point."""
    P, Q, R = len(terms[0]), len(terms[1]), len(terms[2])
    sums = np.zeros(table.shape)
    cell = np.empty(STRETCH, np.int64)
    work = np.empty((5, 3, STRETCH))
    local, scale, slope, steps, row = work[0], work[1], work[2], work[3], work[4]
    left, right = np.empty((P * Q, STRETCH)), np.empty((3 * R, STRETCH))
    for begin in range(start, stop, STRETCH):
        count = min(STRETCH, stop - begin)
        _place(
            points, begin, begin + count,
            origin, inverse, starts, offsets, scales, cell, local, scale,
        )  # fmt: skip
        for p in range(count):
            for d in range(3):
                row[d, p] = vectors[begin + p, d]
        first = 0
        while first < count:
            end = _run_end(cell, first, count)
            steps[:, first:end] = 0.0
            for d in range(3):
                _slopes(terms, table[cell[first], d], local, first, end, slope)
                for i in range(3):
                    for p in range(first, end):
                        steps[i, p] += row[d, p] * slope[i, p]
            _gather(terms, local, row, first, end, left, right, sums[cell[first]])
            first = end
        for p in range(count):
            for i in range(3):
                out[begin + p, i] = (
                    vectors[begin + p, i]
                    + inverse[i, 0] * scale[0, p] * steps[0, p]
                    + inverse[i, 1] * scale[1, p] * steps[1, p]
                    + inverse[i, 2] * scale[2, p] * steps[2, p]
                )
    return sums
