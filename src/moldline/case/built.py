"""Deformers and measures from the tables of a case file, one within another."""

from pathlib import Path
from typing import Any

import numpy as np

from .. import registry
from ..deformers.base import AbstractDeformer
from ..errors import CaseError, MoldlineError
from ..measures.base import AbstractMeasure, Constraint
from ..mesh import Geometry
from . import options, schema
from .options import DeformerTable, MeasureTable


def deformer(file: str, where: str, table: Any, geometry: Geometry) -> AbstractDeformer:
    """From a table with its name under `deformer` and its own options beside it."""
    return _built(file, where, registry.deformer(table.deformer), table.deformer, table, geometry)


def measure(
    file: str, where: str, table: MeasureTable, geometry: Geometry
) -> AbstractMeasure | Constraint:
    """From a table with its name under `measure`; a constraint where it has bounds."""
    cls = registry.measure(table.measure)
    made = _built(file, where, cls, table.measure, table, geometry)
    if table.bounds is None:
        return made
    lower, upper = np.asarray(table.bounds, float).reshape(-1, 2).T
    return Constraint(made, lower, upper, table.weight)


def relocated(table: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A deformer's or measure's table for a case file elsewhere: its paths from `folder`."""
    if isinstance(table.get("deformer"), str):
        cls = registry.deformer(table["deformer"])
    elif isinstance(table.get("measure"), str):
        cls = registry.measure(table["measure"])
    else:
        return {key: _relocated(value, folder) for key, value in table.items()}
    names = options.paths(cls).keys()
    return {
        key: str((folder / value).resolve())
        if key in names and value is not None
        else _relocated(value, folder)
        for key, value in table.items()
    }


def _relocated(value: Any, folder: Path) -> Any:
    if isinstance(value, list):
        return [_relocated(one, folder) for one in value]
    return relocated(value, folder) if isinstance(value, dict) else value


def _built(file: str, where: str, cls: Any, name: str, table: Any, geometry: Geometry) -> Any:
    try:
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
