"""Pilots: what a shape measures is prescribed, and a hidden deformer obeys."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..measures.base import AbstractMeasure, Constraint
from ..measures.position import Position
from ..measures.spot import Spot
from ..mesh import Geometry
from ..numerics.least_norm import Solution, least_norm
from .base import AbstractDeformer
from .chain import Chain
from .conditions import Conditions, conditions
from .hidden import automatic
from .net import AbstractControlNet
from .posed import AbstractPosed
from .readings import FEW, Readings
from .second_order import Probe, probe, smallest_curvature

TOLERANCE = 1e-12
"""Of the last step, relative to the motion."""

SETTLED = 1e-9
"""A last step up to this is one."""

UNMET = 1e-9
"""A condition is unmet where its miss takes a motion of more than this part of the shape's size."""

SHOWN = 12
"""Points that a measure may read to be shown by its places."""

AT_LIMIT = 1e-9
"""A bound that holds with less force than this part of the largest is about to let go."""

Pilot = AbstractMeasure | Spot | Constraint
"""A spot is prescribed in all three directions; a constraint is refused."""

Kept = AbstractMeasure | Constraint
"""A measure stays as it is at rest, a constraint within its bounds."""


class PilotReport(NamedTuple):
    """How well the hidden deformer obeys.

    Attributes
    ----------
    status
        "met"; "least squares" where conditions contradict each other and some are unmet;
        "not converged"; "not smooth" where a small change of the pilots may take the shape
        elsewhere, so that derivatives hold on one side only, or not at all.
    misses
        What each measure is off by, by its name, in its own unit; of bounds how far beyond.
    unmet
        Names of those that are off by more than rounding.
    active
        Names of those that a bound holds.
    dependent
        Names of conditions that others imply, or contradict.
    iterations
        Steps that the solver took; none at rest, one where all is linear.
    curvature
        How much the cost grows at least, per cost of a motion that keeps all conditions: 1 where
        they are linear, 0 or less where the shape is not the one of least cost nearby.
    strain
        Largest motion of a hidden control point, per largest motion of a point that is read: much
        above 1 where pilots are nearer to each other than the control points are; 0 of others.
    """

    status: str
    misses: dict[str, np.ndarray]
    unmet: tuple[str, ...]
    active: tuple[str, ...]
    dependent: tuple[str, ...]
    iterations: int
    curvature: float
    strain: float


