"""Pilots: what a shape measures is prescribed, and a hidden deformer obeys."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..measures.base import AbstractMeasure
from ..numerics.least_norm import Solution, independent, least_norm
from .base import AbstractDeformer
from .net import AbstractControlNet
from .posed import AbstractPosed

TOLERANCE = 1e-12
"""Of the last step, relative to the motion."""

ROUNDING = 1e-13
"""A miss that takes a motion of less than this part of the shape's size is none."""

UNMET = 1e-9
"""A condition is unmet where its miss takes a motion of more than this part of the shape's size."""

Measured = Callable[[Vector], Points]
"""From controls of the hidden deformer to the places that one measure reads."""


class PilotReport(NamedTuple):
    """How well the hidden deformer obeys.

    Attributes
    ----------
    misses
        What each measure is off by, by its name, in its own unit.
    unmet
        Names of those that are off by more than rounding.
    iterations
        Steps that the solver took; none where all is linear and at rest.
    is_converged
        Whether the last step was small.
    """

    misses: dict[str, np.ndarray]
    unmet: tuple[str, ...]
    iterations: int
    is_converged: bool


class Pilots(AbstractPosed):
    """Prescribe what a shape measures; a hidden deformer moves least to obey.

    Of all controls of the hidden deformer that give the pilots what is asked of them, and leave
    the constraints as they are at rest, those are taken whose weighted sum of squares is least.
    Where conditions contradict each other they are met in the least squares, and the report says
    which are not. Controls are changes of the pilots from what they measure at rest.

    Attributes
    ----------
    net
        The hidden deformer, which moves the shape and any other points.
    pilots, constraints
        Measures by name.
    rest
        Points of the shape at rest.
    weights
        What a change of each of the hidden deformer's controls costs.
    scales
        What motion of the hidden controls a change of each condition takes, inverted.
    combinations
        Independent combinations of the conditions in these scales.
    response
        Where all is linear: hidden controls for each condition.
    solver
        From changes of the pilots to hidden controls, on the shape at rest.

    Notes
    -----
    Source: AIAA 2012-0965, equations 1 to 7.
    """

    net: AbstractDeformer
    pilots: dict[str, AbstractMeasure]
    constraints: dict[str, AbstractMeasure]
    rest: Points
    wanted: Float[np.ndarray, "c"]
    weights: Float[np.ndarray, "n"]
    scales: Float[np.ndarray, "c"]
    combinations: Float[np.ndarray, "r c"]
    response: Float[np.ndarray, "n c"] | None
    solver: Callable[[Vector], Array] = eqx.field(static=True)

    def __init__(
        self,
        points: Points,
        hidden: AbstractDeformer,
        pilots: Mapping[str, AbstractMeasure],
        constraints: Mapping[str, AbstractMeasure] | None = None,
        weights: Any = 1.0,
    ):
        self.net, self.rest = hidden, np.asarray(points)
        self.pilots, self.constraints = dict(pilots), dict(constraints or {})
        if not self.pilots:
            raise ParameterError("pilots are the variables: give one at least")
        self.weights = np.broadcast_to(np.asarray(weights, float), hidden.size).copy()
        if not np.all(np.isfinite(self.weights)) or np.any(self.weights <= 0):
            raise ParameterError("weights of the hidden controls must be above zero")
        values, slopes = _evaluated(self.measures, self._bound(), jnp.asarray(hidden.neutral))
        self.wanted, slopes = np.asarray(values), np.asarray(slopes)
        self.scales = _scales(self._labels, slopes, self.weights)
        self.combinations = independent(slopes / self.scales[:, None], self.weights)
        linear = isinstance(hidden, AbstractControlNet) and all(m.is_affine for m in self.measures)
        self.response = _response(slopes / self.scales[:, None], self.weights) if linear else None
        bound = self._bound()
        self.solver = jax.jit(lambda controls: self._solved(bound, controls).x)

    @property
    def measures(self) -> list[AbstractMeasure]:
        """The pilots, and behind them the constraints."""
        return [*self.pilots.values(), *self.constraints.values()]

    @property
    @override
    def size(self) -> int:
        return sum(measure.size for measure in self.pilots.values())

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        ends = np.cumsum([measure.size for measure in self.pilots.values()])
        return dict(zip(self.pilots, np.split(np.arange(self.size), ends[:-1]), strict=True))

    @property
    @override
    def values(self) -> Vector:
        return self.wanted[: self.size]

    @override
    def pose(self, controls: Vector) -> Float[Array, "n"]:
        if self.response is not None:
            return self.response @ (self._change(controls) / self.scales)
        return self.solver(jnp.asarray(controls))

    @override
    def settle(
        self, points: Points, controls: Vector
    ) -> tuple[AbstractDeformer, Float[Array, "m"]]:
        """The hidden deformer, and the controls that meet the conditions on the present shape."""
        places = [points[measure.reads] for measure in self.measures]
        follow = self.net.follow
        measured: list[Measured] = [lambda x, p=p: follow(p, x) for p in places]  # type: ignore
        return self.net, self._solved(measured, controls).x

    def report(self, controls: Vector, points: Points | None = None) -> PilotReport:
        """How well the conditions are met, on the shape at rest or after earlier stages."""
        shape = self.rest if points is None else points
        solution = self._solved(self._bound(shape), jnp.asarray(controls))
        values, _ = _evaluated(self.measures, self._bound(shape), solution.x)
        misses = np.asarray(values - self.wanted - self._change(controls))
        far = np.abs(misses / self.scales) > UNMET * np.ptp(self.rest, axis=0).max()
        names = [*self.pilots, *self.constraints]
        ends = np.cumsum([measure.size for measure in self.measures])[:-1]
        parts, unmet = np.split(misses, ends), np.split(far, ends)
        return PilotReport(
            dict(zip(names, parts, strict=True)),
            tuple(name for name, is_far in zip(names, unmet, strict=True) if np.any(is_far)),
            int(solution.iterations),
            bool(solution.size <= TOLERANCE) or not int(solution.iterations),
        )

    @property
    def _labels(self) -> list[str]:
        named = [*self.pilots.items(), *self.constraints.items()]
        return [name for name, measure in named for _ in range(measure.size)]

    def _bound(self, shape: Points | None = None) -> list[Measured]:
        points = self.rest if shape is None else np.asarray(shape)
        return [self.net.bind(points[measure.reads]) for measure in self.measures]

    def _change(self, controls: Vector) -> Float[Array, "c"]:
        kept = jnp.zeros(len(self.wanted) - self.size)
        return jnp.concatenate([jnp.asarray(controls), kept])

    def _solved(self, measured: list[Measured], controls: Vector) -> Solution:
        """The least controls of the hidden deformer, from its neutral ones."""
        measures, neutral = self.measures, jnp.asarray(self.net.neutral)
        combined = self.combinations / self.scales

        def conditions(change: Vector) -> Float[Array, "r"]:
            places = [points(neutral + change) for points in measured]
            found = [m.of(p) for m, p in zip(measures, places, strict=True)]
            return combined @ (jnp.concatenate(found) - self.wanted)

        def slopes(change: Vector) -> tuple[Float[Array, "r"], Float[Array, "r n"]]:
            values, rows = _evaluated(measures, measured, neutral + change)
            return combined @ (values - self.wanted), combined @ rows

        wanted = combined @ self._change(controls)
        rounding = ROUNDING * float(np.ptp(self.rest, axis=0).max())
        solution = least_norm(conditions, wanted, self.weights, TOLERANCE, rounding, slopes)
        return solution._replace(x=neutral + solution.x)


