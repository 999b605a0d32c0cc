"""Fixed points in a cage: a stored table of weights, and its products with motions.

Weights may be kept in single precision; products and their sums are of doubles all the same, and
the transpose is that of the weights as they are kept.
"""

from typing import Any

import jax.numpy as jnp
import numpy as np
import scipy.sparse
from typing_extensions import override

from .._types import Array
from ..numerics import table_loops
from ..numerics.kernel import empty
from ..numerics.table_loops import WIDTH
from ..numerics.threads import cores, spread
from .embedding import AbstractEmbedding, Displacement, Gathering, Motion

NOTHING = 1e-17
"""A weight below this is less than the rounding of the others."""

SPARSE = 0.35
"""Share of weights above nothing up to which a sparse table is the faster one."""

THREAD_WORTH = 512
"""Blocks of points that are worth a thread of their own."""

KINDS: dict[str, type[np.floating[Any]]] = {"double": np.float64, "single": np.float32}
"""What weights are kept in, by the name of the precision."""


class DenseTable(AbstractEmbedding):
    """Points with the weights of all control points.

    Attributes
    ----------
    blocks
        Weights (b, m, WIDTH), those of WIDTH points side by side; the last are filled up by zeros.
    """

    def __init__(self, points: np.ndarray, blocks: np.ndarray):
        self.points, self.blocks = points, blocks
        self.count = blocks.shape[1]
        self.field = self._field
        self.displace, self.move, self.gather = Displacement(self), Motion(self), Gathering(self)

    @override
    def displaced(self, moves: np.ndarray, rest: np.ndarray | None) -> np.ndarray:
        out = empty(self.points.shape)
        given = self.blocks, np.ascontiguousarray(moves), _or_empty(rest), out
        spread(table_loops.forward, len(self.blocks), *given, least=THREAD_WORTH)
        return out

    @override
    def gathered(self, vectors: np.ndarray) -> np.ndarray:
        totals = np.zeros((cores(), self.count, 3))
        given = self.blocks, np.ascontiguousarray(vectors), totals
        spread(table_loops.backward, len(self.blocks), *given, least=THREAD_WORTH)
        return totals.sum(axis=0)

    @override
    def matrix(self) -> scipy.sparse.csr_array:
        return scipy.sparse.csr_array(self._whole(), dtype=float)

    def _whole(self) -> np.ndarray:
        rows = self.blocks.transpose(0, 2, 1).reshape(-1, self.count)
        return rows[: len(self.points)]

    def _field(self, moves: Array) -> Array:
        return jnp.asarray(self._whole()) @ moves


class SparseTable(AbstractEmbedding):
    """Points with the weights of those control points that are not far away."""

    def __init__(self, points: np.ndarray, weights: scipy.sparse.csr_array):
        self.points, self.weights = points, weights
        self.count = weights.shape[1]
        self.field = self._field
        self.displace, self.move, self.gather = Displacement(self), Motion(self), Gathering(self)

    @override
    def displaced(self, moves: np.ndarray, rest: np.ndarray | None) -> np.ndarray:
        out = empty(self.points.shape)
        given = *self._entries(), np.ascontiguousarray(moves), _or_empty(rest), out
        spread(table_loops.forward_sparse, len(out), *given, least=THREAD_WORTH * WIDTH)
        return out

    @override
    def gathered(self, vectors: np.ndarray) -> np.ndarray:
        totals = np.zeros((cores(), self.count, 3))
        given = *self._entries(), np.ascontiguousarray(vectors), totals
        spread(table_loops.backward_sparse, len(vectors), *given, least=THREAD_WORTH * WIDTH)
        return totals.sum(axis=0)

    @override
    def matrix(self) -> scipy.sparse.csr_array:
        return self.weights.astype(float, copy=False)

    def _entries(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.weights.data, self.weights.indices, self.weights.indptr

    def _field(self, moves: Array) -> Array:
        entries = self.weights.tocoo()
        shares = jnp.asarray(entries.data)[:, None] * moves[entries.col]
        return jnp.zeros((len(self.points), 3)).at[entries.row].add(shares)


def _or_empty(rest: np.ndarray | None) -> np.ndarray:
    return np.empty((0, 3)) if rest is None else rest


def blocked(count: int, columns: int, kind: type[np.floating[Any]]) -> np.ndarray:
    """An empty dense table, its last points zero."""
    blocks = empty((-(-count // WIDTH), columns, WIDTH), kind)
    blocks[-1:] = 0.0
    return blocks


def put(blocks: np.ndarray, first: int, weights: np.ndarray) -> None:
    """Write the weights (k, m) of points from `first` on, a multiple of WIDTH."""
    whole, rest = divmod(len(weights), WIDTH)
    start = first // WIDTH
    full = weights[: whole * WIDTH].reshape(whole, WIDTH, weights.shape[1])
    blocks[start : start + whole] = full.transpose(0, 2, 1)
    if rest:
        blocks[start + whole, :, :rest] = weights[whole * WIDTH :].T
