"""Reading and writing geometries, whatever their files' format.

Each format is a module with `NAME`, `SUFFIXES`, what it `HOLDS`, and the functions `sniff`, `read`
and `write`; its docstring says what the format loses. One without `read` is only written.
"""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...errors import FileError, GeometryError, ParameterError
from .. import Geometry
from . import dat, glb, obj, plot3d, ply, step, stl, su2, tri, trix, ugrid, vtp, vtu
from .files import contents, head

FORMATS: tuple[ModuleType, ...] = (
    *(tri, stl, obj, vtp, plot3d, su2, dat),
    *(ply, ugrid, glb, vtu, trix),
)
"""Every format, one module each."""

FITTED: tuple[ModuleType, ...] = (step,)
"""Formats of what is fitted to a geometry and states its unit; they are only written."""

METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048}
"""Length of each unit [m]."""


def read(
    path: Path | str, *, units: str | None = None, format: str | None = None, **options: Any
) -> Geometry:
    """Read a geometry from a file.

    The file's format is found by its content, and by its name where the content leaves a choice;
    `format` names it outright (such as `"tri"`), and `options` are those of that format's `read`.
    With `units` (m, mm, cm, in, ft) lengths become metres; else they stay in the file's unit.
    """
    scale = _metres(units)
    module = _named(format) if format else found(path)
    if not hasattr(module, "read"):
        raise FileError(
            f"{path}: {module.NAME} is only written; read the file that it was made from"
        )
    geometry: Geometry = module.read(path, **options)
    return geometry if units is None else geometry.moved(np.asarray(geometry.points) * scale)


def write(
    path: Path | str,
    geometry: Geometry,
    *,
    units: str | None = None,
    format: str | None = None,
    **options: Any,
) -> None:
    """Write a geometry to a file, in the format its name tells.

    `format` and `options` are as in `read`; with `units` lengths, which must be metres, are
    written in that unit. STEP needs it.
    """
    scale = _metres(units)
    module = _named(format) if format else named_by(path)
    if not isinstance(geometry, module.HOLDS):
        raise GeometryError(
            f"{path}: {module.NAME} holds a {module.HOLDS.__name__}, got a "
            f"{type(geometry).__name__}; formats for it: {_known(type(geometry))}"
        )
    check_finite(path, np.asarray(geometry.points), "points")
    if units is not None:
        geometry = geometry.moved(np.asarray(geometry.points) / scale)
    if module in FITTED:
        options["unit"] = units
    module.write(path, geometry, **options)


def check_finite(path: Path | str, array: np.ndarray, what: str) -> None:
    """Refuse to write points or derivatives that are no numbers."""
    if np.isfinite(array).all():
        return
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    raise GeometryError(
        f"{path}: {len(bad)} of {len(array)} {what} are not finite (first: {bad[0]}); "
        "nothing was written"
    )


def found(path: Path | str) -> ModuleType:
    """The format of an existing file."""
    begin = head(path)
    if not begin:
        contents(path)  # says that the file is empty
    fitting = [module for module in FORMATS if module.sniff(begin, path)]
    if len(fitting) == 1:
        return fitting[0]
    named = [
        module for module in fitting or (*FORMATS, *FITTED) if _suffix(path) in module.SUFFIXES
    ]
    if len(named) == 1:
        return named[0]
    if fitting:
        names = " or ".join(module.NAME for module in fitting)
        raise FileError(f"{path}: could be {names}; say which by its suffix or by format=")
    raise FileError(f"{path}: of no known format; known are: {_known()}")


def named_by(path: Path | str) -> ModuleType:
    """The format that a file's name tells."""
    for module in (*FORMATS, *FITTED):
        if _suffix(path) in module.SUFFIXES:
            return module
    raise FileError(f"{path}: the suffix tells no format; known are: {_known()}")


def _named(format: str) -> ModuleType:
    modules = {module.__name__.rpartition(".")[2]: module for module in (*FORMATS, *FITTED)}
    if format not in modules:
        raise ParameterError(f"no format named {format!r}; known are: {', '.join(modules)}")
    return modules[format]


def _suffix(path: Path | str) -> str:
    return Path(str(path).lower().removesuffix(".gz")).suffix


def _known(kind: type | None = None) -> str:
    modules = [module for module in FORMATS if kind in (None, module.HOLDS)]
    return ", ".join(f"{m.NAME} ({' '.join(m.SUFFIXES)})" for m in modules) or "none"


def _metres(units: str | None) -> float:
    if units is None:
        return 1.0
    if units not in METRES:
        raise ParameterError(f"no unit named {units!r}; known are: {', '.join(METRES)}")
    return METRES[units]