class Pilots(AbstractPosed):
    """Prescribe what a shape measures; a hidden deformer moves least to obey.

    Of all controls of the hidden deformer that give the pilots what is asked of them, leave
    measures among the constraints as they are at rest, and hold the others within their bounds,
    those are taken whose weighted sum of squares is least. Conditions that contradict each other
    are met in the least squares, and the report says which are not. Controls are changes of the
    pilots from what they measure at rest.

    Attributes
    ----------
    net
        The hidden deformer, which moves the shape and any other points.
    pilots
        Measures by name.
    constraints
        What is kept, by name: a measure as it is at rest, a constraint within its bounds.
    rest
        Points of the shape at rest.
    measured
        What pilots and constraints measure there.
    response
        Hidden controls for each number of the pilots, where all is linear.
    is_linear
        Whether the conditions are equations that hold at rest and change in proportion to the
        hidden controls.
    step
        The part of its miss that each of the solver's steps makes good, K in the source.

    Notes
    -----
    Where bounds do not hold at rest the shape moves at once to the nearest one that keeps them, so
    neutral controls do not leave it where it is. Where one begins to hold the motion has a kink.
    Source: AIAA 2012-0965, equations 1 to 7; docs/theory/pilots.md derives it.
    """

    net: AbstractDeformer
    pilots: dict[str, AbstractMeasure]
    constraints: dict[str, Constraint | AbstractMeasure]
    rest: Points
    measured: Float[np.ndarray, "c"]
    response: Float[np.ndarray, "n k"] | None
    is_linear: bool = eqx.field(static=True)
    step: float = eqx.field(static=True)
    conditions: Conditions = eqx.field(static=True)
    readings: Readings = eqx.field(static=True)
    solver: Callable[[Vector], Solution] = eqx.field(static=True)
    settler: Callable[[Points, Vector], Solution] = eqx.field(static=True)
    probed: Probe = eqx.field(static=True)

    def __init__(
        self,
        geometry: Geometry,
        points: Mapping[str, Pilot] | Sequence[Pilot],
        constraints: Mapping[str, Kept] | Sequence[Kept] = (),
        hidden: AbstractDeformer | Sequence[AbstractDeformer] | None = None,
        *,
        weights: Any = 1.0,
        step: float = 1.0,
        margin: float = 0.1,
    ):
        self.rest = np.asarray(geometry.points)
        self.pilots = {name: _measure(one) for name, one in _named(points, "pilot").items()}
        self.constraints = _named(constraints, "constraint")
        twice = self.pilots.keys() & self.constraints.keys()
        if not self.pilots or twice:
            raise ParameterError(
                f"a pilot and a constraint are both named {min(twice)!r}"
                if twice
                else "pilots are the variables: give one at least"
            )
        if not 0 < step <= 1:
            raise ParameterError(f"a step makes good a part of each miss, up to 1, got {step}")
        self.step = step
        self.net = automatic(self.rest, self.measures, margin) if hidden is None else _one(hidden)
        costs = np.broadcast_to(np.asarray(weights, float), self.net.size).copy()
        if not np.all(np.isfinite(costs)) or np.any(costs <= 0):
            raise ParameterError("weights of the hidden controls must be above zero")
        costs /= np.median(costs)  # only their ratios matter, and misses are told in such motions
        self.readings = Readings(self.net, self.measures, self._bound)
        bounded = [c if isinstance(c, Constraint) else None for c in self.constraints.values()]
        named = [*((n, None) for n in self.pilots), *zip(self.constraints, bounded, strict=True)]
        extent = float(np.ptp(self.rest, axis=0).max())
        self.measured, slopes = self.readings.at_rest()
        counts = [measure.size for measure in self.measures]
        self.conditions = conditions(named, counts, self.measured, slopes, costs, extent)
        wanted = self.conditions.wanted
        is_kept = np.array_equal(wanted, self.measured[self.conditions.equations])
        are_equations = is_kept and not len(self.conditions.bounds)
        self.is_linear = all(self.readings.is_affine) and are_equations
        self.response = self.conditions.response(slopes)[:, : self.size] if self.is_linear else None
        self.probed = probe(lambda change: self.conditions.problem(self.readings, change))
        self.solver = jax.jit(lambda x: self._solved(self.readings, self.readings, x))
        self.settler = jax.jit(lambda points, x: self._settled(points, x))

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        pilot: Mapping[str, AbstractMeasure | Constraint],
        constraint: Mapping[str, AbstractMeasure | Constraint] | None = None,
        hidden: AbstractDeformer | Sequence[AbstractDeformer] | None = None,
        weights: float | list[float] = 1.0,
        step: float = 1.0,
        margin: float = 0.1,
    ) -> "Pilots":
        """From a case file: measures by name, and the hidden deformer or several."""
        options: dict[str, Any] = {"weights": weights, "step": step, "margin": margin}
        return cls(geometry, pilot, constraint or {}, hidden, **options)

    @property
    def measures(self) -> list[AbstractMeasure]:
        """The pilots, and behind them the constraints."""
        kept = self.constraints.values()
        behind = [one.measure if isinstance(one, Constraint) else one for one in kept]
        return [*self.pilots.values(), *behind]

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
        return self.measured[: self.size]

    @override
    def pose(self, controls: Vector) -> Float[Array, "n"]:
        return self._solution(self._asked(controls)).x

    @override
    def settle(
        self, points: Points, controls: Vector
    ) -> tuple[AbstractDeformer, Float[Array, "m"]]:
        """The hidden deformer, and the controls that meet the conditions on the present shape."""
        return self.net, self.settler(jnp.asarray(points), self._asked(controls)).x

    def marks(self, points: Points) -> Array:
        """Where the places are that the pilots hold, for pictures."""
        few = [m for m in self.pilots.values() if len(m.reads) <= SHOWN]
        marked = [m.marks(jnp.asarray(points)[m.reads]) for m in few]
        return jnp.concatenate([jnp.zeros((0, 3)), *marked])

    def report(self, controls: Vector, points: Points | None = None) -> PilotReport:
        """How well the conditions are met, on the shape at rest or after earlier stages."""
        asked, change = self.conditions, self._asked(controls)
        if points is None:
            readings, probed, solution = self.readings, self.probed, self._solution(change)
        else:
            readings = Readings(self.net, self.measures, lambda r: self.net.bind(points[r]))
            probed = probe(lambda change: asked.problem(readings, change))
            solution = self.settler(jnp.asarray(points), change)
        motion = solution.x - jnp.asarray(self.net.neutral)
        scaled = np.zeros(len(asked.labels))
        scaled[asked.equations], over = asked.slack(readings.values(motion), change)
        np.maximum.at(scaled, asked.bounds, np.asarray(over))
        is_active = np.asarray(solution.active)[asked.is_bound]
        curvature = 1.0
        if not self.is_linear:
            curvature = smallest_curvature(probed, asked.weights, change, motion, solution)
        names = [*self.pilots, *self.constraints]
        ends = np.cumsum([measure.size for measure in self.measures])[:-1]
        misses = dict(zip(names, np.split(scaled * asked.scales, ends), strict=True))
        far = zip(names, np.split(~(np.abs(scaled) <= UNMET * asked.size), ends), strict=True)
        unmet = tuple(name for name, is_far in far if np.any(is_far))
        return PilotReport(
            self._status(solution, bool(unmet), curvature),
            misses,
            unmet,
            tuple(dict.fromkeys(asked.labels[n] for n in asked.bounds[is_active])),
            asked.dependent,
            int(solution.iterations),
            curvature,
            self._strain(solution.x, self.rest if points is None else points),
        )

    def _strain(self, controls: Array, shape: Points) -> float:
        few = [measure.reads for measure in self.measures if len(measure.reads) <= FEW]
        reads = np.unique(np.concatenate([*few, []]).astype(int))
        if not isinstance(self.net, AbstractControlNet) or not len(reads):
            return 0.0
        rest = np.asarray(shape)[reads]
        motion = np.linalg.norm(np.asarray(self.net.follow(rest, controls)) - rest, axis=1).max()
        moves = np.asarray(self.net.moves(controls)).reshape(-1, 3)
        largest = np.linalg.norm(moves, axis=1).max()
        return float(largest / motion) if motion > 0 else 0.0

    def _asked(self, controls: Array) -> Array:
        change = jnp.asarray(controls)
        if change.shape != (self.size,):
            raise ParameterError(f"pilots measure {self.size} numbers, got shape {change.shape}")
        return change

    def _status(self, solution: Solution, misses_some: bool, curvature: float) -> str:
        if not float(solution.size) <= SETTLED or not np.all(np.isfinite(solution.x)):
            return "not converged"
        if misses_some:
            return "least squares"
        forces = np.asarray(solution.multipliers)
        held = self.conditions.is_bound & np.asarray(solution.active)
        lets_go = held & (forces <= AT_LIMIT * np.abs(forces).max(initial=0.0))
        return "met" if curvature > 0 and not np.any(lets_go) else "not smooth"

    def _bound(self, reads: np.ndarray) -> Callable[[Vector], Points]:
        return self.net.bind(self.rest[reads])

    def _solution(self, change: Float[Array, "p"]) -> Solution:
        """On the shape at rest; one product where all is linear."""
        if self.response is None:
            return self.solver(change)
        equations = np.zeros(len(self.conditions.is_bound))
        steps = jnp.any(change != 0).astype(int)
        x = jnp.asarray(self.net.neutral) + self.response @ change
        return Solution(x, equations, equations == 0, steps, jnp.zeros(()))

    def _settled(self, points: Points, change: Float[Array, "p"]) -> Solution:
        """On the present shape."""

        def read(places: Points) -> Readings:
            def moved(reads: np.ndarray) -> Callable[[Vector], Points]:
                return lambda x: self.net.follow(places[reads], x)

            return Readings(self.net, self.measures, moved)

        return self._solved(read(points), read(jax.lax.stop_gradient(points)), change)

    def _solved(self, readings: Readings, still: Readings, change: Float[Array, "p"]) -> Solution:
        """The least controls of the hidden deformer, from its neutral ones."""
        problem = self.conditions.problem(readings, change)
        held = self.conditions.problem(still, jax.lax.stop_gradient(change))
        solution = least_norm(problem, held, TOLERANCE, self.step)
        return solution._replace(x=jnp.asarray(self.net.neutral) + solution.x)


def _named(given: Any, kind: str) -> dict[str, Any]:
    """By name; those in a list are numbered."""
    if isinstance(given, Mapping):
        return dict(given)
    return {f"{kind}{number}": one for number, one in enumerate(given)}


def _measure(pilot: Pilot) -> AbstractMeasure:
    if isinstance(pilot, Constraint):
        raise ParameterError("a pilot is prescribed, so it has no bounds; constraints have them")
    return Position(pilot) if isinstance(pilot, Spot) else pilot


def _one(hidden: AbstractDeformer | Sequence[AbstractDeformer]) -> AbstractDeformer:
    return hidden if isinstance(hidden, AbstractDeformer) else Chain(hidden)
