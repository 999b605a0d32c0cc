"""What every deformer is: a map of points that obeys controls."""

import abc
import inspect
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector


class AbstractBinding(eqx.Module):
    """A deformer tied to points that stay where they are: controls in, points out."""

    @abc.abstractmethod
    def __call__(self, controls: Vector) -> Points:
        """The points moved by the controls; differentiable by JAX in both modes."""


class AbstractDeformer(eqx.Module):
    """A map of points that obeys controls.

    Write `__call__`, the definition, in plain JAX, or `bind`, its fast form for fixed points; each
    is made from the other where only one is written. Every point moves by itself: the result
    for one does not depend on which others are there.
    """

    @property
    @abc.abstractmethod
    def size(self) -> int:
        """Number of controls."""

    @property
    def neutral(self) -> Vector:
        """Controls that leave every point where it is: zero, unless they are absolute."""
        return np.zeros(self.size)

    def __call__(self, points: Points, controls: Vector) -> Points:
        """The definition: points moved by the controls, differentiable in both."""
        return self.bind(points)(controls)

    def bind(self, points: Points) -> AbstractBinding:
        """The same for points that do not move, with all done that controls do not affect."""
        return DefinedBinding(self, points)

    def follow(self, points: Points, controls: Vector) -> Points:
        """The same for points that an earlier stage moves, by the fastest way there is."""
        return _defined(self, points, controls)

    def settle(
        self, points: Points, controls: Vector
    ) -> tuple["AbstractDeformer", Float[Array, "m"]]:
        """What moves points, once the present shape is known; only pilots need to know it."""
        return self, controls

    @classmethod
    def build(cls, geometry: Any, **options: Any) -> "AbstractDeformer":
        """Make one from a case file's options, for a geometry; by default they are its fields."""
        arrays = {k: jnp.asarray(v) if isinstance(v, list) else v for k, v in options.items()}
        return cls(**arrays)

    @classmethod
    def options(cls) -> dict[str, inspect.Parameter]:
        """What `build` accepts, by name; by default the fields."""
        own = inspect.signature(cls.build, eval_str=True).parameters
        if any(p.kind is p.VAR_KEYWORD for p in own.values()):
            own = inspect.signature(cls, eval_str=True).parameters
        return {k: p for k, p in own.items() if k not in ("self", "geometry")}


@eqx.filter_jit
def _defined(deformer: AbstractDeformer, points: Points, controls: Vector) -> Points:
    return deformer(points, controls)


class DefinedBinding(AbstractBinding):
    """A deformer's definition on fixed points."""

    deformer: AbstractDeformer
    points: Points

    @override
    def __call__(self, controls: Vector) -> Points:
        return _defined(self.deformer, self.points, controls)


class LinearBinding(AbstractBinding):
    """Points plus modes times controls.

    Attributes
    ----------
    points
        Where the points are at rest.
    modes
        Motion of every point for a unit of each control, shape (n, 3, k).
    """

    points: Points
    modes: Array

    @override
    def __call__(self, controls: Vector) -> Points:
        return _linear(self.points, self.modes, controls)


@jax.jit
def _linear(points: Points, modes: Array, controls: Vector) -> Points:
    return points + jnp.asarray(modes) @ controls


def map_slopes(deformer: AbstractDeformer, points: Points, controls: Vector) -> Array:
    """Derivative of each moved point by its place before, shape (n, 3, 3): row moved, column place.

    Three forward derivatives do for all points, since each moves by itself.
    """
    points = jnp.asarray(points)

    def pushed(axis: Float[Array, "3"]) -> Points:
        along = jnp.broadcast_to(axis, points.shape)
        return jax.jvp(lambda p: deformer.follow(p, controls), (points,), (along,))[1]

    return jax.vmap(pushed, out_axes=2)(jnp.eye(3))
