"""A pipeline: named geometries and the stages that deform them, one after the other."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from tqdm import tqdm

from .._types import Array, Points
from ..deformers.base import AbstractBinding
from ..deformers.chain import plain
from ..errors import ParameterError
from ..mesh import Geometry
from ..mesh.cloud import Cloud
from ..parameters.variable import Variable
from .stage import Stage, Step

Values: TypeAlias = Mapping[str, Any]


class Pipeline(eqx.Module):
    """Variable values in, a deformed geometry and its exact derivatives out.

    Attributes
    ----------
    geometries
        What the stages act on, by name. One whose name holds a slash, such as "wing/flow", rides
        on the geometry before the slash: it moves as that one does.
    stages
        In order; each acts on what the ones before it give.
    variables
        All variables of the stages, by name.
    result
        Which geometry the pipeline gives back.
    bindings
        For each geometry the first stage on it and the carried ones, tied to its points, by their
        place among its stages.
    """

    geometries: dict[str, Geometry]
    stages: tuple[Stage, ...]
    variables: dict[str, Variable] = eqx.field(static=True)
    result: str = eqx.field(static=True)
    bindings: dict[str, dict[int, AbstractBinding]]

    def __init__(
        self,
        geometries: Geometry | Mapping[str, Geometry],
        stages: Sequence[Stage],
        result: str | None = None,
    ):
        named = geometries if isinstance(geometries, Mapping) else {"geometry": geometries}
        bases = [name for name in named if "/" not in name]
        self.geometries = dict(named)
        self.stages = tuple(_placed(stages, bases))
        self.variables = _collected(self.stages)
        self.result = result or bases[-1]
        _check_name(self.result, self.geometries)
        self.bindings = {
            name: {
                number: stage.bind(name, geometry.points)
                for number, stage in enumerate(self._on(name))
                if number == 0 or stage.carried
            }
            for name, geometry in self.geometries.items()
        }

    def __call__(self, values: Values | None = None) -> Geometry:
        """The deformed geometry; a variable that `values` does not name keeps its own value."""
        return self.geometry.moved(self.points(values))

    @property
    def geometry(self) -> Geometry:
        """The geometry that the pipeline gives back, at rest."""
        return self.geometries[self.result]

    @property
    def own_stages(self) -> tuple[Stage, ...]:
        """The stages that act on the geometry that the pipeline gives back."""
        return self._on(self.result)

    def points(self, values: Values | None = None) -> Points:
        """The deformed points alone; differentiable by JAX in the values."""
        full = self.values(values)
        base = self.result.split("/")[0]
        needed = dict.fromkeys([base, self.result] if self._settles else [self.result])
        state = {name: self.geometries[name].points for name in needed}
        for number, stage in enumerate(self._on(self.result)):
            controls = stage.controls(full)
            bound = number == 0 or stage.carried
            moving = stage.deformer
            if stage.settles and not bound:
                moving, controls = stage.deformer.settle(state[base], controls)
            for name in needed:
                rest = self.geometries[name].points
                if not bound:
                    moved = moving.follow(state[name], controls)
                else:
                    moved = self.bindings[name][number](controls)
                    if number > 0:
                        moved = state[name] + (moved - rest)
                state[name] = stage.held(rest, moved)
        return state[self.result]

    def steps(self, values: Values | None = None) -> list[Step]:
        """What moves points, stage by stage; pilots behind another stage see the present shape."""
        full = self.values(values)
        present = self.geometries[self.result.split("/")[0]].points
        rest, found = present, []
        for number, stage in enumerate(self._on(self.result)):
            moving, controls = stage.deformer, stage.controls(full)
            if stage.settles and number > 0 and not stage.carried:
                moving, controls = moving.settle(present, controls)
            parts = plain(moving, controls)
            if stage.carried and len(parts) > 1:  # each part would be carried by itself
                parts = [(moving, controls)]
            own = [Step(stage, *part) for part in parts]
            found += own
            if self._settles:
                for step in own:
                    present = step.after(rest, present)
        return found

    def pushforward(self, values: Values | None, directions: Values) -> Points:
        """Derivative of the points along a change of the values, shape (n, 3)."""
        full = self.values(values)
        for name in directions:
            _check_name(name, full)
        change = {name: self._direction(name, directions.get(name)) for name in full}
        return self._push(full, change)

    def pullback(self, values: Values | None, cotangent: Points) -> dict[str, Float[Array, "v"]]:
        """Gradient of a scalar by the values, from its derivative by the points, (n, 3)."""
        array = jnp.asarray(cotangent)
        if array.shape != self.geometry.points.shape:
            raise ParameterError(
                f"the cotangent must have the shape {self.geometry.points.shape}, got {array.shape}"
            )
        return self._pull(self.values(values), array)

    def sensitivity(self, values: Values | None, name: str) -> Float[np.ndarray, "n 3 v"]:
        """Derivative of every point by every number of one variable, exact."""
        _check_name(name, self.variables)
        full = self.values(values)
        size = self.variables[name].size
        _, push = jax.linearize(lambda v: self.points({**full, name: v}), full[name])
        columns = np.empty((len(self.geometry.points), 3, size))
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
        base = on or self.result.split("/")[0]
        _check_name(base, self.geometries)
        rider = Cloud(points) if isinstance(points, jax.Array | np.ndarray) else points
        key = f"{base}/{name}"
        return Pipeline({base: self.geometries[base], key: rider}, self._on(base), key)

    def values(self, values: Values | None = None) -> dict[str, Float[Array, "v"]]:
        """A checked value for every variable, its own where none is given."""
        given = values or {}
        for name in given:
            _check_name(name, self.variables)
        return {
            name: jnp.asarray(variable.checked(jnp.asarray(given.get(name, variable.value), float)))
            for name, variable in self.variables.items()
        }

    @cached_property
    def _push(self) -> Callable[..., Any]:
        return jax.jit(lambda values, change: jax.jvp(self.points, (values,), (change,))[1])

    @cached_property
    def _pull(self) -> Callable[..., Any]:
        return jax.jit(lambda values, cotangent: jax.vjp(self.points, values)[1](cotangent)[0])

    def _on(self, name: str) -> tuple[Stage, ...]:
        return tuple(stage for stage in self.stages if stage.on == name.split("/")[0])

    @property
    def _settles(self) -> bool:
        return any(stage.settles for stage in self._on(self.result))

    def _direction(self, name: str, direction: Any) -> Array:
        variable = self.variables[name]
        given = jnp.zeros(variable.size) if direction is None else jnp.asarray(direction, float)
        return jnp.asarray(variable.checked(given))


def _placed(stages: Sequence[Stage], bases: list[str]) -> Iterable[Stage]:
    """Stages with the name of their geometry filled in."""
    for stage in stages:
        if not stage.on and len(bases) > 1:
            raise ParameterError(
                f"stage {stage.name!r} must say on which geometry it acts: {', '.join(bases)}"
            )
        on = stage.on or bases[0]
        _check_name(on, bases)
        yield Stage(stage.deformer, stage.links, on, stage.name, stage.carried)


def _collected(stages: Iterable[Stage]) -> dict[str, Variable]:
    found: dict[str, Variable] = {}
    for stage in stages:
        for variable in stage.links:
            if found.setdefault(variable.name, variable) != variable:
                raise ParameterError(f"two different variables are named {variable.name!r}")
    return found


def _check_name(name: str, known: Iterable[str]) -> None:
    if name not in known:
        raise ParameterError(f"nothing named {name!r}; there is: {', '.join(known)}")
