"""A case deformed file to file, some points at a time: for meshes larger than memory."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from ..errors import FileError, ParameterError
from ..mesh.io import METRES, found, mapped, named_by
from .case import Case


def deform(
    case: Case, target: Path, values: Mapping[str, Any], rider: str | None = None
) -> tuple[int, float]:
    """Write the deformed geometry, or a rider; gives its number of points and the largest motion.

    The case must have been loaded with `sampled=True`. The file keeps its format, and everything
    in it but coordinates and normals is copied byte for byte.
    """
    tables = case.tables
    name = case.pipeline.result
    table = tables.geometry[name] if rider is None else tables.rider[rider]
    source = case.path.parent / table.file
    module = found(source)
    if named_by(target) is not module:
        raise FileError(f"{target}: a streamed {module.NAME} keeps its format; name it so")
    pipeline = case.pipeline if rider is None else case.rider(rider)
    settling = [stage.name for stage in pipeline.own_stages if stage.settles]
    if settling:
        raise ParameterError(
            f"stage {settling[0]!r} must see the whole geometry, which is not there when it is "
            "streamed"
        )
    on = name if rider is None else case.tables.rider[rider].on
    scale = METRES[table.units] if table.units else 1.0
    total, farthest = mapped.count(module, source), 0.0
    with tqdm(total=total, desc="deform", unit="points", delay=2, leave=False) as bar:

        def change(points: np.ndarray) -> np.ndarray:
            nonlocal farthest
            rest = points * scale
            moved = np.asarray(case.pipeline.embed(rest, on).points(values))
            farthest = max(farthest, float(np.linalg.norm(moved - rest, axis=1).max(initial=0.0)))
            bar.update(len(points))
            return moved / scale

        mapped.rewritten(module, source, target, change)
    return total, farthest
