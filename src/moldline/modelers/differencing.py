"""Shapes that other programs make: their points as a JAX operation, derivatives by differences.

What makes the points is a plain function of the parameters. Each parameter is moved by a step
and by half of it, to both sides: two central differences, extrapolated to one whose error is of
the fourth order. Their disagreement says how large an error to expect.
"""

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Geometry, Surface
from ..numerics.kernel import AbstractKernel, Arrays
from .base import AbstractMaking, AbstractShape
from .quantities import Quantities

STEP = 1e-3
"""Unless it is given, the step by a parameter's size, or by 1 for those that are smaller."""

DOUBTFUL = 1e-4
"""A derivative whose error is larger than this part of its largest entry is warned of."""

log = logging.getLogger("moldline.modelers")


class Differences(NamedTuple):
    """Derivatives of all points by all parameters, and how good they are.

    Attributes
    ----------
    jacobian
        Of shape (n, 3, k).
    errors
        For each parameter how far the central differences of two steps were apart, by the largest
        entry of its derivative: the extrapolated one is better by far, unless there is noise.
    steps
        The longer of the two.
    """

    jacobian: np.ndarray
    errors: np.ndarray
    steps: np.ndarray


def differences(
    function: Callable[[np.ndarray], np.ndarray], values: np.ndarray, steps: np.ndarray
) -> Differences:
    """Derivatives of a function by each number, from four calls of it."""
    columns, errors = [], []
    for k, step in enumerate(steps.tolist()):
        way = np.zeros(len(values))
        way[k] = 1.0
        coarse, fine = (
            (function(values + h * way) - function(values - h * way)) / (2 * h)
            for h in (step, step / 2)
        )
        columns.append((4 * fine - coarse) / 3)
        size = np.abs(fine).max(initial=0.0)
        errors.append(float(np.abs(fine - coarse).max(initial=0.0) / size) if size else 0.0)
    return Differences(np.stack(columns, axis=-1), np.array(errors), steps)


def steps_of(quantities: Quantities, given: Mapping[str, float] | None) -> np.ndarray:
    """Steps of all numbers, from those given by name."""
    if unknown := set(given or {}) - set(quantities.names):
        raise ParameterError(
            f"steps of {', '.join(sorted(unknown))}, which are no parameters; there are "
            f"{', '.join(quantities.names) or 'none'}"
        )
    parts = []
    for name, own in zip(quantities.names, quantities.numbers, strict=True):
        step = (given or {}).get(name)
        if step is not None and not (np.isfinite(step) and step > 0):
            raise ParameterError(f"the step of {name} must be above 0, got {step}")
        parts.append(STEP * np.maximum(np.abs(own), 1.0) if step is None else 0 * own + step)
    return np.concatenate(parts) if parts else np.zeros(0)


