"""Displacement fields that are one polynomial per cell of a box: the fast loops behind lattices.

In a cell the field is the sum over (a, b, c) of C[d, a, b, c] x^a y^b z^c with local coordinates
(x, y, z). For points that do not move they are sorted by cell and cut into blocks once; a
deformation is then one pass of nested Horner schemes, and its transpose the moments of the
incoming vectors. Points that move are found and evaluated one by one.
"""

from typing import NamedTuple

import numpy as np
import scipy.sparse

from . import cellwise_loops as loops
from .bspline import Axis
from .kernel import empty
from .threads import spread

Axes = tuple[Axis, Axis, Axis]

THREAD_WORTH = 16384
"""Points that are worth a thread of their own."""


class Weights(NamedTuple):
    """For each axis and cell the first control point that acts, and the powers of those that do."""

    first: tuple[np.ndarray, np.ndarray, np.ndarray]
    near: tuple[np.ndarray, np.ndarray, np.ndarray]
    counts: tuple[int, int, int]

    @classmethod
    def of(cls, axes: Axes) -> "Weights":
        """Those of three axes; `near` has the shape (cells, terms, acting control points)."""
        found = [_acting(axis) for axis in axes]
        first, near = (tuple(part) for part in zip(*found, strict=True))
        return cls(first, near, tuple(axis.size for axis in axes))  # type: ignore[arg-type]

    @property
    def terms(self) -> loops.Terms:
        """The size of the polynomials, as the loops want it."""
        p, q, r = (table.shape[1] for table in self.near)
        return (0,) * p, (0,) * q, (0,) * r

    @property
    def cells(self) -> np.ndarray:
        """Numbers of all cells."""
        return np.arange(np.prod([len(first) for first in self.first]))


def _acting(axis: Axis) -> tuple[np.ndarray, np.ndarray]:
    acts = np.any(axis.powers != 0, axis=1)
    first, last = acts.argmax(axis=1), axis.size - acts[:, ::-1].argmax(axis=1)
    width = int(np.where(acts.any(axis=1), last - first, 1).max())
    first = np.minimum(first, axis.size - width)
    columns = first[:, None] + np.arange(width)
    return first, np.take_along_axis(axis.powers, columns[:, None, :], axis=2)


