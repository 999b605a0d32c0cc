"""Deformers, modelers and measures from the tables of a case file, one within another."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .. import registry
from ..deformers.base import AbstractDeformer
from ..errors import CaseError, MoldlineError
from ..measures.base import AbstractMeasure, Constraint
from ..mesh import Geometry
from ..modelers.base import AbstractModeler
from . import options, schema
from .options import DeformerTable, MeasureTable


def deformer(file: str, where: str, table: Any, geometry: Geometry) -> AbstractDeformer:
    """From a table with its name under `deformer` and its own options beside it."""
    return _built(file, where, registry.deformer, table.deformer, table, geometry)


def modeler(file: str, where: str, table: Any) -> AbstractModeler:
    """From a table with its name under `modeler` and its own options beside it."""
    try:
        cls = registry.modeler(table.modeler)
        given = schema.checked(
            options.of_class(table.modeler, cls), table.model_extra or {}, file, where
        )
        if "name" in cls.options():
            given["name"] = table.to  # the key itself is the stage's name
        return cls.build(Path(file).parent, **given)
    except MoldlineError as error:
        if isinstance(error, CaseError):
            raise
        raise CaseError(f"{file}: {where}: {error}") from None


def measure(
    file: str, where: str, table: MeasureTable, geometry: Geometry
) -> AbstractMeasure | Constraint:
    """From a table with its name under `measure`; a constraint where it has bounds."""
    made = _built(file, where, registry.measure, table.measure, table, geometry)
    if table.bounds is None:
        return made
    lower, upper = np.asarray(table.bounds, float).reshape(-1, 2).T
    try:
        return Constraint(made, lower, upper, table.weight)
    except MoldlineError as error:
        raise CaseError(f"{file}: {where}: {error}") from None


def relocated(value: Any, folder: Path) -> Any:
    """Tables of stages and measures for a case file elsewhere: their paths from `folder`."""
    if isinstance(value, list):
        return [relocated(one, folder) for one in value]
    if not isinstance(value, dict):
        return value
    if "modeler" in value:
        own = options.paths(registry.modeler(value["modeler"]))
        return {
            key: _placed(one, folder) if key in own else one if own else _sections(one, folder)
            for key, one in value.items()
        }
    names = _paths(value)
    return {
        key: str((folder / one).resolve()) if key in names else relocated(one, folder)
        for key, one in value.items()
    }


def _placed(value: Any, folder: Path) -> Any:
    if isinstance(value, list):
        return [_placed(one, folder) for one in value]
    return str((folder / value).resolve())


def _sections(value: Any, folder: Path) -> Any:
    """A modeler's options, whose only paths are those of airfoils."""
    if isinstance(value, list):
        return [_sections(one, folder) for one in value]
    if isinstance(value, dict):
        return {key: _sections(one, folder) for key, one in value.items()}
    is_path = isinstance(value, str) and value.lower().endswith(".dat")
    return str((folder / value).resolve()) if is_path else value


def _paths(table: dict[str, Any]) -> set[str]:
    """Keys of a deformer's or measure's table that hold paths."""
    for key, find in (("deformer", registry.deformer), ("measure", registry.measure)):
        if isinstance(name := table.get(key), str):
            return {key for key in options.paths(find(name)) if table.get(key) is not None}
    return set()


def _built(
    file: str, where: str, find: Callable[[str], Any], name: str, table: Any, geometry: Geometry
) -> Any:
    try:
        cls = find(name)
        model = options.of_class(name, cls)
        given = schema.checked(model, table.model_extra or {}, file, where)
        known = options.paths(cls) | given
        places = {k: Path(file).parent / v for k, v in known.items() if isinstance(v, Path)}
        nested = {k: _nested(file, f"{where}.{k}", v, geometry) for k, v in given.items()}
        return cls.build(geometry, **nested | places)
    except MoldlineError as error:
        if isinstance(error, CaseError):
            raise
        raise CaseError(f"{file}: {where}: {error}") from None


def _nested(file: str, where: str, value: Any, geometry: Geometry) -> Any:
    """An option's value with the tables in it made into what they describe."""
    if isinstance(value, MeasureTable):
        return measure(file, where, value, geometry)
    if isinstance(value, DeformerTable):
        return deformer(file, where, value, geometry)
    if isinstance(value, dict):
        return {k: _nested(file, f"{where}.{k}", v, geometry) for k, v in value.items()}
    if isinstance(value, list):
        return [_nested(file, f"{where}.{i}", v, geometry) for i, v in enumerate(value)]
    return value
