"""The lattice's compiled kernels, and how they are each other's derivatives."""

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse
from typing_extensions import override

from .._types import Array
from ..numerics import cellwise
from ..numerics.kernel import AbstractKernel, Arrays

if TYPE_CHECKING:
    from .lattice import Lattice


class Embedding:
    """Fixed points in a lattice, sorted by cell; its three kernels take control displacements.

    Compared by identity, as its kernels are.
    """

    def __init__(self, lattice: "Lattice", points: np.ndarray):
        self.lattice = lattice
        self.points = points
        self.blocks = cellwise.blocks(lattice.axes, (points - lattice.origin) @ lattice.inverse)
        self.weights = lattice.following.weights
        self.displace = Displacement(self)
        self.move = Motion(self)
        self.gather = Gathering(self)

    def matrix(self) -> scipy.sparse.csr_array:
        """Weight of each control point at each point, shape (n, nu nv nw), frozen ones zero."""
        u = (self.points - self.lattice.origin) @ self.lattice.inverse
        (iu, wu), (iv, wv), (iw, ww) = (self._taps(i, u[:, i]) for i in range(3))
        _, nv, nw = self.lattice.shape
        column = (iu[:, :, None, None] * nv + iv[:, None, :, None]) * nw + iw[:, None, None, :]
        value = wu[:, :, None, None] * wv[:, None, :, None] * ww[:, None, None, :]
        value = np.where(self.lattice.frozen.ravel()[column], 0.0, value)
        row = np.broadcast_to(np.arange(len(u))[:, None, None, None], column.shape)
        shape = (len(u), self.lattice.size // 3)
        matrix = scipy.sparse.coo_array((value.ravel(), (row.ravel(), column.ravel())), shape)
        matrix = matrix.tocsr()
        matrix.eliminate_zeros()
        return matrix

    def _taps(self, number: int, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The few control points that act on each coordinate along one axis, and their weights."""
        cell, t = cellwise.located(self.lattice.axes[number], u)
        near = self.weights.near[number]
        index = self.weights.first[number][cell, None] + np.arange(near.shape[2])
        return index, np.einsum("na,nak->nk", t[:, None] ** np.arange(near.shape[1]), near[cell])


class Displacement(AbstractKernel):
    """Control displacements to point displacements: linear."""

    def __init__(self, embedding: Embedding):
        self.embedding = embedding

    @override
    def run(self, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        e = self.embedding
        return (cellwise.displaced(e.blocks, e.weights, moves, None),)

    @override
    def plain(self, moves: Array) -> tuple[Array, ...]:
        return (self.embedding.lattice.field(self.embedding.points, moves),)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self(*tangents)

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        return self.embedding.gather(*cotangents)


class Motion(AbstractKernel):
    """Control displacements to moved points: the displacement kernel with the rest added in it."""

    def __init__(self, embedding: Embedding):
        self.embedding = embedding

    @override
    def run(self, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        e = self.embedding
        return (cellwise.displaced(e.blocks, e.weights, moves, e.points),)

    @override
    def plain(self, moves: Array) -> tuple[Array, ...]:
        return (self.embedding.points + self.embedding.displace.plain(moves)[0],)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self.embedding.displace(*tangents)


class Gathering(AbstractKernel):
    """Point cotangents to control cotangents: the transpose of the displacement, linear too."""

    def __init__(self, embedding: Embedding):
        self.embedding = embedding

    @override
    def run(self, vectors: np.ndarray) -> tuple[np.ndarray, ...]:
        e = self.embedding
        return (cellwise.pulled_back(e.blocks, e.weights, vectors),)

    @override
    def plain(self, vectors: Array) -> tuple[Array, ...]:
        shape = jax.ShapeDtypeStruct((*self.embedding.lattice.shape, 3), jnp.float64)
        return jax.linear_transpose(self.embedding.displace.plain, shape)((vectors,))

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self(*tangents)

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        return self.embedding.displace(*cotangents)


class Following(AbstractKernel):
    """Points and control displacements to moved points, for points that are not fixed."""

    def __init__(self, lattice: "Lattice"):
        self.lattice = lattice
        self.box = cellwise.Box.of(lattice.origin, lattice.inverse, lattice.axes)
        self.weights = cellwise.Weights.of(lattice.axes)
        self.push = Push(self)
        self.pull = Pull(self)

    @override
    def run(self, points: np.ndarray, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        return (cellwise.followed(self.box, self.weights, moves, points),)

    @override
    def plain(self, points: Array, moves: Array) -> tuple[Array, ...]:
        return (points + self.lattice.field(points, moves),)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return self.push(*arrays, *tangents)


class Push(AbstractKernel):
    """Points, control displacements and a tangent of each to the tangent of the moved points."""

    def __init__(self, value: Following):
        self.value = value

    @override
    def run(
        self, points: np.ndarray, moves: np.ndarray, motion: np.ndarray, change: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        v = self.value
        return (cellwise.pushed(v.box, v.weights, moves, change, points, motion),)

    @override
    def plain(self, points: Array, moves: Array, motion: Array, change: Array) -> tuple[Array, ...]:
        return jax.jvp(self.value.plain, (points, moves), (motion, change))[1]

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        points, moves = arrays[:2]
        return (None, None, *self.value.pull(points, moves, *cotangents))


class Pull(AbstractKernel):
    """Points, control displacements and a cotangent to the cotangents of both."""

    def __init__(self, value: Following):
        self.value = value

    @override
    def run(
        self, points: np.ndarray, moves: np.ndarray, vectors: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        return cellwise.pulled(self.value.box, self.value.weights, moves, points, vectors)

    @override
    def plain(self, points: Array, moves: Array, vectors: Array) -> tuple[Array, ...]:
        return jax.vjp(self.value.plain, points, moves)[1]((vectors,))

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        points, moves = arrays[:2]
        return (None, None, *self.value.push(points, moves, *cotangents))
