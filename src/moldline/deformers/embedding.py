"""Fixed points in splines, and the compiled kernels of their motion, each other's derivatives."""

import abc
from collections.abc import Callable, Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse
from typing_extensions import override

from .._types import Array, Points, Vector
from ..numerics import cellwise
from ..numerics.kernel import AbstractKernel, Arrays, empty
from .base import AbstractBinding
from .net import AbstractControlNet


class Part(NamedTuple):
    """The points that one tensor-product spline moves, and the control points it takes.

    Attributes
    ----------
    axes
        The spline's axes.
    controls
        Number of each of its control points, shape (nu, nv, nw).
    u
        Box coordinates of the points, shape (p, 3).
    rows
        Numbers of the points; None if they are all.
    """

    axes: cellwise.Axes
    controls: np.ndarray
    u: np.ndarray
    rows: np.ndarray | None


class AbstractEmbedding(abc.ABC):
    """Fixed points in a net of control points; its kernels take displacements of these.

    Compared by identity, as its kernels are.
    """

    points: np.ndarray
    count: int
    """Control points."""
    field: Callable[[Array], Array]
    """Control displacements to those of the points, in plain JAX."""
    displace: "Displacement"
    move: "Motion"
    gather: "Gathering"

    @abc.abstractmethod
    def displaced(self, moves: np.ndarray, rest: np.ndarray | None) -> np.ndarray:
        """Displacements of the points, added to `rest` where given."""

    @abc.abstractmethod
    def gathered(self, vectors: np.ndarray) -> np.ndarray:
        """The transpose: cotangents of the control points from those of the points."""

    @abc.abstractmethod
    def matrix(self) -> scipy.sparse.csr_array:
        """Weight of each control point at each point, shape (n, count)."""


class Embedding(AbstractEmbedding):
    """Fixed points in some splines, sorted by cell."""

    def __init__(
        self, points: np.ndarray, parts: Sequence[Part], count: int, field: Callable[[Array], Array]
    ):
        self.points = points
        self.parts = tuple(parts)
        self.count = count
        self.field = field
        self.blocks = [cellwise.blocks(part.axes, part.u, part.rows) for part in parts]
        self.weights = [cellwise.Weights.of(part.axes) for part in parts]
        self.covers = any(part.rows is None for part in parts)
        self.displace = Displacement(self)
        self.move = Motion(self)
        self.gather = Gathering(self)

    @override
    def displaced(self, moves: np.ndarray, rest: np.ndarray | None) -> np.ndarray:
        out = empty(self.points.shape)
        if not self.covers:
            out[:] = 0.0 if rest is None else rest
        for part, blocks, weights in zip(self.parts, self.blocks, self.weights, strict=True):
            cellwise.displaced(blocks, weights, moves[part.controls], rest, out)
        return out

    @override
    def gathered(self, vectors: np.ndarray) -> np.ndarray:
        total = np.zeros((self.count, 3))
        for part, blocks, weights in zip(self.parts, self.blocks, self.weights, strict=True):
            np.add.at(total, part.controls, cellwise.pulled_back(blocks, weights, vectors))
        return total

    @override
    def matrix(self) -> scipy.sparse.csr_array:
        total = scipy.sparse.csr_array((len(self.points), self.count))
        for part in self.parts:
            own = cellwise.matrix(part.axes, part.u).tocoo()
            row = own.row if part.rows is None else part.rows[own.row]
            total = total + scipy.sparse.csr_array(
                (own.data, (row, part.controls.ravel()[own.col])), shape=total.shape
            )
        return total


class Displacement(AbstractKernel):
    """Control displacements to point displacements: linear."""

    def __init__(self, embedding: AbstractEmbedding):
        self.embedding = embedding

    @override
    def run(self, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        return (self.embedding.displaced(moves, None),)

    @override
    def plain(self, moves: Array) -> tuple[Array, ...]:
        return (self.embedding.field(moves),)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self(*tangents)

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        return self.embedding.gather(*cotangents)


class Motion(AbstractKernel):
    """Control displacements to moved points: the displacement kernel with the rest added in it."""

    def __init__(self, embedding: AbstractEmbedding):
        self.embedding = embedding

    @override
    def run(self, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        return (self.embedding.displaced(moves, self.embedding.points),)

    @override
    def plain(self, moves: Array) -> tuple[Array, ...]:
        return (self.embedding.points + self.embedding.displace.plain(moves)[0],)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self.embedding.displace(*tangents)


class Gathering(AbstractKernel):
    """Point cotangents to control cotangents: the transpose of the displacement, linear too."""

    def __init__(self, embedding: AbstractEmbedding):
        self.embedding = embedding

    @override
    def run(self, vectors: np.ndarray) -> tuple[np.ndarray, ...]:
        return (self.embedding.gathered(vectors),)

    @override
    def plain(self, vectors: Array) -> tuple[Array, ...]:
        shape = jax.ShapeDtypeStruct((self.embedding.count, 3), jnp.float64)
        return jax.linear_transpose(self.embedding.displace.plain, shape)((vectors,))

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self(*tangents)

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        return self.embedding.displace(*cotangents)


class EmbeddedBinding(AbstractBinding):
    """A net of control points on fixed points: embedded once, one pass per deformation."""

    net: AbstractControlNet
    embedding: AbstractEmbedding = eqx.field(static=True)

    @override
    def __call__(self, controls: Vector) -> Points:
        return self.embedding.move(self.net.moves(controls).reshape(-1, 3))[0]

    def jacobian(self) -> scipy.sparse.csr_array:
        """Derivative of all coordinates by all controls, sparse, shape (3n, k)."""
        free = scipy.sparse.diags_array((~self.net.frozen.ravel()).astype(float))
        weights = scipy.sparse.csr_array(self.embedding.matrix() @ free)
        weights.eliminate_zeros()
        return scipy.sparse.csr_array(scipy.sparse.kron(weights, np.eye(3)))
