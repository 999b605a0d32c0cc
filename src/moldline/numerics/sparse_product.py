"""The product of a constant sparse matrix with points, as a compiled and differentiable kernel."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import scipy.sparse
from typing_extensions import override

from .._types import Array
from . import table_loops
from .kernel import AbstractKernel, Arrays, empty
from .threads import spread

THREAD_WORTH = 16384
"""Rows that are worth a thread of their own."""


class SparseProduct(AbstractKernel):
    """Points (n, 3) to points (r, 3) by a matrix (r, n): linear, and its transpose is another one.

    The transposed matrix is stored too, so that both ways run along rows.
    """

    def __init__(self, matrix: Any, transposed: "SparseProduct | None" = None):
        self.matrix = scipy.sparse.csr_array(matrix, dtype=float)
        self.other = transposed or SparseProduct(self.matrix.T.tocsr(), self)

    @override
    def run(self, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        (points,) = arrays
        out = empty((self.matrix.shape[0], 3))
        given = self.matrix.data, self.matrix.indices, self.matrix.indptr
        moves = np.ascontiguousarray(points, float)
        spread(
            table_loops.forward_sparse, len(out), *given, moves, np.empty((0, 3)), out,
            least=THREAD_WORTH,
        )  # fmt: skip
        return (out,)

    @override
    def plain(self, *arrays: Array) -> tuple[Array, ...]:
        (points,) = arrays
        entries = self.matrix.tocoo()
        shares = jnp.asarray(entries.data)[:, None] * jnp.asarray(points)[entries.col]
        return (jnp.zeros((self.matrix.shape[0], 3)).at[entries.row].add(shares),)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self(*tangents)

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        return self.other(*cotangents)
