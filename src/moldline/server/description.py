"""What a case is made of, for a client that has none of moldline's classes."""

import math
from typing import Any

import numpy as np

from ..case import Case
from ..mesh import Geometry, Grid, Surface, VolumeMesh
from ..parameters.variable import Variable
from ..pipeline.overview import overview


def of_case(case: Case) -> dict[str, Any]:
    """Geometries, variables, measures and stages, as JSON holds them."""
    told = overview(case.pipeline)
    return {
        "path": str(case.path),
        "result": case.pipeline.result,
        "units": case.units(),
        "geometries": {n: _size(g) for n, g in case.pipeline.geometries.items()},
        "riders": {n: _size(p.geometry) for n, p in case.riders.items()},
        "variables": {n: of_variable(v) for n, v in case.pipeline.variables.items()},
        "measures": {
            name: {
                "measure": type(one.measure).__name__,
                "size": one.measure.size,
                "lower": [_finite(x) for x in np.ravel(one.bounds[0])],
                "upper": [_finite(x) for x in np.ravel(one.bounds[1])],
            }
            for name, one in case.measurements.constraints.items()
        },
        "overview": told.as_dict(),
        "sentences": told.sentences(),
    }


def of_variable(variable: Variable) -> dict[str, Any]:
    """A variable; a bound that there is not is None."""
    return {
        "size": variable.size,
        "value": list(variable.value),
        "lower": [_finite(x) for x in variable.lower],
        "upper": [_finite(x) for x in variable.upper],
        "typical": variable.typical,
        "unit": variable.unit,
        "labels": variable.labels(),
    }


def of_geometry(geometry: Geometry) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What joins a geometry's points: fields, and arrays but for the points."""
    fields: dict[str, Any] = {"kind": type(geometry).__name__.lower()}
    arrays: dict[str, np.ndarray] = {}
    if isinstance(geometry, Surface):
        fields["components"] = list(geometry.components)
        arrays = {"faces": np.asarray(geometry.faces), "tags": np.asarray(geometry.tags)}
    elif isinstance(geometry, Grid):
        fields["shapes"] = [list(shape) for shape in geometry.shapes]
        arrays = {"faces": np.asarray(geometry.faces, np.int32)}
    elif isinstance(geometry, VolumeMesh):
        fields |= {"dimension": geometry.dimension, "markers": list(geometry.markers)}
        arrays = {name: np.asarray(one, np.int64) for name, one in geometry.cells._asdict().items()}
    return fields, arrays


def _size(geometry: Geometry) -> dict[str, Any]:
    found: dict[str, Any] = {
        "kind": type(geometry).__name__.lower(),
        "points": len(geometry.points),
    }
    if isinstance(geometry, Surface | Grid):
        found["faces"] = len(geometry.faces)
    if isinstance(geometry, Surface):
        found["components"] = list(geometry.components)
    return found


def _finite(number: float) -> float | None:
    return float(number) if math.isfinite(number) else None
