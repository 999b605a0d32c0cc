"""What a pipeline is made of: geometries, stages and the variables that turn them."""

from dataclasses import asdict, dataclass, field, replace

import numpy as np

from ..deformers.base import AbstractDeformer
from ..deformers.control_volume import ControlVolume
from ..deformers.lattice import Lattice
from ..deformers.net import AbstractControlNet
from ..deformers.pilots import Pilots
from ..mesh import Geometry
from ..modelers.base import AbstractModeler
from ..parameters.variable import Variable
from .branch import Branch
from .construction import Construction
from .pipeline import Pipeline
from .stage import Stage


@dataclass(frozen=True)
class Entry:
    """A stage, or where a geometry comes from.

    Attributes
    ----------
    name
        What reports call it.
    kind
        The class of the deformer or modeler; of what is given, of the geometry.
    detail
        How large it is.
    variables
        Those that turn it, with how many numbers each has: t, or t[4].
    """

    name: str
    kind: str
    detail: str = ""
    variables: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """A geometry with its steps, the first of which is where it comes from.

    Attributes
    ----------
    geometry
        Its name.
    of
        Names of the geometries that it is made from, or of the one that it rides on.
    steps
        In order.
    size
        How many points and faces it has.
    """

    geometry: str
    of: tuple[str, ...]
    steps: tuple[Entry, ...]
    size: str
    components: tuple[str, ...] = ()


@dataclass(frozen=True)
class Overview:
    """Rows, what the pipeline gives back, and the variables."""

    rows: tuple[Row, ...]
    result: str
    variables: dict[str, str] = field(default_factory=dict)

    def sentences(self) -> list[str]:
        """A table in text."""
        cells = []
        for row in self.rows:
            for number, step in enumerate(row.steps):
                arrow = "" if number == 0 else "-> "
                name = row.geometry if number == 0 else ""
                kind = ", ".join(filter(None, [step.kind, step.detail]))
                cells.append((name, f"{arrow}{step.name}", kind, " ".join(step.variables)))
            ends = " (result)" if row.geometry == self.result else ""
            cells.append(("", f"=  {row.size}{ends}", "", ""))
        cells += [
            ("variables" if i == 0 else "", name, told, "")
            for i, (name, told) in enumerate(self.variables.items())
        ]
        width = [max(len(line[i]) for line in cells) for i in range(4)]
        return [
            "  ".join(f"{cell:{w}}" for cell, w in zip(line, width, strict=True)).rstrip()
            for line in cells
        ]

    def as_dict(self) -> dict:
        """For a script."""
        return {
            "result": self.result,
            "geometries": {
                row.geometry: {
                    "of": list(row.of),
                    "size": row.size,
                    "components": list(row.components),
                    "steps": [asdict(step) for step in row.steps],
                }
                for row in self.rows
            },
            "variables": self.variables,
        }


def overview(pipeline: Pipeline) -> Overview:
    """The geometries of a pipeline in order, with their stages, and its variables."""
    rows = [_row(branch) for branch in pipeline.branches.values()]
    known = pipeline.variables.values()
    return Overview(
        tuple(rows),
        pipeline.result,
        {variable.name: _range(variable) for variable in known},
    )


def _row(branch: Branch) -> Row:
    geometry, made = branch.geometry, branch.construction
    of: tuple[str, ...] = ()
    if branch.leader is not None:
        start, of = Entry("rides", type(geometry).__name__), (branch.leader.name,)
    elif made is None:
        start = Entry("given", type(geometry).__name__)
    else:
        start, of = _step(made, made.modeler, _parameters(made.modeler)), made.of
        if of:
            start = replace(start, name=f"{made.name} of {', '.join(of)}")
    stages = [_step(stage, stage.deformer, _controls(stage.deformer)) for stage in branch.stages]
    return Row(
        branch.name, of, (start, *stages), _size(geometry), getattr(geometry, "components", ())
    )


def _step(
    stage: Stage | Construction, acts: AbstractDeformer | AbstractModeler, size: str
) -> Entry:
    turns = tuple(v.name if v.size == 1 else f"{v.name}[{v.size}]" for v in stage.links)
    return Entry(stage.name, type(acts).__name__, size, turns)


def _parameters(modeler: AbstractModeler) -> str:
    return f"{modeler.size} parameters" if modeler.size else ""


def _controls(deformer: AbstractDeformer) -> str:
    if isinstance(deformer, Lattice):
        return " x ".join(map(str, deformer.shape)) + " control points"
    if isinstance(deformer, Pilots):
        return f"{deformer.size} prescribed numbers"
    if isinstance(deformer, ControlVolume):
        boxes = len(deformer.frame.boxes)
        return f"{boxes} box{'es' if boxes > 1 else ''}, {deformer.size // 3} control points"
    if isinstance(deformer, AbstractControlNet):
        return f"{deformer.size // 3} control points"
    return f"{deformer.size} controls"


def _size(geometry: Geometry) -> str:
    points = f"{len(geometry.points):,} points"
    faces = getattr(geometry, "faces", None)
    return points if faces is None else f"{points}, {len(faces):,} faces"


def _range(variable: Variable) -> str:
    numbers = f"{variable.size} number{'s' if variable.size > 1 else ''}"
    unit = f" [{variable.unit}]" if variable.unit else ""
    low, high = min(variable.lower), max(variable.upper)
    bounds = "" if np.isinf([low, high]).all() else f", {low:g} to {high:g}"
    return numbers + bounds + unit
