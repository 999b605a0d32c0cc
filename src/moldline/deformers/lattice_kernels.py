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
        self.displace = Displacement(self)
        self.move = Motion(self)
        self.gather = Gathering(self)

    def weights(self) -> scipy.sparse.csr_array:
        """Weight of each control point at each point, shape (n, nu nv nw), frozen ones zero."""
        u = (self.points - self.lattice.origin) @ self.lattice.inverse
        factors = [_taps(axis, u[:, i]) for i, axis in enumerate(self.lattice.axes)]
        (iu, wu), (iv, wv), (iw, ww) = factors
        _, nv, nw = self.lattice.shape
        column = (iu[:, :, None, None] * nv + iv[:, None, :, None]) * nw + iw[:, None, None, :]
        value = wu[:, :, None, None] * wv[:, None, :, None] * ww[:, None, None, :]
        value = np.where(self.lattice.frozen.ravel()[column], 0.0, value)
        row = np.broadcast_to(np.arange(len(u))[:, None, None, None], column.shape)
        shape = (len(u), self.lattice.size // 3)
        weights = scipy.sparse.coo_array((value.ravel(), (row.ravel(), column.ravel())), shape)
        weights = weights.tocsr()
        weights.eliminate_zeros()
        return weights


def _taps(axis: "cellwise.Axis", u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The few control points that act on each coordinate along one axis, and their weights."""
    acting = np.any(axis.powers != 0, axis=1)
    width = max(int(acting.sum(axis=1).max()), 1)
    index = np.argsort(~acting, axis=1, kind="stable")[:, :width]
    cell, t = cellwise.located(axis, u)
    polynomials = np.take_along_axis(axis.powers, index[:, None, :], axis=2)[cell]
    weight = np.einsum("na,nak->nk", t[:, None] ** np.arange(axis.terms), polynomials)
    return index[cell], weight


class Displacement(AbstractKernel):
    """Control displacements to point displacements: linear."""

    def __init__(self, embedding: Embedding):
        self.embedding = embedding

    @override
    def run(self, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        table = cellwise.coefficients(self.embedding.lattice.axes, moves)
        return (cellwise.displaced(self.embedding.blocks, table, None),)

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
        table = cellwise.coefficients(self.embedding.lattice.axes, moves)
        return (cellwise.displaced(self.embedding.blocks, table, self.embedding.points),)

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
        axes = self.embedding.lattice.axes
        moments = cellwise.moments(self.embedding.blocks, axes, vectors)
        return (cellwise.gathered(axes, moments),)

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
        self.push = Push(self)
        self.pull = Pull(self)

    def table(self, moves: np.ndarray) -> np.ndarray:
        """Polynomial coefficients of a field."""
        return cellwise.coefficients(self.lattice.axes, moves)

    @override
    def run(self, points: np.ndarray, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        return (cellwise.followed(self.box, self.table(moves), points),)

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
        tables = self.value.table(moves), self.value.table(change)
        return (cellwise.pushed(self.value.box, *tables, points, motion),)

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
        box, table = self.value.box, self.value.table(moves)
        at_points, moments = cellwise.pulled(box, table, points, vectors)
        return at_points, cellwise.gathered(self.value.lattice.axes, moments)

    @override
    def plain(self, points: Array, moves: Array, vectors: Array) -> tuple[Array, ...]:
        return jax.vjp(self.value.plain, points, moves)[1]((vectors,))

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        points, moves = arrays[:2]
        return (None, None, *self.value.push(points, moves, *cotangents))
