"""A pipeline: named geometries and the stages that make and deform them, one after the other."""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from tqdm import tqdm

from .._types import Array, Points, is_concrete
from ..errors import ParameterError
from ..mesh import Geometry
from ..mesh.cloud import Cloud
from ..parameters.variable import Variable
from .assembly import Assembly, check_name, check_rides, feeding, taken
from .branch import Branch
from .construction import Construction
from .stage import Stage, Step

Values: TypeAlias = Mapping[str, Any]

States: TypeAlias = dict[str, Array]
"""Points of geometries behind their stages, by name."""

SEVERAL = 32
"""Directions that are asked for at a time: as many motions must be held."""

log = logging.getLogger("moldline.pipeline")


class Pipeline(eqx.Module):
    """Variable values in, a geometry and its exact derivatives out.

    What is made from other geometries, such as the union of a wing and a body, keeps its
    connectivity while that is right. Where it is not, values that can be looked at get it made
    anew (`at` gives the pipeline with it; the log says so); under `jax.jit` and `jax.grad` it is
    an error.

    Attributes
    ----------
    branches
        Every geometry by name with the stages on it. One whose name holds a slash, such as
        "wing/flow", rides on the geometry before the slash: it moves as that one does.
    stages
        In order; each acts on what the ones before it give.
    variables
        All variables of the stages, by name.
    result
        Which geometry the pipeline gives back.
    """

    branches: dict[str, Branch]
    stages: tuple[Stage | Construction, ...]
    variables: dict[str, Variable] = eqx.field(static=True)
    result: str = eqx.field(static=True)

    def __init__(
        self,
        geometries: Geometry | Mapping[str, Geometry] | Assembly,
        stages: Sequence[Stage | Construction],
        result: str | None = None,
    ):
        """Geometries by name, or the one that there is, or an assembly of them and some stages.

        The result is what the last stage makes, else the last of the geometries, unless named.
        """
        assembly = _assembly(geometries)
        for stage in stages:
            assembly.add(stage)
        if not assembly.names:
            raise ParameterError("a pipeline needs a geometry, or a stage that makes one")
        self.branches = assembly.branches()
        self.stages = tuple(assembly.stages)
        self.variables = dict(assembly.variables)
        self.result = result or assembly.names[-1]
        check_name(self.result, self.branches)

    def __call__(self, values: Values | None = None) -> Geometry:
        """The geometry; a variable that `values` does not name keeps its own value."""
        full = self.values(values)
        here, parts = self._at(full)
        return here.geometry.moved(here._own(full, parts))

    @property
    def geometries(self) -> dict[str, Geometry]:
        """Every geometry before the stages on it, at the variables' own values."""
        return {name: branch.geometry for name, branch in self.branches.items()}

    @property
    def geometry(self) -> Geometry:
        """The same of the geometry that the pipeline gives back."""
        return self.branches[self.result].geometry

    @property
    def own_stages(self) -> tuple[Stage, ...]:
        """The stages that act on the geometry that the pipeline gives back."""
        return self.branches[self.result].stages

    @property
    def feeding(self) -> list[str]:
        """Names of the geometries that the result is made from, in order, and its own."""
        return feeding(self.branches, self.result)

    def of(self, name: str) -> "Pipeline":
        """The pipeline that gives back another of its geometries."""
        check_name(name, self.branches)
        return self._with(self.branches, name)

    def at(self, values: Values | None = None) -> "Pipeline":
        """Itself, or where connectivity is not right for the values, with that made anew."""
        return self._at(self.values(values))[0]

    def holds(self, values: Values | None = None) -> bool:
        """Whether the connectivity is right for the values."""
        return self._parts(self.values(values)) is not None

    def points(self, values: Values | None = None) -> Points:
        """The points alone; differentiable by JAX in the values."""
        full = self.values(values)
        here, parts = self._at(full)
        return here._own(full, parts)

    def source(self, values: Values | None = None) -> Points:
        """Points of the result's geometry before the stages on it."""
        full = self.values(values)
        here, parts = self._at(full)
        own = here.branches[here.leading]
        return own.source(full, [parts[name] for name in own.of])

    def steps(self, values: Values | None = None) -> list[Step]:
        """What moves the result's points, stage by stage."""
        return self.branches[self.result].steps(self.values(values), self.source(values))

    @property
    def leading(self) -> str:
        """The geometry that the result is, or rides on."""
        return self.result.split("/")[0]

    def pushforward(self, values: Values | None, directions: Values) -> Points:
        """Derivative of the points along a change of the values, shape (n, 3)."""
        full = self.values(values)
        for name in directions:
            check_name(name, full)
        change = {name: self._direction(name, directions.get(name)) for name in full}
        here, _ = self._at(full)
        states: States = {}
        moves: States = {}
        for branch in here._feeders():
            made, motions = ([known[name] for name in branch.of] for known in (states, moves))
            states[branch.name], moves[branch.name] = branch.push(full, change, made, motions)
        return moves[self.result]

    def pullback(self, values: Values | None, cotangent: Points) -> dict[str, Float[Array, "v"]]:
        """Gradient of a scalar by the values, from its derivative by the points, (n, 3)."""
        full = self.values(values)
        here, states = self._at(full)
        array = jnp.asarray(cotangent)
        if array.shape != here.geometry.points.shape:
            raise ParameterError(
                f"the cotangent must have the shape {here.geometry.points.shape}, got {array.shape}"
            )
        gradient: dict[str, Array] = {name: jnp.zeros_like(value) for name, value in full.items()}
        waiting: States = {self.result: array}
        for branch in reversed(list(here._feeders())):
            if branch.name not in waiting:  # a program behind it has asked for its directions
                continue
            made = [states[name] for name in branch.of]
            own = waiting.pop(branch.name)
            if branch.is_foreign:
                by_values, own = branch.pull_stages(full, made, own)
                by_values = here._by_directions(branch, full, states, own, by_values)
                gradient = {name: gradient[name] + by_values[name] for name in full}
                continue
            by_values, by_made = branch.pull(full, made, own)
            gradient = {name: gradient[name] + by_values[name] for name in full}
            for name, part in zip(branch.of, by_made, strict=True):
                waiting[name] = waiting[name] + part if name in waiting else part
        return gradient

    def sensitivity(self, values: Values | None, name: str) -> Float[np.ndarray, "n 3 v"]:
        """Derivative of every point by every number of one variable, exact."""
        check_name(name, self.variables)
        full = self.values(values)
        size = self.variables[name].size
        here, states = self._at(full)
        if any(branch.is_foreign for branch in here._feeders()):
            found: list[Array] = []
            for part in _units(full, [name]):
                changes = [change for *_, change in part]
                found += here._motions(full, states, changes, here.result)
            return np.stack([np.asarray(motion) for motion in found], axis=-1)
        push = here._linear(full, name)
        columns = np.empty((*here.geometry.points.shape, size))
        for i in tqdm(range(size), desc=f"sensitivity to {name}", delay=2, leave=False):
            columns[..., i] = push(jnp.zeros(size).at[i].set(1.0))
        return columns

    def labelled_sensitivity(self, values: Values | None, name: str) -> dict[str, Points]:
        """The same, one array (n, 3) per number, by its label: t, or t[0] t[1] ..."""
        columns = self.sensitivity(values, name)
        labels = self.variables[name].labels()
        return {label: columns[..., i] for i, label in enumerate(labels)}

    def embed(self, points: Geometry | Points, on: str = "", name: str = "embedded") -> "Pipeline":
        """The same deformation bound to other points: a flow mesh, a structural model.

        What comes back shares the variables; called, it gives the other geometry deformed.
        """
        base = on or self.leading
        check_name(base, self.branches)
        leader = self.branches[base]
        key = f"{base}/{name}"
        check_rides(key, leader)
        rider = Cloud(points) if isinstance(points, jax.Array | np.ndarray) else points
        branch = Branch(key, rider, leader.stages, leader=leader)
        return self._with({**self.branches, key: branch}, key)

    def values(self, values: Values | None = None) -> dict[str, Float[Array, "v"]]:
        """A checked value for every variable, its own where none is given."""
        given = values or {}
        for name in given:
            check_name(name, self.variables)
        return {
            name: jnp.asarray(variable.checked(jnp.asarray(given.get(name, variable.value), float)))
            for name, variable in self.variables.items()
        }

    def _feeders(self) -> Iterator[Branch]:
        return (self.branches[name] for name in self.feeding)

    def _at(self, full: dict[str, Array]) -> tuple["Pipeline", States]:
        """The pipeline whose connectivity is right, and points of what the result is made from."""
        recent = self._recent
        for known in (self, *recent[-1:]):
            parts = known._parts(full)
            if parts is not None:
                return known, parts
        branches, parts = dict(self.branches), {}
        for branch in self._feeders():
            made = [parts[name] for name in branch.of]
            is_other = any(branches[name] is not self.branches[name] for name in branch.of)
            if branch.making is not None and (is_other or not branch.making.holds(*made)):
                assert branch.construction is not None
                inputs = [taken(branches[name], parts[name]) for name in branch.of]
                branch = branch.remade(branch.construction.bind(inputs))
                branches[branch.name] = branch
                log.info("%r is made anew: parts cross in other places", branch.name)
            if branch.name != self.result:
                parts[branch.name] = branch.points(full, made)
        recent[:] = [self._with(branches, self.result)]
        return recent[0], parts

    def _parts(self, full: dict[str, Array]) -> States | None:
        """Points of what the result is made from.

        None where values can be looked at and connectivity is not right.
        """
        parts: States = {}
        for branch in self._feeders():
            made = [parts[name] for name in branch.of]
            is_known = bool(made) and is_concrete(*made)
            if is_known and branch.making is not None and not branch.making.holds(*made):
                return None
            if branch.name != self.result:
                parts[branch.name] = branch.points(full, made)
        return parts

    def _own(self, full: dict[str, Array], parts: States) -> Array:
        """Points of the result, from those of what it is made from."""
        branch = self.branches[self.result]
        return branch.points(full, [parts[name] for name in branch.of])

    def _linear(self, full: dict[str, Array], name: str) -> Callable[[Array], Array]:
        """The derivative by one variable, ready for many directions."""
        states: States = {}
        pushes: dict[str, Callable[..., Array]] = {}
        for branch in self._feeders():
            states[branch.name], pushes[branch.name] = jax.linearize(
                lambda v, *made, own=branch: own.points({**full, name: v}, made),
                full[name],
                *(states[other] for other in branch.of),
            )

        def push(direction: Array) -> Array:
            moves: States = {}
            for branch in self._feeders():
                moves[branch.name] = pushes[branch.name](
                    direction, *(moves[other] for other in branch.of)
                )
            return moves[self.result]

        return push

    def _motions(
        self, full: dict[str, Array], states: States, changes: Sequence[dict[str, Array]], name: str
    ) -> list[Array]:
        """Motions of a geometry's points for several changes of the values."""
        moves: dict[str, list[Array]] = {}
        for other in feeding(self.branches, name):
            branch = self.branches[other]
            own = [[moves[part][k] for part in branch.of] for k in range(len(changes))]
            made = [states[part] for part in branch.of]
            moves[other] = branch.motions(full, changes, made, own)
        return moves[name]

    def _by_directions(
        self,
        branch: Branch,
        full: dict[str, Array],
        states: States,
        cotangent: Array,
        gradient: dict[str, Array],
    ) -> dict[str, Array]:
        """Add what a program's source gives, by the directions of all variables before it."""
        assert branch.construction is not None
        turned = {variable.name for variable in branch.construction.links}
        for other in feeding(self.branches, branch.name)[:-1]:
            turned |= self.branches[other].turned_by
        made = [states[name] for name in branch.of]
        for part in _units(full, [name for name in full if name in turned]):
            changes = [change for *_, change in part]
            before = [self._motions(full, states, changes, name) for name in branch.of]
            moves = [list(own) for own in zip(*before, strict=True)] or [[] for _ in part]
            found = branch.source_motions(full, changes, made, moves)
            for (name, i, _), motion in zip(part, found, strict=True):
                gradient[name] = jnp.asarray(gradient[name]).at[i].add(jnp.sum(motion * cotangent))
        return gradient

    @cached_property
    def _recent(self) -> list["Pipeline"]:
        """The pipeline that was made anew last, for the values near those it was made for."""
        return []

    def _with(self, branches: Mapping[str, Branch], result: str) -> "Pipeline":
        """The same stages with other branches; what those have compiled they keep."""
        other = object.__new__(Pipeline)
        for name, value in (
            ("branches", dict(branches)),
            ("stages", self.stages),
            ("variables", self.variables),
            ("result", result),
        ):
            object.__setattr__(other, name, value)
        return other

    def _direction(self, name: str, direction: Any) -> Array:
        variable = self.variables[name]
        given = jnp.zeros(variable.size) if direction is None else jnp.asarray(direction, float)
        return jnp.asarray(variable.checked(given))


def _assembly(geometries: Geometry | Mapping[str, Geometry] | Assembly) -> Assembly:
    if isinstance(geometries, Assembly):
        return geometries
    named = geometries if isinstance(geometries, Mapping) else {"geometry": geometries}
    return Assembly(named)


def _units(
    full: Mapping[str, Array], names: Sequence[str]
) -> Iterator[list[tuple[str, int, dict[str, Array]]]]:
    """Changes of one number each, with its variable and place in it, some at a time."""
    places = [(name, i) for name in names for i in range(len(full[name]))]
    for start in range(0, len(places), SEVERAL):
        yield [(name, i, _unit(full, name, i)) for name, i in places[start : start + SEVERAL]]


def _unit(full: Mapping[str, Array], name: str, i: int) -> dict[str, Array]:
    zeros = {other: jnp.zeros_like(value) for other, value in full.items()}
    return {**zeros, name: zeros[name].at[i].set(1.0)}