def coefficients(weights: Weights, cells: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Polynomial coefficients (cells, 3, P, Q, R) from control displacements (nu, nv, nw, 3)."""
    p, q, r = map(len, weights.terms)
    table = np.empty((len(cells), 3, p, q, r))
    loops.fill(weights.terms, weights.first, weights.near, cells, moves, table)
    return table


def gathered(weights: Weights, cells: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """The transpose of `coefficients`: control cotangents (nu, nv, nw, 3) from moments."""
    result = np.zeros((*weights.counts, 3))
    loops.collect(weights.terms, weights.first, weights.near, cells, moments, result)
    return result


def located(axis: Axis, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cell of each coordinate along one axis, and the local coordinate in it."""
    cell = np.searchsorted(axis.starts, u, side="right") - 1
    return cell, (u - axis.offsets[cell]) * axis.scales[cell]


def matrix(axes: Axes, u: np.ndarray) -> scipy.sparse.csr_array:
    """Weight of each control point at each point, shape (n, nu nv nw)."""
    (iu, wu), (iv, wv), (iw, ww) = (_taps(axis, u[:, i]) for i, axis in enumerate(axes))
    nu, nv, nw = (axis.size for axis in axes)
    column = (iu[:, :, None, None] * nv + iv[:, None, :, None]) * nw + iw[:, None, None, :]
    value = wu[:, :, None, None] * wv[:, None, :, None] * ww[:, None, None, :]
    row = np.broadcast_to(np.arange(len(u))[:, None, None, None], column.shape)
    entries = (value.ravel(), (row.ravel(), column.ravel()))
    found = scipy.sparse.coo_array(entries, (len(u), nu * nv * nw)).tocsr()
    found.eliminate_zeros()
    return found


def _taps(axis: Axis, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The few control points that act on each coordinate along one axis, and their weights."""
    cell, t = located(axis, u)
    first, near = _acting(axis)
    index = first[cell, None] + np.arange(near.shape[2])
    return index, np.einsum("na,nak->nk", t[:, None] ** np.arange(near.shape[1]), near[cell])


class Blocks(NamedTuple):
    """Points sorted by cell, in blocks of one size.

    `order` holds the points' rows, -1 in places that nothing fills. `cells` counts among the cells
    that hold points, whose numbers are `used`.
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    order: np.ndarray
    cells: np.ndarray
    used: np.ndarray


def blocks(axes: Axes, u: np.ndarray, rows: np.ndarray | None = None) -> Blocks:
    """Sort points, given by box coordinates (n, 3), into blocks; `rows` numbers them otherwise."""
    found = [located(axis, u[:, i]) for i, axis in enumerate(axes)]
    shape = tuple(len(axis.starts) for axis in axes)
    key = np.ravel_multi_index([cell for cell, _ in found], shape).astype(np.int32)
    order = np.argsort(key, kind="stable").astype(np.int32)
    used, first, inside = np.unique(key[order], return_index=True, return_counts=True)
    size = _block_size(len(u), len(used))
    needed = -(-inside // size)
    place = np.arange(len(u)) + np.repeat(size * (np.cumsum(needed) - needed) - first, inside)
    count = int(needed.sum())
    sorted_order = np.full(count * size, -1, np.int32)
    sorted_order[place] = order if rows is None else rows[order]
    local = np.zeros((3, count * size))
    for i, (_, t) in enumerate(found):
        local[i, place] = t[order]
    return Blocks(
        x=local[0].reshape(count, size),
        y=local[1].reshape(count, size),
        z=local[2].reshape(count, size),
        order=sorted_order.reshape(count, size),
        cells=np.repeat(np.arange(len(used), dtype=np.int32), needed),
        used=used.astype(np.int64),
    )


def _block_size(points: int, cells: int) -> int:
    """Large blocks cost less per point, small ones waste fewer places in sparsely filled cells."""
    filling = points / max(cells, 1)
    return next((size for size in (256, 128, 64, 32) if filling >= 4 * size), 16)


def displaced(
    b: Blocks, weights: Weights, moves: np.ndarray, rest: np.ndarray | None, out: np.ndarray
) -> None:
    """Displacements of the blocks' points, plus `rest` where given, into their rows of `out`."""
    table = coefficients(weights, b.used, moves)
    base = np.empty((0, 3)) if rest is None else rest
    least = THREAD_WORTH // b.x.shape[1]
    spread(loops.forward, len(b.cells), weights.terms, *b[:5], table, base, out, least=least)


def pulled_back(b: Blocks, weights: Weights, vectors: np.ndarray) -> np.ndarray:
    """The transpose of `displaced`: control cotangents from those of the points.

    Per cell it sums the points' vectors times the monomials, shape (cells, 3, P, Q, R).
    """
    least = THREAD_WORTH // b.x.shape[1]
    arguments = weights.terms, *b[:5], vectors, len(b.used)
    parts = spread(loops.moments, len(b.cells), *arguments, least=least)
    return gathered(weights, b.used, sum(parts[1:], parts[0]))


class Box(NamedTuple):
    """What finds a point's cell: u = (point - origin) @ inverse, then each axis by itself."""

    origin: np.ndarray
    inverse: np.ndarray
    starts: tuple[np.ndarray, np.ndarray, np.ndarray]
    offsets: tuple[np.ndarray, np.ndarray, np.ndarray]
    scales: tuple[np.ndarray, np.ndarray, np.ndarray]

    @classmethod
    def of(cls, origin: np.ndarray, inverse: np.ndarray, axes: Axes) -> "Box":
        """Tables of three axes, laid out for the compiled loops."""
        return cls(
            origin,
            np.ascontiguousarray(inverse),
            (axes[0].starts, axes[1].starts, axes[2].starts),
            (axes[0].offsets, axes[1].offsets, axes[2].offsets),
            (axes[0].scales, axes[1].scales, axes[2].scales),
        )


def followed(box: Box, weights: Weights, moves: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points moved by the field, each evaluated where it is now."""
    out = empty(points.shape)
    table = coefficients(weights, weights.cells, moves)
    arguments = weights.terms, *box, table, points, out
    spread(loops.follow, len(points), *arguments, least=THREAD_WORTH // 4)
    return out


def pushed(
    box: Box,
    weights: Weights,
    moves: np.ndarray,
    change: np.ndarray,
    points: np.ndarray,
    motion: np.ndarray,
) -> np.ndarray:
    """Derivative of `followed` along a change of the controls and a motion of the points."""
    out = empty(points.shape)
    tables = (coefficients(weights, weights.cells, m) for m in (moves, change))
    arguments = weights.terms, *box, *tables, points, motion, out
    spread(loops.push, len(points), *arguments, least=THREAD_WORTH // 4)
    return out


def pulled(
    box: Box, weights: Weights, moves: np.ndarray, points: np.ndarray, vectors: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The transpose of `pushed`: cotangents of the points and of the controls."""
    out = empty(points.shape)
    table = coefficients(weights, weights.cells, moves)
    arguments = weights.terms, *box, table, points, vectors, out
    parts = spread(loops.pull, len(points), *arguments, least=THREAD_WORTH // 4)
    return out, gathered(weights, weights.cells, sum(parts[1:], parts[0]))
