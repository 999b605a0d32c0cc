"""What a geometry file holds, in a few lines."""

from pathlib import Path
from typing import Any

import numpy as np

from . import Grid, Section, Surface, VolumeMesh
from .io import found, read
from .quality import bounding_box


def summary(path: Path | str) -> dict[str, Any]:
    """Format, kind, counts, names and extent of a geometry file, as plain values."""
    module = found(path)
    geometry = read(path)
    low, high = bounding_box(geometry.points).tolist()
    report: dict[str, Any] = {
        "file": str(path),
        "format": module.NAME,
        "kind": type(geometry).__name__,
        "points": len(geometry.points),
    }
    if isinstance(geometry, Surface):
        report["faces"] = len(geometry.faces)
        report["components"] = [
            f"{name} ({int(np.sum(np.asarray(geometry.tags) == i))} faces)"
            for i, name in enumerate(geometry.components)
        ]
        report["data"] = [*geometry.point_data, *geometry.face_data]
    if isinstance(geometry, Grid):
        report["blocks"] = [" x ".join(map(str, shape)) for shape in geometry.shapes]
    if isinstance(geometry, VolumeMesh):
        report["dimension"] = geometry.dimension
        report["cells"] = len(geometry.cells.types)
        report["markers"] = [f"{k} ({len(c.types)} cells)" for k, c in geometry.markers.items()]
    if isinstance(geometry, Section):
        report["name"] = geometry.name
    report["low"], report["high"] = low, high
    return report
