"""Displacement fields that are one polynomial per cell of a box: the fast loops behind lattices.

In a cell the field is the sum over (a, b, c) of C[d, a, b, c] x^a y^b z^c with local coordinates
(x, y, z). For points that do not move they are sorted by cell and cut into blocks once; a
deformation is then one pass of nested Horner schemes, and its transpose the moments of the
incoming vectors. Points that move are found and evaluated one by one.
"""

from typing import NamedTuple

import numpy as np

from . import cellwise_loops as loops
from .bspline import Axis
from .kernel import empty
from .threads import spread

Axes = tuple[Axis, Axis, Axis]

THREAD_WORTH = 16384
"""Points that are worth a thread of their own."""


def _terms(table: np.ndarray) -> loops.Terms:
    """The size of the polynomials of a table (cells, 3, P, Q, R), as the loops want it."""
    p, q, r = table.shape[2:]
    return (0,) * p, (0,) * q, (0,) * r


def coefficients(axes: Axes, moves: np.ndarray) -> np.ndarray:
    """Polynomial coefficients (cells, 3, P, Q, R) from control displacements (nu, nv, nw, 3)."""
    table = moves
    for i, axis in enumerate(axes):
        table = _along(axis.powers.reshape(-1, axis.size), table, i)
    split = [size for axis in axes for size in axis.powers.shape[:2]]
    table = table.reshape(*split, 3).transpose(0, 2, 4, 6, 1, 3, 5)
    return np.ascontiguousarray(table).reshape(-1, *table.shape[3:])


def gathered(axes: Axes, moments: np.ndarray) -> np.ndarray:
    """The transpose of `coefficients`: control cotangents (nu, nv, nw, 3) from moments."""
    split = [len(axis.starts) for axis in axes]
    table = moments.reshape(*split, *moments.shape[1:]).transpose(0, 4, 1, 5, 2, 6, 3)
    table = table.reshape(*(axis.powers[..., 0].size for axis in axes), 3)
    for i, axis in enumerate(axes):
        table = _along(axis.powers.reshape(-1, axis.size).T, table, i)
    return table


def _along(matrix: np.ndarray, table: np.ndarray, axis: int) -> np.ndarray:
    """A matrix times one axis of a table.

    A compiled loop, since the threads of a BLAS go on spinning for a while after a product and
    would slow the loops that follow.
    """
    front = np.ascontiguousarray(np.moveaxis(table, axis, 0))
    result = loops.product(np.ascontiguousarray(matrix), front.reshape(len(front), -1))
    return np.moveaxis(result.reshape(-1, *front.shape[1:]), 0, axis)


def located(axis: Axis, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cell of each coordinate along one axis, and the local coordinate in it."""
    cell = np.searchsorted(axis.starts, u, side="right") - 1
    return cell, (u - axis.offsets[cell]) * axis.scales[cell]


class Blocks(NamedTuple):
    """Points sorted by cell, in blocks of one size; places that nothing fills have order -1."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    order: np.ndarray
    cells: np.ndarray
    length: int


def blocks(axes: Axes, u: np.ndarray) -> Blocks:
    """Sort points, given by box coordinates (n, 3), into blocks."""
    found = [located(axis, u[:, i]) for i, axis in enumerate(axes)]
    shape = tuple(len(axis.starts) for axis in axes)
    key = np.ravel_multi_index([cell for cell, _ in found], shape).astype(np.int32)
    order = np.argsort(key, kind="stable").astype(np.int32)
    used, first, inside = np.unique(key[order], return_index=True, return_counts=True)
    size = _block_size(len(u), len(used))
    needed = -(-inside // size)
    place = np.arange(len(u)) + np.repeat(size * (np.cumsum(needed) - needed) - first, inside)
    rows = int(needed.sum())
    sorted_order = np.full(rows * size, -1, np.int32)
    sorted_order[place] = order
    local = np.zeros((3, rows * size))
    for i, (_, t) in enumerate(found):
        local[i, place] = t[order]
    return Blocks(
        x=local[0].reshape(rows, size),
        y=local[1].reshape(rows, size),
        z=local[2].reshape(rows, size),
        order=sorted_order.reshape(rows, size),
        cells=np.repeat(used, needed).astype(np.int32),
        length=len(u),
    )


def _block_size(points: int, cells: int) -> int:
    """Large blocks cost less per point, small ones waste fewer places in sparsely filled cells."""
    filling = points / max(cells, 1)
    return next((size for size in (256, 128, 64, 32) if filling >= 4 * size), 16)


def displaced(b: Blocks, table: np.ndarray, rest: np.ndarray | None) -> np.ndarray:
    """Displacements of the blocks' points in their own order, added to `rest` where given."""
    out = empty((b.length, 3))
    base = np.empty((0, 3)) if rest is None else rest
    least = THREAD_WORTH // b.x.shape[1]
    spread(loops.forward, len(b.cells), _terms(table), *b[:5], table, base, out, least=least)
    return out


def moments(b: Blocks, axes: Axes, vectors: np.ndarray) -> np.ndarray:
    """Per cell the sum over its points of vector times monomials: shape (cells, 3, P, Q, R)."""
    terms = tuple((0,) * axis.terms for axis in axes)
    cells = int(np.prod([len(axis.starts) for axis in axes]))
    least = THREAD_WORTH // b.x.shape[1]
    parts = spread(loops.moments, len(b.cells), terms, *b[:5], vectors, cells, least=least)
    return sum(parts[1:], parts[0])


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


def followed(box: Box, table: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points moved by the field, each evaluated where it is now."""
    out = empty(points.shape)
    spread(
        loops.follow, len(points), _terms(table), *box, table, points, out, least=THREAD_WORTH // 4
    )
    return out


def pushed(
    box: Box, table: np.ndarray, change: np.ndarray, points: np.ndarray, motion: np.ndarray
) -> np.ndarray:
    """Derivative of `followed` along a change of the coefficients and a motion of the points."""
    out = empty(points.shape)
    arguments = _terms(table), *box, table, change, points, motion, out
    spread(loops.push, len(points), *arguments, least=THREAD_WORTH // 4)
    return out


def pulled(
    box: Box, table: np.ndarray, points: np.ndarray, vectors: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The transpose of `pushed`: cotangents of the points, and moments per cell."""
    out = empty(points.shape)
    arguments = _terms(table), *box, table, points, vectors, out
    parts = spread(loops.pull, len(points), *arguments, least=THREAD_WORTH // 4)
    return out, sum(parts[1:], parts[0])
