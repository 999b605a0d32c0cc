"""A harmonic cage's compiled kernel for points that move."""

from typing import TYPE_CHECKING

import numpy as np
from typing_extensions import override

from .._types import Array
from ..numerics.winding import winding
from .cage_embedding import embedded
from .following import AbstractFollowing, Pull, Push

if TYPE_CHECKING:
    from .cage import Cage


class Following(AbstractFollowing):
    """Points and the cage's displacements to moved points, by its weights where they are."""

    def __init__(self, cage: "Cage"):
        self.cage = cage
        self.push, self.pull = Push(self), Pull(self)

    @override
    def run(self, points: np.ndarray, moves: np.ndarray) -> tuple[np.ndarray, ...]:
        return (embedded(self.cage, points, refuse=False).displaced(moves, points),)

    @override
    def plain(self, points: Array, moves: Array) -> tuple[Array, ...]:
        return (self.cage.followed(points, moves),)

    @override
    def pushed(
        self, points: np.ndarray, moves: np.ndarray, motion: np.ndarray, change: np.ndarray
    ) -> np.ndarray:
        pushed = motion + np.einsum("nij,nj->ni", self.slopes(points, moves), motion)
        if np.any(change):
            pushed += embedded(self.cage, points, refuse=False).displaced(change, None)
        return pushed

    @override
    def pulled(
        self, points: np.ndarray, moves: np.ndarray, vectors: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        pulled = vectors + np.einsum("nij,ni->nj", self.slopes(points, moves), vectors)
        return pulled, embedded(self.cage, points, refuse=False).gathered(vectors)

    def slopes(self, points: np.ndarray, moves: np.ndarray) -> np.ndarray:
        """Derivatives of displacements by the points, (n, 3, 3): row moved, column place."""
        found, kind = self.cage.solved.slopes(points, moves)  # type: ignore[union-attr]
        near = np.flatnonzero(kind > 0)  # others are inside
        around = winding(points[near], self.cage.rest, self.cage.shape.faces)
        found[near[around <= 0.5]] = 0.0
        return found
