"""Coordinates in a file, seen and changed where they lie: for meshes larger than memory."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ...errors import FileError
from .binary import narrowed
from .files import replacing

CHUNK = 2**17
"""Points that are held at a time."""


class Run(NamedTuple):
    """Coordinates in one run of a file, as a view into it.

    Attributes
    ----------
    points
        Shape (rows, k, 3): k points in each row of the file.
    normals
        The normal of each row's triangle, where the file holds one, shape (rows, 3).
    """

    points: np.ndarray
    normals: np.ndarray | None = None


def chunks(module: ModuleType, path: Path | str) -> Iterator[Float[np.ndarray, "n 3"]]:
    """The coordinates of a file, some at a time."""
    for run in _runs(module, np.memmap(path, mode="r"), path):
        for rows in _parts(run):
            points = np.asarray(run.points[rows], np.float64).reshape(-1, 3)
            if not np.isfinite(points).all():
                raise FileError(f"{path}: holds coordinates that are not finite; mend them first")
            yield points


def extremes(module: ModuleType, path: Path | str) -> Float[np.ndarray, "e 3"]:
    """The points of a file that reach farthest along the axes, six at most."""
    found = np.empty((0, 3))
    for points in chunks(module, path):
        both = np.concatenate([found, points])
        found = both[np.unique(np.concatenate([both.argmin(axis=0), both.argmax(axis=0)]))]
    return found


def rewritten(
    module: ModuleType,
    source: Path | str,
    target: Path | str,
    change: Callable[[np.ndarray], np.ndarray],
) -> None:
    """Write a copy of a file whose coordinates are changed, some at a time, in their order.

    Everything else is copied byte for byte, but for normals, which follow.
    """
    with replacing(target) as file:
        with Path(source).open("rb") as original:
            shutil.copyfileobj(original, file, 2**24)
        file.flush()
        data = np.memmap(file.name, mode="r+")
        for run in _runs(module, data, source):
            for rows in _parts(run):
                old = np.asarray(run.points[rows], np.float64)
                new = change(old.reshape(-1, 3)).reshape(old.shape)
                run.points[rows] = narrowed(new, run.points.dtype, target)
                if run.normals is not None:
                    run.normals[rows] = module.facing(new)
        data.flush()
        del run, data  # some systems rename no file that is mapped


def count(module: ModuleType, path: Path | str) -> int:
    """How many points a file holds."""
    runs = _runs(module, np.memmap(path, mode="r"), path)
    return sum(run.points.shape[0] * run.points.shape[1] for run in runs)


def _runs(module: ModuleType, data: np.ndarray, path: Path | str) -> list[Run]:
    if not hasattr(module, "runs"):
        raise FileError(
            f"{path}: {module.NAME} cannot be streamed; binary Cart3D tri, binary STL and binary "
            "PLOT3D can: convert it"
        )
    runs: list[Run] = module.runs(data, path)
    return runs


def _parts(run: Run) -> Iterator[slice]:
    rows, per_row = run.points.shape[:2]
    step = max(1, CHUNK // per_row)
    for first in range(0, rows, step):
        yield slice(first, min(first + step, rows))