def _evaluated(
    measures: list[AbstractMeasure], measured: list[Measured], controls: Vector
) -> tuple[Float[Array, "c"], Float[Array, "c n"]]:
    """All numbers, and their slopes by the hidden controls: each by what it reads alone."""
    values, rows = [], []
    for measure, points in zip(measures, measured, strict=True):
        value, pull = jax.vjp(lambda x, m=measure, p=points: m.of(p(x)), controls)
        values.append(value)
        rows.append(jax.vmap(lambda one, pull=pull: pull(one)[0])(jnp.eye(measure.size)))
    return jnp.concatenate(values), jnp.concatenate(rows)


def _scales(labels: list[str], slopes: np.ndarray, weights: np.ndarray) -> np.ndarray:
    scales = np.sqrt(np.sum(slopes**2 / weights, axis=1))
    lost = np.flatnonzero(scales <= 1e-12 * scales.max(initial=0.0))
    if len(lost):
        raise ParameterError(
            f"no control of the hidden deformer reaches {labels[lost[0]]!r}; put it inside, or "
            "leave it out"
        )
    return scales


def _response(slopes: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The pseudo-inverse: least change of the controls, least squares of the misses."""
    root = np.sqrt(weights)
    return np.linalg.pinv(slopes / root, rcond=1e-9) / root[:, None]
