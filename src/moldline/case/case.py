"""A case: what a case file describes, ready to run."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import registry
from .._types import Points
from ..deformers.base import AbstractDeformer
from ..deformers.net import AbstractControlNet
from ..errors import CaseError, MoldlineError, ParameterError
from ..mesh import Cloud, Geometry
from ..mesh.io import METRES, found, mapped, read
from ..mesh.io.files import replacing
from ..modelers.base import AbstractModeler
from ..parameters.link import Link
from ..parameters.links import LINKS, mirrored
from ..parameters.variable import Variable, variable
from ..pipeline.assembly import Assembly
from ..pipeline.construction import Construction
from ..pipeline.measurements import Maker, Measurements
from ..pipeline.pipeline import Pipeline
from ..pipeline.stage import Stage
from . import built, editing, options, schema
from .options import MeasureTable


@dataclass(frozen=True)
class Case:
    """A pipeline, the values it starts from, and where its results go.

    Attributes
    ----------
    path
        The case file.
    tables
        What it says, validated.
    pipeline
        What it describes.
    riders
        Pipelines of the points that ride on a geometry, by name.
    measurements
        Measures of the resulting geometry, with their bounds.
    text
        Of the file.
    """

    path: Path
    tables: schema.CaseTable
    pipeline: Pipeline
    riders: dict[str, Pipeline]
    measurements: Measurements
    text: str = ""

    def units(self, rider: str | None = None) -> str | None:
        """The unit of the resulting geometry's file, or of a rider's."""
        if rider is not None:
            return self.tables.rider[rider].units
        table = self.tables.geometry.get(self.pipeline.result)
        return None if table is None else table.units

    def values(self, changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """The case's values with some replaced.

        A value outside its bounds is refused, and one that a modeler would refuse in its text.
        """
        values = self.pipeline.values(changes)
        known = self.pipeline.variables
        beyond = [line for name, value in values.items() for line in known[name].outside(value)]
        if beyond:
            raise ParameterError(f"{self.path}: " + "; ".join(beyond))
        for stage in self.pipeline.stages:
            if isinstance(stage, Construction):
                with _told(str(self.path)):
                    stage.check(values)
        return values

    def embed(self, points: Geometry | Points, on: str = "", name: str = "embedded") -> Pipeline:
        """The case's deformation bound to other points; see `Pipeline.embed`."""
        return self.pipeline.embed(points, on, name)

    def rider(self, name: str) -> Pipeline:
        """The pipeline of one rider."""
        if name not in self.riders:
            known = ", ".join(self.riders) or "none"
            raise ParameterError(f"{self.path}: no rider named {name!r}; it has: {known}")
        return self.riders[name]

    def output(self, kind: str) -> Path | None:
        """Where the file puts a kind of result."""
        place = getattr(self.tables.output, kind)
        return None if place is None else self.path.parent / place

    def save(self, path: str | os.PathLike[str], values: Mapping[str, Any] | None = None) -> None:
        """Write the case file, with new values where given; it then reads back as this case.

        Comments and order stay.
        """
        tables = self.tables.model_dump(exclude_unset=True)
        for name, value in (values or {}).items():
            variable = self.pipeline.variables[name]
            checked = np.asarray(variable.checked(np.asarray(value, float)))
            if not np.array_equal(checked, variable.value):
                tables["variable"][name]["value"] = checked.tolist()
        target = Path(path)
        if target.parent.resolve() != self.path.parent.resolve():
            for table in (*tables.get("geometry", {}).values(), *tables.get("rider", {}).values()):
                table["file"] = str((self.path.parent / table["file"]).resolve())
            for kind in ("stage", "measure"):
                if kind in tables:
                    tables[kind] = built.relocated(tables[kind], self.path.parent)
        with replacing(target) as stream:
            stream.write(editing.rewritten(self.text, _without_none(tables)).encode())


def load(path: str | os.PathLike[str], sampled: bool = False) -> Case:
    """Read a case file and the geometries it names.

    With `sampled`, of each geometry only the few points are kept that reach farthest along the
    axes of space: enough to set the case up when the rest is to be streamed.
    """
    place = Path(path)
    return _loaded(schema.text_of(place), place, sampled)


def of_text(text: str, folder: Path) -> Case:
    """The case that a text describes, whose files are named from a folder."""
    place = folder / editing.TOLD
    try:
        return _loaded(text, place)
    except CaseError as error:
        raise CaseError(str(error).replace(str(place), editing.TOLD)) from None


def _loaded(text: str, place: Path, sampled: bool = False) -> Case:
    """The case of a text that is, or could be, the file at a place."""
    file = str(place)
    tables = schema.parse(text, file)
    geometries = {
        name: _read(place, table, f"geometry.{name}", sampled)
        for name, table in tables.geometry.items()
    }
    variables = {name: _variable(file, name, table) for name, table in tables.variable.items()}
    assembly = Assembly(geometries)
    for i, table in enumerate(tables.stage):
        where = f"stage.{i}"
        with _told(file, where):
            if isinstance(table, schema.ConstructionTable):
                assembly.add(_construction(file, where, table, variables, sampled))
            else:
                assembly.add(_stage(file, where, table, assembly, variables, sampled))
    unused = variables.keys() - assembly.variables.keys()
    if unused:
        raise CaseError(
            f"{file}: variable.{sorted(unused)[0]}: no stage has a link to it, so it moves nothing"
        )
    with _told(file):
        pipeline = Pipeline(assembly, [])
        riders = {
            name: pipeline.embed(_read(place, table, f"rider.{name}", sampled), table.on, name)
            for name, table in tables.rider.items()
        }
    measurements = _measurements(file, tables, pipeline, sampled)
    return Case(place, tables, pipeline, riders, measurements, text)


