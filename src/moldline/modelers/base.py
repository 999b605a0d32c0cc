"""What every modeler is: it makes a geometry from parameters and from other geometries."""

import abc
import inspect
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry


class AbstractMaking(eqx.Module):
    """A modeler tied to the geometries that it takes: parameters and their points in, points out.

    Attributes
    ----------
    geometry
        What it makes of the parameters' own values and the geometries it is tied to.
    """

    geometry: eqx.AbstractVar[Geometry]

    @abc.abstractmethod
    def __call__(self, parameters: Vector, *points: Array) -> Array:
        """Points of `geometry` for other parameters and moved points; JAX differentiates it."""

    @property
    def is_foreign(self) -> bool:
        """Whether it is no JAX inside: not compiled, and differentiated by directions."""
        return False

    def along(
        self,
        parameters: Vector,
        points: Sequence[Array],
        changes: Sequence[tuple[Vector, Sequence[Array]]],
    ) -> list[Array]:
        """Motions of its points for several changes of the parameters and of those points."""
        given = (parameters, *points)
        return [jax.jvp(self, given, (change, *moves))[1] for change, moves in changes]

    def holds(self, *points: Array) -> bool:
        """Whether the same connectivity is still right for moved points; concrete ones only."""
        return True


class AbstractModeler(eqx.Module):
    """Makes a geometry; its parameters have names, and values of their own."""

    @property
    def parameters(self) -> dict[str, np.ndarray]:
        """Numbers of the parameters, counted from 0, by the name of what they are."""
        return {}

    @property
    def values(self) -> Vector:
        """What the parameters are unless told otherwise [m, rad, 1]."""
        return np.zeros(0)

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.values)

    def check(self, parameters: Vector) -> None:
        """Raise ParameterError for parameters that it would refuse as values of its own."""

    @property
    @abc.abstractmethod
    def takes(self) -> tuple[int, float]:
        """The least and the most geometries that it is made from."""

    @abc.abstractmethod
    def bind(self, *geometries: Geometry, names: Sequence[str] | None = None) -> AbstractMaking:
        """Tie it to geometries, with all done that moving them does not affect.

        `names` are what errors and reports call them.
        """

    @classmethod
    def build(cls, folder: Path, **options: Any) -> "AbstractModeler":
        """Make one from a case file's options; paths in them are relative to `folder`."""
        arrays = {k: _array(k, v) if isinstance(v, list) else v for k, v in options.items()}
        return cls(**arrays)

    @classmethod
    def options(cls) -> dict[str, inspect.Parameter]:
        """What `build` accepts, by name; by default what the class is made from."""
        own = inspect.signature(cls.build, eval_str=True).parameters
        if any(p.kind is p.VAR_KEYWORD for p in own.values()):
            own = inspect.signature(cls, eval_str=True).parameters
        return {k: p for k, p in own.items() if k not in ("self", "folder")}


def _array(name: str, given: list[Any]) -> Array:
    try:
        return jnp.asarray(given)
    except (TypeError, ValueError):
        raise ParameterError(
            f"{name} must be numbers, in rows of one length; got {given}"
        ) from None


class AbstractShape(AbstractModeler):
    """A modeler that begins from nothing but its parameters."""

    @abc.abstractmethod
    def __call__(self, parameters: Vector) -> Points:
        """The points, by plain JAX; how many there are, and in which order, never changes."""

    @property
    @abc.abstractmethod
    def geometry(self) -> Geometry:
        """What it makes of its own values, with its connectivity and names."""

    @property
    @override
    def takes(self) -> tuple[int, float]:
        return (0, 0)

    @override
    def bind(self, *geometries: Geometry, names: Sequence[str] | None = None) -> AbstractMaking:
        return Shaped(shape=self, geometry=self.geometry)


class Shaped(AbstractMaking):
    """A shape's definition with what it makes of its own values."""

    shape: AbstractShape
    geometry: Geometry

    @override
    def __call__(self, parameters: Vector, *points: Array) -> Array:
        return shaped(self.shape, parameters)


@eqx.filter_jit
def shaped(shape: AbstractShape, parameters: Vector) -> Points:
    """What the shape's definition says, compiled."""
    return shape(parameters)
