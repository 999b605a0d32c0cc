"""A pipeline as it grows: geometries, and the stages that make and deform them."""

from collections.abc import Iterable, Mapping

import jax.numpy as jnp
import numpy as np

from .._types import Array
from ..errors import ParameterError
from ..mesh import Geometry, Surface
from ..parameters.variable import Variable
from .branch import Branch
from .construction import Construction
from .stage import Stage

UNNAMED = ("1",)
"""Components of a surface that nobody named."""


class Assembly:
    """Adds stage after stage; a stage may be built for what the ones before it make.

    Attributes
    ----------
    variables
        All variables of the stages, by name.
    stages
        In order, with the name of what each acts on filled in.
    """

    def __init__(self, geometries: Mapping[str, Geometry]):
        self.stages: list[Stage | Construction] = []
        self.variables: dict[str, Variable] = {}
        self._given = dict(geometries)
        self._sources: dict[str, Branch] = {
            name: Branch(name, geometry, ()) for name, geometry in geometries.items()
        }
        self._on: dict[str, list[Stage]] = {name: [] for name in geometries}
        self._done: dict[str, Branch] = {}
        self._taken: dict[str, str] = {}

    @property
    def names(self) -> list[str]:
        """Names of the geometries that stages may act on."""
        return [name for name in self._sources if "/" not in name]

    def geometry(self, name: str) -> Geometry:
        """A geometry before the stages on it, at the variables' own values."""
        return self._sources[name].geometry

    def add(self, stage: Stage | Construction) -> None:
        """One more stage."""
        for variable in stage.links:
            if self.variables.setdefault(variable.name, variable) != variable:
                raise ParameterError(f"two different variables are named {variable.name!r}")
        if isinstance(stage, Construction):
            self._construct(stage)
        else:
            self._deform(stage)

    def branches(self) -> dict[str, Branch]:
        """Every geometry with its stages, those that others are made from first."""
        return {name: self._branch(name) for name in self._sources}

    def _deform(self, stage: Stage) -> None:
        if not stage.on and len(self.names) != 1:
            raise ParameterError(
                f"stage {stage.name!r} must say on which geometry it acts: {', '.join(self.names)}"
            )
        on = stage.on or self.names[0]
        check_name(on, self.names)
        if on in self._taken:
            raise ParameterError(
                f"stage {stage.name!r} deforms {on!r} after stage {self._taken[on]!r} has taken "
                "it: put it before that one"
            )
        placed = Stage(stage.deformer, stage.links, on, stage.name, stage.carried)
        self._on[on].append(placed)
        self.stages.append(placed)

    def _construct(self, stage: Construction) -> None:
        if "/" in stage.to or stage.to in self._sources:
            raise ParameterError(
                f"stage {stage.name!r}: to = {stage.to!r} is another geometry's name, "
                "or has a slash"
            )
        for name in stage.of:
            check_name(name, self.names)
        full = {name: jnp.asarray(v.value, float) for name, v in self.variables.items()}
        stage.check(full)
        made = [self._branch(name) for name in stage.of]
        points = _states(self._done, full, stage.of)
        making = stage.bind([taken(branch, points[branch.name]) for branch in made])
        start = np.asarray(making(stage.controls(full), *(points[name] for name in stage.of)))
        self._sources[stage.to] = Branch(stage.to, making.geometry.moved(start), (), stage, making)
        self._on[stage.to] = []
        self._taken |= dict.fromkeys(stage.of, stage.name)
        self.stages.append(stage)

    def _branch(self, name: str) -> Branch:
        """A geometry with its stages, complete."""
        if name not in self._done:
            base = name.split("/")[0]
            check_name(base, self.names)
            source = self._sources[name]
            leader = None if base == name else self._branch(base)
            if leader is not None:
                check_rides(name, leader)
            branch = self._done[name] = Branch(
                name, source.geometry, self._on[base], source.construction, source.making, leader
            )
            if branch.stages and not branch.is_fixed:  # what it refuses, it refuses here
                branch.stages[0].bind(name, source.geometry.points)
            for other in source.of:
                self._branch(other)
        return self._done[name]


def check_rides(name: str, leader: Branch) -> None:
    """Refuse points that would have to follow a modeler."""
    if not leader.is_fixed:
        raise ParameterError(
            f"{name!r} cannot ride on {leader.name!r}: variables move what a modeler makes it of, "
            "and only what deformers do is known beside the surface"
        )


def feeding(branches: Mapping[str, Branch], name: str) -> list[str]:
    """Names of what a geometry is made from, then its own."""
    found: dict[str, None] = {}
    for other in branches[name].of:
        found |= dict.fromkeys(feeding(branches, other))
    return [*found, name]


def _states(branches: Mapping[str, Branch], full: dict, names: Iterable[str]) -> dict[str, Array]:
    """Points of geometries behind their stages."""
    states: dict[str, Array] = {}
    for name in names:
        for part in feeding(branches, name):
            if part not in states:
                branch = branches[part]
                states[part] = branch.points(full, [states[other] for other in branch.of])
    return states


def taken(branch: Branch, points: Array) -> Geometry:
    """A geometry as another is made from it; a component without a name goes by the geometry's."""
    geometry = branch.geometry.moved(np.asarray(points))
    if isinstance(geometry, Surface) and geometry.components == UNNAMED:
        data = geometry.point_data, geometry.face_data
        return Surface(geometry.points, geometry.faces, geometry.tags, (branch.name,), *data)
    return geometry


def check_name(name: str, known: Iterable[str]) -> None:
    """Refuse a name that is not there."""
    if name not in known:
        raise ParameterError(f"nothing named {name!r}; there is: {', '.join(known)}")