def _measurements(
    file: str, tables: schema.CaseTable, pipeline: Pipeline, sampled: bool
) -> Measurements:
    if sampled:
        return Measurements(pipeline, {})

    def maker(name: str, table: MeasureTable) -> Maker:
        return lambda geometry: built.measure(file, f"measure.{name}", table, geometry)

    return Measurements(pipeline, {k: maker(k, table) for k, table in tables.measure.items()})


def _read(
    case: Path, table: schema.GeometryTable | schema.RiderTable, where: str, sampled: bool
) -> Geometry:
    if not table.file.isprintable():  # a message with it might command the terminal
        raise CaseError(f"{case}: {where}.file: {table.file!r} holds control characters")
    file = case.parent / table.file
    try:
        if sampled:
            scale = METRES[table.units] if table.units else 1.0
            return Cloud(scale * mapped.extremes(found(file), file))
        return read(file, units=table.units)
    except MoldlineError as error:
        raise CaseError(f"{case}: {where}.file: {error}") from None


def _variable(file: str, name: str, table: schema.VariableTable) -> Variable:
    given = {k: v for k, v in table.model_dump(exclude_unset=True).items() if v is not None}
    try:
        return variable(name, **given)
    except ParameterError as error:
        raise CaseError(f"{file}: variable.{name}: {error}") from None


def _construction(
    file: str,
    where: str,
    table: schema.ConstructionTable,
    variables: dict[str, Variable],
    sampled: bool,
) -> Construction:
    if sampled:
        raise ParameterError("a case that makes its geometry has no file to stream")
    modeler = built.modeler(file, where, table)
    return Construction(
        modeler, _links(file, where, table, modeler, variables), table.to, table.of, table.name
    )


def _stage(
    file: str,
    where: str,
    table: schema.StageTable,
    assembly: Assembly,
    variables: dict[str, Variable],
    sampled: bool,
) -> Stage:
    names = assembly.names
    on = table.on or (names[0] if len(names) == 1 else "")
    if on not in names:
        raise CaseError(f"{file}: {where}.on: got {table.on!r}, expected one of {', '.join(names)}")
    cls = registry.deformer(table.deformer)
    if sampled and cls.settle is not AbstractDeformer.settle:
        raise ParameterError(
            "this deformer must see the whole geometry, which is not there when it is streamed"
        )
    deformer = built.deformer(file, where, table, assembly.geometry(on))
    links = _links(file, where, table, deformer, variables)
    return Stage(deformer, links, on, table.name, table.carried)


def _links(
    file: str,
    where: str,
    table: schema.StageTable | schema.ConstructionTable,
    turned: AbstractDeformer | AbstractModeler,
    variables: dict[str, Variable],
) -> dict[Variable, Link]:
    links: dict[Variable, Link] = {}
    for i, row in enumerate(table.link):
        place = f"{where}.link.{i}"
        if row.variable not in variables:
            raise CaseError(
                f"{file}: {place}.variable: got {row.variable!r}, expected one of "
                f"{', '.join(variables)}"
            )
        known = variables[row.variable]
        link = _link(file, place, row, turned)
        links[known] = links[known] + link if known in links else link
    return links


@contextmanager
def _told(file: str, where: str = "") -> Iterator[None]:
    """Errors with the file and the place in it."""
    try:
        yield
    except MoldlineError as error:
        if isinstance(error, CaseError):
            raise
        raise CaseError(f"{file}: {where}{where and ': '}{error}") from None


def _link(
    file: str,
    where: str,
    table: schema.LinkTable,
    turned: AbstractDeformer | AbstractModeler,
) -> Link:
    function = LINKS[table.link]
    model = options.of_link(table.link, function)
    given = schema.checked(model, table.model_extra or {}, file, where)
    if not isinstance(turned, serves := options.classes_of_link(function)):
        fit = [k for k, f in LINKS.items() if isinstance(turned, options.classes_of_link(f))]
        raise CaseError(
            f"{file}: {where}.link: {table.link!r} is for a "
            f"{' or '.join(cls.__name__ for cls in serves)}, the stage has a "
            f"{type(turned).__name__}; it takes {', '.join(fit)}"
        )
    if given.get("absolute") and table.scale != 1.0:
        raise CaseError(
            f"{file}: {where}.scale: got {table.scale}, expected 1: with absolute = true the "
            "variable is what the parameter measures"
        )
    link = function(turned, **given) * table.scale
    if not table.mirrored:
        return link
    if not isinstance(turned, AbstractControlNet):
        raise CaseError(
            f"{file}: {where}.mirrored: this is for control points, the stage has a "
            f"{type(turned).__name__}"
        )
    return mirrored(turned, link, table.mirrored)


def _without_none(table: Any) -> Any:
    """TOML has no null: such keys are left out. Tuples are lists."""
    if isinstance(table, dict):
        return {k: _without_none(v) for k, v in table.items() if v is not None}
    if isinstance(table, list | tuple):
        return [_without_none(one) for one in table]
    return table
