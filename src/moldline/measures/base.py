"""What every measure is: numbers of a shape, differentiable by its points."""

import abc
import inspect
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._types import Array, Points, Vector
from ..errors import ParameterError


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

    def under(self, places: Points, controls: Float[Array, "c"]) -> Vector:
        """The same, for a measure that reads the controls of the deformer too; few do."""
        return self.of(places)

    def marks(self, places: Points) -> Array:
        """Where pictures mark it, from the places of the points that it reads: these."""
        return places

    def __call__(self, points: Points) -> Vector:
        """The numbers of a shape, from all its points."""
        return self.of(jnp.asarray(points)[self.reads])

    @classmethod
    @abc.abstractmethod
    def build(cls, geometry: Any, **options: Any) -> "AbstractMeasure":
        """Make one from a case file's options, for a geometry."""

    @classmethod
    def options(cls) -> dict[str, inspect.Parameter]:
        """What `build` accepts, by name."""
        own = inspect.signature(cls.build, eval_str=True).parameters
        return {k: p for k, p in own.items() if k != "geometry"}


@dataclass(frozen=True, eq=False)
class Constraint:
    """A measure with bounds.

    Attributes
    ----------
    measure
        What is bounded.
    lower, upper
        Bounds of each of its numbers, or one for all, in its own unit; none by default. Where
        both are equal the number is prescribed.
    weight
        What a miss counts where conditions contradict each other and are met in least squares.
    """

    measure: AbstractMeasure
    lower: Any = -np.inf
    upper: Any = np.inf
    weight: float = 1.0

    def __post_init__(self) -> None:
        try:
            low, high = self.bounds
        except ValueError:
            raise ParameterError(
                f"a measure of {self.measure.size} numbers takes one bound or as many, got "
                f"{self.lower} and {self.upper}"
            ) from None
        if not np.all((low <= high) & (low < np.inf) & (high > -np.inf)):
            raise ParameterError(f"bounds {self.lower} and {self.upper} leave no choice")
        if not 0 < self.weight < np.inf:
            raise ParameterError(f"a weight is above zero, got {self.weight}")

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bound of each number."""
        low, high = (
            np.broadcast_to(np.asarray(bound, float), self.measure.size).copy()
            for bound in (self.lower, self.upper)
        )
        return low, high


def as_rows(numbers: Int[np.ndarray, "..."]) -> tuple[np.ndarray, np.ndarray]:
    """Which points are named, ascending, and the same array counted among these."""
    reads, own = np.unique(numbers, return_inverse=True)
    return reads, own.reshape(np.shape(numbers))
