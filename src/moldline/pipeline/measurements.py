"""Measures of what a pipeline gives: readouts, and constraints for an optimiser."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array
from ..errors import ParameterError
from ..measures.base import AbstractMeasure, Constraint
from .pipeline import Pipeline, Values

BEYOND = 1e-9
"""A number is beyond a bound by more than this part of it, or of 1 where that is larger."""


class Measurements:
    """Named measures of a pipeline's geometry, with their bounds and exact derivatives.

    Attributes
    ----------
    pipeline
        What gives the geometry.
    constraints
        Measures with their bounds, by name; those given without have none.
    """

    def __init__(self, pipeline: Pipeline, measures: Mapping[str, AbstractMeasure | Constraint]):
        self.pipeline = pipeline
        self.constraints = {
            name: one if isinstance(one, Constraint) else Constraint(one)
            for name, one in measures.items()
        }

    def __call__(self, values: Values | None = None) -> dict[str, np.ndarray]:
        """The numbers of each measure at some values of the variables."""
        found = self._valued(self.pipeline.values(values))
        return {name: np.asarray(found[name]) for name in self.constraints}

    def jacobian(
        self, values: Values | None = None
    ) -> dict[str, dict[str, Float[np.ndarray, "k v"]]]:
        """Derivative of each measure's numbers by each variable's, in the variable's unit."""
        full = self.pipeline.values(values)
        return {
            name: {key: np.asarray(rows) for key, rows in self._sloped[name](full).items()}
            for name in self.constraints
        }

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
        slopes = self._sloped[name](self.pipeline.values(values))
        return np.concatenate([np.asarray(slopes[key]) for key in values], axis=1)

    @cached_property
    def _valued(self) -> Any:
        def numbers(full: dict[str, Array]) -> dict[str, Array]:
            points = self.pipeline.points(full)
            return {name: one.measure(points) for name, one in self.constraints.items()}

        return jax.jit(numbers)

    @cached_property
    def _sloped(self) -> dict[str, Any]:
        def slopes(measure: AbstractMeasure, full: dict[str, Array]) -> dict[str, Array]:
            pull = jax.vjp(lambda v: measure(self.pipeline.points(v)), full)[1]
            return jax.lax.map(lambda one: pull(one)[0], jnp.eye(measure.size))

        return {
            name: jax.jit(lambda full, m=one.measure: slopes(m, full))
            for name, one in self.constraints.items()
        }
