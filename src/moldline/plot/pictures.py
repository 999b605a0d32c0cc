"""Whole pictures of geometries and pipelines."""

import re
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from .._types import Points
from ..deformers.net import AbstractControlNet
from ..deformers.pilots import Pilots
from ..errors import ParameterError
from ..mesh import Cloud, Geometry, Section, Surface, VolumeMesh
from ..mesh.joined import joined_points
from ..modelers.wetting import Wetting
from ..pipeline.pipeline import Pipeline, Values
from ..pipeline.stage import Step
from .figure import blank
from .nets import Net, draw_net
from .sections import draw_section, section_picture
from .surfaces import before_and_after, draw_edges, draw_surface, sensitivity_map
from .view import View


def of_geometry(geometry: Geometry, view: View | str = "iso", title: str = "") -> Figure:
    """A geometry as it is; of a volume mesh in three dimensions the boundary's lines."""
    figure = blank()
    axes = figure.subplots()
    axes.set_title(title, fontsize=13)
    if isinstance(geometry, Section):
        draw_section(axes, geometry.points)
    elif isinstance(geometry, Cloud):
        projected = View.of(view).project(geometry.points)
        axes.scatter(projected[:, 0], projected[:, 1], s=2)
        axes.set_aspect("equal")
    elif isinstance(geometry, VolumeMesh):
        flat = "top" if geometry.dimension == 2 else view
        draw_edges(axes, geometry.points, _mesh_lines(geometry), flat)
    else:
        draw_surface(axes, geometry.points, geometry.faces, view=view)
    return figure


def of_deformation(
    pipeline: Pipeline, values: Values | None = None, view: View | str = "iso", title: str = ""
) -> Figure:
    """A pipeline's geometry before and after, with its control points.

    Of what is no surface, and of what is made from other geometries, only the after is drawn.
    """
    if len(pipeline.feeding) > 1:  # its triangles may be others at other values
        return _among_points(pipeline(values), nets(pipeline, values), view, title)
    rest, moved = pipeline.geometry.points, pipeline.points(values)
    drawn = nets(pipeline, values)
    if isinstance(pipeline.geometry, Section):
        figure = blank(12, 5)
        axes = figure.subplots()
        draw_section(axes, rest, moved, drawn)
        axes.set_title(title)
        return figure
    if not hasattr(pipeline.geometry, "faces"):
        return _among_points(pipeline(values), drawn, view, title)
    return before_and_after(rest, moved, _faces(pipeline), drawn, view, title)


def of_sensitivity(
    pipeline: Pipeline,
    values: Values | None,
    number: str,
    view: View | str = "iso",
    title: str = "",
) -> Figure:
    """A surface coloured by how far each point moves per unit of one number of a variable.

    The component of largest motion is shown, with its sign. `number` is a variable's name, with
    an index where it has several.
    """
    name, index = _numbered(pipeline, number)
    variable = pipeline.variables[name]
    direction = {name: np.eye(variable.size)[index]}
    pipeline = pipeline.at(values)
    motion = np.asarray(pipeline.pushforward(values, direction))
    own = np.abs(motion[: _own_points(pipeline)]).max(axis=0)
    axis = int(own.argmax())
    unit = f" per {variable.unit}" if variable.unit else ""
    label = f"d{'xyz'[axis]} / d {variable.labels()[index]}{unit and ' [m' + unit + ']'}"
    return sensitivity_map(
        pipeline.points(values),
        _faces(pipeline),
        np.clip(motion[:, axis], -own[axis], own[axis]),
        label,
        nets(pipeline, values),
        _highlighted(pipeline, values, direction),
        view,
        title,
    )


def of_cuts(pipeline: Pipeline, values: Values | None, stations: Sequence[float]) -> Figure:
    """Sections at several y, before (dashed) and after."""
    here, is_joined = pipeline.at(values), len(pipeline.feeding) > 1
    rest = here.source(values) if is_joined else here.geometry.points
    moved = np.asarray(here.points(values))
    return section_picture(rest, moved, _faces(here), stations)


def _own_points(pipeline: Pipeline) -> int:
    """How many points move as their part does; where a union's cut is flat, others run fast."""
    made = pipeline.branches[pipeline.result].making
    if isinstance(made, Wetting):
        return sum(len(part) for part in made.recipe.kept)
    return len(pipeline.geometry.points)


