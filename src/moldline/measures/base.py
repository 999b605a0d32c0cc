"""What every measure is: numbers of a shape, differentiable by its points."""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from .._types import Points, Vector


class AbstractMeasure(eqx.Module):
    """Some numbers of a shape.

    A measure says which points it reads, so that whoever solves for it need only move these.
    """

    reads: eqx.AbstractVar[np.ndarray]
    """Numbers of the points that it reads."""

    @property
    @abc.abstractmethod
    def size(self) -> int:
        """How many numbers it gives."""

    @property
    def is_affine(self) -> bool:
        """Whether the numbers change in proportion to the points' motion."""
        return False

    @abc.abstractmethod
    def of(self, places: Points) -> Vector:
        """The numbers, from the places of the points that it reads; plain JAX."""

    def __call__(self, points: Points) -> Vector:
        """The numbers of a shape, from all its points."""
        return self.of(jnp.asarray(points)[self.reads])


def as_rows(numbers: Int[np.ndarray, "..."]) -> tuple[np.ndarray, np.ndarray]:
    """Which points are named, ascending, and the same array counted among these."""
    reads, own = np.unique(numbers, return_inverse=True)
    return reads, own.reshape(np.shape(numbers))