class Programmed(AbstractKernel):
    """Parameters to points by another program; the last points and derivatives are kept."""

    def __init__(
        self,
        function: Callable[[dict[str, Any]], np.ndarray],
        given: Mapping[str, Any],
        steps: Mapping[str, float] | None,
        points: np.ndarray,
    ):
        """`function` takes numbers and lists by name.

        `given` is what they are to begin with, and `points` what comes of that.
        """
        self.function, self.given = function, dict(given)
        self.quantities = Quantities(self.given)
        self.steps = steps_of(self.quantities, steps)
        self.lock = threading.RLock()
        self.points = self.values.tobytes(), points
        self.slopes: tuple[bytes, Differences] | None = None
        self.shape = points.shape

    @property
    def values(self) -> np.ndarray:
        """The parameters as they are given to begin with."""
        return self.quantities.values if self.given else np.zeros(0)

    def named(self, values: np.ndarray) -> dict[str, Any]:
        """Numbers by name; a list where one was given."""
        parts = self.quantities.parted(np.asarray(values)) if self.given else {}
        return {
            name: np.asarray(own).tolist() if np.ndim(self.given[name]) else float(own[0])
            for name, own in parts.items()
        }

    def _call(self, values: np.ndarray) -> np.ndarray:
        points = self.function(self.named(values))
        if not np.isfinite(points).all():
            raise GeometryError("some points are no finite numbers")
        return points

    @override
    def run(self, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        (values,) = arrays
        with self.lock:
            key = values.tobytes()
            if self.points[0] != key:
                self.points = key, self._call(values)
            return (self.points[1].copy(),)

    def differences(self, values: np.ndarray) -> Differences:
        """Derivatives at some values; large errors are warned of."""
        with self.lock:
            key = values.tobytes()
            if self.slopes is None or self.slopes[0] != key:
                found = differences(self._call, values, self.steps)
                self.slopes = key, found
                self._warn(found)
            return self.slopes[1]

    def _warn(self, found: Differences) -> None:
        for name, rows in self.quantities.rows.items():
            error = found.errors[rows].max()
            if error > DOUBTFUL:
                log.warning(
                    "derivatives by %r differ by %.1g of their size between steps of %g and half "
                    "of it; give steps = {%s = ...}: a longer one against noise, a shorter one "
                    "where the shape curves much",
                    name, error, found.steps[rows].max(), name,
                )  # fmt: skip

    @override
    def plain(self, *arrays: Array) -> tuple[Array, ...]:
        out = jax.ShapeDtypeStruct(self.shape, np.float64)
        return (jax.pure_callback(lambda v: self.run(np.asarray(v))[0], out, *arrays),)

    @override
    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        return Pushed(self)(*arrays, *tangents)


class Pushed(AbstractKernel):
    """Parameters and their change to the motion of points."""

    def __init__(self, program: Programmed):
        self.program = program

    @override
    def run(self, values: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, ...]:
        return (self.program.differences(values).jacobian @ change,)

    @override
    def plain(self, values: Array, change: Array) -> tuple[Array, ...]:
        out = jax.ShapeDtypeStruct(self.program.shape, np.float64)
        return (
            jax.pure_callback(lambda *a: self.run(*map(np.asarray, a))[0], out, values, change),
        )

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        return None, *Pulled(self.program)(arrays[0], *cotangents)


class Pulled(AbstractKernel):
    """Parameters and a vector at each point to the gradient by the parameters."""

    def __init__(self, program: Programmed):
        self.program = program

    @override
    def run(self, values: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, ...]:
        return (np.einsum("nic,ni->c", self.program.differences(values).jacobian, vectors),)

    @override
    def plain(self, values: Array, vectors: Array) -> tuple[Array, ...]:
        out = jax.ShapeDtypeStruct(values.shape, np.float64)
        return (
            jax.pure_callback(lambda *a: self.run(*map(np.asarray, a))[0], out, values, vectors),
        )

    @override
    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        return None, *Pushed(self.program)(arrays[0], *cotangents)


class AbstractProgrammed(AbstractShape):
    """A shape whose points another program makes.

    Attributes
    ----------
    program
        What makes the points of the parameters.
    surface
        What it makes of its own ones [m].
    """

    program: eqx.AbstractVar[Programmed]
    surface: eqx.AbstractVar[Surface]

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return self.program.quantities.rows

    @property
    @override
    def values(self) -> Vector:
        return self.program.values

    @property
    @override
    def geometry(self) -> Surface:
        return self.surface

    @override
    def __call__(self, parameters: Vector) -> Points:
        if not self.size:
            return self.surface.points
        return self.program(parameters)[0]

    @override
    def bind(self, *geometries: Geometry, names: Sequence[str] | None = None) -> "Modelled":
        return Modelled(shape=self, geometry=self.surface)

    def differences(self, parameters: Vector | None = None) -> Differences:
        """Derivatives by all parameters, with their errors and steps."""
        values = self.values if parameters is None else parameters
        return self.program.differences(np.asarray(values, float))


class Modelled(AbstractMaking):
    """A shape of another program with what it makes of its own values; never compiled.

    So its errors (a changed topology, a program that fails) stay what they are.
    """

    shape: AbstractShape
    geometry: Geometry

    @override
    def __call__(self, parameters: Vector, *points: Any) -> Points:
        return self.shape(parameters)