def _mesh_lines(mesh: VolumeMesh) -> np.ndarray:
    """Pairs of joined points: all of a plane mesh, only the boundary's where it would be hidden."""
    if mesh.dimension == 2 or not mesh.markers:
        return joined_points(mesh)
    skins = [VolumeMesh(mesh.points, cells) for cells in mesh.markers.values()]
    return np.concatenate([joined_points(skin) for skin in skins])


def nets(pipeline: Pipeline, values: Values | None = None) -> list[Net]:
    """Control points of a pipeline's stages, and the places that pilots hold.

    Those on geometries that the result is made from come first.
    """
    here = pipeline.at(values)
    return [net for name in here.feeding for net in _own_nets(here.of(name), values)]


def _own_nets(pipeline: Pipeline, values: Values | None) -> list[Net]:
    found = []
    steps = pipeline.steps(values)
    for number, step in enumerate(steps):
        if isinstance(step.deformer, AbstractControlNet):
            rest = step.deformer.rest.reshape(-1, 3)
            carrying = steps[:number] if step.stage.carried else []
            moves = np.asarray(step.deformer.moves(step.controls)).reshape(-1, 3)
            moved = _after(carrying, rest) + moves
            found.append(Net(step.deformer.lines, rest, moved, _pilots(step) is not None))
        is_last = number + 1 == len(steps) or steps[number + 1].stage is not step.stage
        pilots = _pilots(step)
        if pilots is not None and is_last:
            base = pipeline.source(values)
            moved = _after(steps[: number + 1], base)
            before, after = (np.asarray(pilots.marks(shape)) for shape in (base, moved))
            found.append(Net(np.empty((0, 2), int), before, after))
    return found


def _pilots(step: Step) -> Pilots | None:
    return step.stage.deformer if isinstance(step.stage.deformer, Pilots) else None


def _after(steps: Sequence[Step], rest: Points) -> np.ndarray:
    """Where some steps take places."""
    place = rest
    for step in steps:
        place = step.after(rest, place)
    return np.asarray(place)


def _highlighted(
    pipeline: Pipeline, values: Values | None, direction: dict[str, np.ndarray]
) -> list[np.ndarray]:
    """Of each net the control points that a number moves."""
    small = 1e-6 * max(pipeline.variables[name].typical for name in direction)
    full = {name: np.asarray(value) for name, value in pipeline.values(values).items()}
    there = {name: full[name] + small * direction.get(name, 0.0) for name in full}
    pairs = zip(nets(pipeline, full), nets(pipeline, there), strict=True)
    return [
        np.array([], int)
        if before.is_hidden
        else _moving(np.linalg.norm(after.moved - before.moved, axis=1))
        for before, after in pairs
    ]


def _moving(motion: np.ndarray) -> np.ndarray:
    return np.flatnonzero(motion > 1e-6 * motion.max(initial=0.0))  # not by rounding alone


def _among_points(geometry: Geometry, drawn: list[Net], view: View | str, title: str) -> Figure:
    """A geometry with control points in it, of which a mesh may reach far beyond."""
    figure = of_geometry(geometry, view, title)
    (axes,) = figure.axes
    shown = View.of("top" if getattr(geometry, "dimension", 3) == 2 else view)
    for net in drawn:
        draw_net(axes, net.lines, net.rest, net.moved, view=shown, is_hidden=net.is_hidden)
    if drawn:
        corners = [places for net in drawn for places in (net.rest, net.moved)]
        if isinstance(geometry, Surface):
            corners.append(geometry.points)
        flat = shown.project(np.concatenate(corners))[:, :2]
        low, high = flat.min(axis=0), flat.max(axis=0)
        room = 0.15 * (high - low).max()
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlim(low[0] - room, high[0] + room)
        axes.set_ylim(low[1] - room, high[1] + room)
    return figure


def _numbered(pipeline: Pipeline, number: str) -> tuple[str, int]:
    match = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", number.strip())
    labels = [label for v in pipeline.variables.values() for label in v.labels()]
    if match is None or match[1] not in pipeline.variables:
        raise ParameterError(f"no number {number!r}; there is: {', '.join(labels)}")
    index = int(match[2] or 0)
    if index >= pipeline.variables[match[1]].size:
        raise ParameterError(f"no number {number!r}; there is: {', '.join(labels)}")
    return match[1], index


def _faces(pipeline: Pipeline) -> np.ndarray:
    faces = getattr(pipeline.geometry, "faces", None)
    if faces is None:
        kind = type(pipeline.geometry).__name__
        raise ParameterError(f"this picture needs a surface, the case has a {kind}")
    return np.asarray(faces)
