"""What a case file may hold, as models that validate it and as a JSON Schema for editors."""

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, ValidationError

from .. import registry
from ..errors import CaseError, FileError
from ..mesh.io.files import contents
from ..parameters.links import LINKS
from ..parameters.variable import UNITS
from . import options
from .options import DeformerTable, MeasureTable, Pair

VERSION = 1
"""Of the case file's format; a file of another version is refused with a word on what to do."""

Unit = Literal[tuple(UNITS)]
LengthUnit = Literal["m", "cm", "mm", "in", "ft"]


class Table(BaseModel):
    """A table of a case file: no key that is not named here."""

    model_config = ConfigDict(extra="forbid", strict=False)


class GeometryTable(Table):
    """A geometry, read from a file."""

    file: str = Field(description="path, relative to the case file")
    units: LengthUnit | None = Field(None, description="the file's unit; then metres inside")


class RiderTable(Table):
    """Other points that move as a geometry does: a flow mesh, a structural model."""

    file: str = Field(description="path, relative to the case file")
    units: LengthUnit | None = Field(None, description="the file's unit; then metres inside")
    on: str = Field("", description="the geometry that they ride on")


class VariableTable(Table):
    """A design variable."""

    size: int | None = Field(None, ge=1, description="how many numbers; else as many as `value`")
    value: float | list[float] = Field(0.0, description="one number for all, or one each")
    bounds: Pair | list[Pair] | None = Field(None, description="lower and upper, in `unit`")
    typical: float | None = Field(None, gt=0, description="a change that matters, in `unit`")
    unit: Unit = Field("", description="the designer's unit; SI and radians inside")


class LinkTable(BaseModel):
    """How a variable turns the stage's controls; further keys are the link's own."""

    model_config = ConfigDict(extra="allow")
    variable: str
    link: Literal[tuple(LINKS)]
    scale: float = 1.0
    mirrored: Literal["x", "y", "z"] | None = Field(
        None, description="copy the half on the positive side of this coordinate's plane"
    )


class ConstructionTable(BaseModel):
    """One modeler; further keys are its own options."""

    model_config = ConfigDict(extra="allow")
    modeler: str
    name: str = Field("", description="what reports call the stage")
    to: str = Field(min_length=1, description="name of the geometry that it makes")
    of: list[str] = Field(default_factory=list, description="geometries that it is made from")
    link: list[LinkTable] = Field(default_factory=list)


class StageTable(BaseModel):
    """One deformer; further keys are its own options."""

    model_config = ConfigDict(extra="allow")
    deformer: str
    name: str = Field("", description="what reports call the stage")
    on: str = Field("", description="the geometry it acts on; not needed where there is one")
    carried: bool = Field(
        False, description="bound at rest and carried along by the stages before, as a child box"
    )
    link: list[LinkTable] = Field(default_factory=list)


def _kind(table: Any) -> str:
    is_read = isinstance(table, dict) and "modeler" in table
    return options.MAKES if is_read or isinstance(table, ConstructionTable) else options.DEFORMS


AnyStage = Annotated[
    Annotated[StageTable, Tag(options.DEFORMS)] | Annotated[ConstructionTable, Tag(options.MAKES)],
    Discriminator(_kind),
]


class OutputTable(Table):
    """Where results go, relative to the case file, when the command line names no place."""

    surface: str | None = Field(None, description="the deformed geometry")
    sensitivity: str | None = Field(None, description="the deformed geometry with derivatives")


class CaseTable(Table):
    """A whole case file."""

    moldline: Literal[1] = Field(description="version of this format")
    geometry: dict[str, GeometryTable] = Field(default_factory=dict)
    variable: dict[str, VariableTable] = Field(default_factory=dict)
    stage: list[AnyStage] = Field(default_factory=list)
    measure: dict[str, MeasureTable] = Field(default_factory=dict)
    rider: dict[str, RiderTable] = Field(default_factory=dict)
    output: OutputTable = OutputTable()


def parse(text: str, file: str) -> CaseTable:
    """Validate a case file's text; `file` is what errors call it."""
    try:
        tables = tomllib.loads(text)
    except ValueError as error:  # tomllib lets those of too long numbers through
        raise CaseError(f"{file}: not TOML: {str(error)[:300]}") from None
    except RecursionError:
        raise CaseError(f"{file}: not TOML: nested too deep") from None
    if tables.get("moldline", VERSION) != VERSION:
        raise CaseError(
            f"{file}: moldline: format version {tables['moldline']!r} found, expected {VERSION}; "
            f"it was written for another moldline"
        )
    try:
        return CaseTable.model_validate(tables)
    except ValidationError as error:
        raise CaseError(_listed(file, options.problems(error, "", tables))) from None


def checked(model: type[BaseModel], given: dict[str, Any], file: str, where: str) -> dict[str, Any]:
    """Options that a model accepts, as keyword arguments; only those that were given."""
    try:
        instance = model.model_validate(given)
    except ValidationError as error:
        raise CaseError(_listed(file, options.problems(error, where, given))) from None
    return {name: getattr(instance, name) for name in instance.model_fields_set}


def _listed(file: str, found: list[str]) -> str:
    return "\n".join(f"{file}: {line}" for line in found)


def json_schema() -> dict[str, Any]:
    """JSON Schema of the case file, with the options of every installed deformer and link."""
    schema = CaseTable.model_json_schema()
    definitions = schema["$defs"]
    deformers = {
        name: options.of_class(name, registry.deformer(name)) for name in registry.deformers()
    }
    measures = {
        name: options.of_class(name, registry.measure(name)) for name in registry.measures()
    }
    modelers = {
        name: options.of_class(name, registry.modeler(name)) for name in registry.modelers()
    }
    links = {name: options.of_link(name, function) for name, function in LINKS.items()}
    hidden = DeformerTable.model_json_schema()
    for name, table, key, models in (
        ("StageTable", definitions["StageTable"], "deformer", deformers),
        ("ConstructionTable", definitions["ConstructionTable"], "modeler", modelers),
        ("DeformerTable", hidden, "deformer", deformers),
        ("MeasureTable", definitions["MeasureTable"], "measure", measures),
        ("LinkTable", definitions["LinkTable"], "link", links),
    ):
        definitions[name] = _choice(table, key, models, definitions)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "moldline case file",
    } | schema


def _choice(
    table: dict[str, Any],
    key: str,
    models: dict[str, type[BaseModel]],
    definitions: dict[str, Any],
) -> dict[str, Any]:
    """A table whose further keys depend on one of its own."""
    branches = []
    for name, model in models.items():
        own = model.model_json_schema()
        for kind, definition in own.get("$defs", {}).items():
            definitions.setdefault(kind, definition)
        branches.append(
            {
                "properties": table["properties"]
                | own.get("properties", {})
                | {key: {"const": name}},
                "required": sorted({*table["required"], *own.get("required", [])}),
                "additionalProperties": False,
            }
        )
    return {"type": "object", "description": table.get("description", ""), "oneOf": branches}


def text_of(path: Path) -> str:
    """A case file's text."""
    try:
        return contents(path).decode()
    except FileError as error:
        told = str(error).removeprefix(f"{path}: ").removeprefix("cannot read it: ")
        raise CaseError(f"{path}: cannot be read: {told}") from None
    except UnicodeDecodeError as error:
        raise CaseError(f"{path}: not a text file: byte {error.start} is not UTF-8") from None
