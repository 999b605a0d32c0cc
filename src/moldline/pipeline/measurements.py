"""Measures of what a pipeline gives: readouts, and constraints for an optimiser."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array, Points
from ..errors import ParameterError
from ..measures.base import AbstractMeasure, Constraint
from ..mesh import Geometry
from .pipeline import Pipeline, Values

BEYOND = 1e-9
"""A number is beyond a bound by more than this part of it, or of 1 where that is larger."""


Maker: TypeAlias = Callable[[Geometry], AbstractMeasure | Constraint]


class Measurements:
    """Named measures of a pipeline's geometry, with their bounds and exact derivatives.

    Where a union is made anew, its measures must be too: give functions of the geometry that
    make them.

    Attributes
    ----------
    pipeline
        What gives the geometry.
    constraints
        Measures with their bounds, by name; those given without have none.
    """

    def __init__(
        self,
        pipeline: Pipeline,
        measures: Mapping[str, AbstractMeasure | Constraint | Maker],
    ):
        self.pipeline = pipeline
        self._given = dict(measures)
        self.constraints = {
            name: _constraint(one, pipeline.geometry) for name, one in measures.items()
        }

    def __call__(self, values: Values | None = None) -> dict[str, np.ndarray]:
        """The numbers of each measure at some values of the variables."""
        full = self.pipeline.values(values)
        here = self._at(full)
        found = here._numbers(here.pipeline.points(full)) if here._is_made else here._valued(full)
        return {name: np.asarray(found[name]) for name in self.constraints}

    def jacobian(
        self, values: Values | None = None
    ) -> dict[str, dict[str, Float[np.ndarray, "k v"]]]:
        """Derivative of each measure's numbers by each variable's, in the variable's unit."""
        full = self.pipeline.values(values)
        return {name: self._slopes(name, full) for name in self.constraints}

    def beyond(self, numbers: Mapping[str, Array]) -> dict[str, np.ndarray]:
        """By how much numbers are beyond their bounds, for those measures where some are."""
        found = {}
        for name, constraint in self.constraints.items():
            low, high = constraint.bounds
            own = np.asarray(numbers[name])
            miss = np.maximum(np.maximum(low - own, own - high), 0.0)
            bound = np.where(own < low, low, high)
            size = np.maximum(1.0, np.where(miss > 0, np.abs(bound), 1.0))
            is_bounded = np.isfinite(low) | np.isfinite(high)
            if np.any(is_bounded & ~(miss <= BEYOND * size)):
                found[name] = miss
        return found

    def bounded(self, variables: Sequence[str] | None = None) -> list[Any]:
        """Constraints for `scipy.optimize.minimize`, whose unknowns are the variables' numbers.

        `variables` names them, in order, all of the pipeline's by default; the others keep their
        own values. Measures without bounds give none.
        """
        from scipy.optimize import NonlinearConstraint

        return [
            NonlinearConstraint(
                lambda x, n=name: self(self.split(x, variables))[n],
                *constraint.bounds,
                jac=lambda x, n=name: self._rows(n, x, variables),
            )
            for name, constraint in self.constraints.items()
            if np.any(np.isfinite(constraint.bounds))
        ]

    def split(
        self, x: Float[np.ndarray, "v"], variables: Sequence[str] | None = None
    ) -> dict[str, Any]:
        """Values by name from one vector of the variables' numbers."""
        known = self.pipeline.variables
        names = list(known) if variables is None else list(variables)
        sizes = [known[name].size for name in names]
        if len(x) != sum(sizes):
            raise ParameterError(f"{', '.join(names)} have {sum(sizes)} numbers, got {len(x)}")
        return dict(zip(names, np.split(np.asarray(x), np.cumsum(sizes)[:-1]), strict=True))

    def _rows(
        self, name: str, x: np.ndarray, variables: Sequence[str] | None
    ) -> Float[np.ndarray, "k v"]:
        values = self.split(x, variables)
        slopes = self._slopes(name, self.pipeline.values(values))
        return np.concatenate([slopes[key] for key in values], axis=1)

    def _at(self, full: dict[str, Array]) -> "Measurements":
        """These measures, or where the geometry is made anew, those of the new one."""
        pipeline = self.pipeline.at(full)
        if pipeline is self.pipeline:
            return self
        if not self._recent or self._recent[0].pipeline is not pipeline:
            fixed = [name for name, one in self._given.items() if not _is_maker(one)]
            if fixed:
                raise ParameterError(
                    f"measure {fixed[0]!r} was made for a surface that is made anew at these "
                    "values, with other points: give a function of the surface that makes it"
                )
            self._recent[:] = [Measurements(pipeline, self._given)]
        return self._recent[0]

    def _slopes(self, name: str, full: dict[str, Array]) -> dict[str, np.ndarray]:
        here = self._at(full)
        if not here._is_made:
            return {key: np.asarray(rows) for key, rows in here._sloped[name](full).items()}
        measure = here.constraints[name].measure
        pull = jax.vjp(measure, here.pipeline.points(full))[1]
        rows = [here.pipeline.pullback(full, *pull(row)) for row in jnp.eye(measure.size)]
        return {key: np.stack([row[key] for row in rows]) for key in full}

    @property
    def _is_made(self) -> bool:
        """Whether others or a program make the geometry, which cannot be compiled once for all."""
        names = self.pipeline.feeding
        return len(names) > 1 or any(self.pipeline.branches[name].is_foreign for name in names)

    @cached_property
    def _recent(self) -> list["Measurements"]:
        return []

    def _numbers(self, points: Points) -> dict[str, Array]:
        return {name: one.measure(points) for name, one in self.constraints.items()}

    @cached_property
    def _valued(self) -> Any:
        return jax.jit(lambda full: self._numbers(self.pipeline.points(full)))

    @cached_property
    def _sloped(self) -> dict[str, Any]:
        def slopes(measure: AbstractMeasure, full: dict[str, Array]) -> dict[str, Array]:
            pull = jax.vjp(lambda v: measure(self.pipeline.points(v)), full)[1]
            return jax.lax.map(lambda one: pull(one)[0], jnp.eye(measure.size))

        return {
            name: jax.jit(lambda full, m=one.measure: slopes(m, full))
            for name, one in self.constraints.items()
        }


def _is_maker(one: AbstractMeasure | Constraint | Maker) -> bool:
    return not isinstance(one, AbstractMeasure | Constraint)


def _constraint(one: AbstractMeasure | Constraint | Maker, geometry: Geometry) -> Constraint:
    made = one(geometry) if _is_maker(one) else one  # type: ignore[operator, arg-type]
    return made if isinstance(made, Constraint) else Constraint(made)  # type: ignore[arg-type]
