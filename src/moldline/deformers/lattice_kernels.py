"""The lattice's compiled kernel for points that move."""

from typing import TYPE_CHECKING

import numpy as np
from typing_extensions import override

from .._types import Array
from ..numerics import cellwise
from .following import AbstractFollowing, Pull, Push

if TYPE_CHECKING:
    from .lattice import Lattice


class Following(AbstractFollowing):
    """Points and control displacements to moved points, cell by cell."""

    def __init__(self, lattice: "Lattice"):
        self.lattice = lattice
        self.box = cellwise.Box.of(lattice.origin, lattice.inverse, lattice.axes)
        self.weights = cellwise.Weights.of(lattice.axes)
        self.push, self.pull = Push(self), Pull(self)

    @override
    def run(self, points: np.ndarray, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        return (cellwise.followed(self.box, self.weights, moves, points),)

    @override
    def plain(self, points: Array, moves: Array) -> tuple[Array, ...]:
        return (points + self.lattice.field(points, moves),)

    @override
    def pushed(
        self, points: np.ndarray, moves: np.ndarray, motion: np.ndarray, change: np.ndarray
    ) -> np.ndarray:
        return cellwise.pushed(self.box, self.weights, moves, change, points, motion)

    @override
    def pulled(
        self, points: np.ndarray, moves: np.ndarray, vectors: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        return cellwise.pulled(self.box, self.weights, moves, points, vectors)
