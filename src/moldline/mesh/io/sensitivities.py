"""A geometry with the derivatives of its points, for viewers and for scripts.

VTP holds surfaces, one array of vectors per number of a variable, exact. NPZ (NumPy) holds any
geometry: the arrays `points`, `faces` where there are any, and one per number.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..._types import Array
from ...errors import FileError
from .. import Geometry, Surface
from . import METRES, write
from .files import replacing


def write_sensitivities(
    path: Path | str, geometry: Geometry, columns: Mapping[str, Array], units: str | None = None
) -> None:
    """Write a geometry and, for each label, the derivative of its points, shape (n, 3).

    Lengths in both are metres where `units` is given and become that unit.
    """
    scale = METRES[units] if units else 1.0
    scaled = {label: np.asarray(column) / scale for label, column in columns.items()}
    suffix = Path(path).suffix.lower()
    if suffix == ".npz":
        arrays = {"points": np.asarray(geometry.points) / scale, **scaled}
        if hasattr(geometry, "faces"):
            arrays["faces"] = np.asarray(geometry.faces)
        with replacing(path) as stream:
            np.savez(stream, **arrays)  # type: ignore[arg-type]
    elif suffix == ".vtp" and isinstance(geometry, Surface):
        full = Surface(
            geometry.points,
            geometry.faces,
            geometry.tags,
            geometry.components,
            {**geometry.point_data, **scaled},
            geometry.face_data,
        )
        write(path, full, units=units)
    else:
        raise FileError(
            f"{path}: sensitivities of a {type(geometry).__name__} go to .npz"
            + (" or .vtp" if isinstance(geometry, Surface) else "")
        )
