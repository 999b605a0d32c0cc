"""A geometry with the derivatives of its points, for solvers, viewers and scripts.

| file | holds | |
|---|---|---|
| `.trix` | surfaces | Cart3D's: an array marked as a linearisation per number of a variable |
| folder | surfaces | the same, `NAME/Components.i.tri` for each number, `[1,2]` in it as `_1_2_` |
| `.vtp` | surfaces | an array of vectors per number, which ParaView shows |
| `.npz` | any | NumPy's: `points`; `faces`, `tags` and `components`; an array per number |
| `.h5` `.hdf5` | any | the same in HDF5, through h5py |

All of them keep every bit. Reading finds out which it is from the content.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import TypeAlias

import numpy as np

from ..._types import Array
from ...errors import FileError, GeometryError
from .. import Cloud, Geometry, Surface
from . import METRES, check_finite, found, hdf5, npz, text, trix, vtp, write
from .files import head

Columns: TypeAlias = dict[str, np.ndarray]
"""Derivatives of the points by each number of a variable, by its label."""

LEAF = "Components.i.tri"
"""The file in the folder of each number."""

_TABLES: dict[str, ModuleType] = {".npz": npz, ".h5": hdf5, ".hdf5": hdf5}
_FACES, _TAGS, _NAMES = "faces", "tags", "components"
_RESERVED = ("points", _FACES, _TAGS, _NAMES)


def write_sensitivities(
    path: Path | str,
    geometry: Geometry,
    columns: Mapping[str, Array],
    units: str | None = None,
    per_variable: bool = False,
) -> None:
    """Write a geometry and, for each label, the derivative of its points, shape (n, 3).

    Lengths in both are metres where `units` is given and become that unit. With `per_variable`
    the path is a folder, which gets a trix file per label, each in a folder of its name.
    """
    scale = METRES[units] if units else 1.0
    scaled = {label: np.asarray(column, np.float64) / scale for label, column in columns.items()}
    for label, column in scaled.items():
        if column.shape != geometry.points.shape:
            raise GeometryError(
                f"{path}: derivatives {label!r} have the shape {column.shape}, the points have "
                f"{geometry.points.shape}; they must agree"
            )
        check_finite(path, column, f"derivatives {label!r}")
    suffix = Path(path).suffix.lower()
    if per_variable and isinstance(geometry, Surface):
        _write_folder(Path(path), geometry, scaled, units)
    elif suffix in _TABLES and not per_variable:
        points = np.asarray(geometry.points)
        check_finite(path, points, "points")
        arrays = _arrays(geometry, points / scale, path, scaled)
        _TABLES[suffix].write_arrays(path, arrays)
    elif suffix == ".vtp" and isinstance(geometry, Surface):
        write(path, _with(geometry, scaled), units=units)
    elif suffix == ".trix" and isinstance(geometry, Surface):
        write(path, _with(geometry, scaled), units=units, linearizations=scaled)
    else:
        more = ", .vtp or .trix" if isinstance(geometry, Surface) else "; surfaces also to others"
        raise FileError(
            f"{path}: sensitivities of a {type(geometry).__name__} go to .npz, .h5{more}"
        )


def read_sensitivities(
    path: Path | str, units: str | None = None
) -> tuple[Surface | Cloud, Columns]:
    """The geometry in a file or a folder, and the derivatives of its points by their labels.

    It is a cloud of points where the file holds no triangles. With `units` lengths in both become
    metres.
    """
    geometry, columns = _read_folder(Path(path)) if Path(path).is_dir() else _read(path)
    if units is None:
        return geometry, columns
    scale = METRES[units]
    scaled = {label: np.asarray(column) * scale for label, column in columns.items()}
    return geometry.moved(np.asarray(geometry.points) * scale), scaled


def _read(path: Path | str) -> tuple[Surface | Cloud, Columns]:
    begin = head(path)
    for table in (npz, hdf5):
        if begin.startswith(table.MAGIC):
            return _from_arrays(table.read_arrays(path), path)
    module = found(path)
    if module is trix:
        return _split(*trix.read_marked(path))
    if module is vtp:
        surface = vtp.read(path)
        return _split(surface, tuple(sorted(trix.vectors(surface))))
    raise FileError(
        f"{path}: is {module.NAME}, which holds no sensitivities; they come in trix, VTP, NPZ and "
        "HDF5"
    )


def _with(surface: Surface, columns: Mapping[str, Array]) -> Surface:
    """The surface with the derivatives among its point data."""
    return Surface(
        surface.points,
        surface.faces,
        surface.tags,
        surface.components,
        {**surface.point_data, **columns},
        surface.face_data,
    )


def _split(surface: Surface, labels: tuple[str, ...]) -> tuple[Surface, Columns]:
    """The surface without the derivatives, and these."""
    columns = {k: np.asarray(surface.point_data[k], np.float64) for k in labels}
    others = {k: a for k, a in surface.point_data.items() if k not in columns}
    bare = Surface(
        surface.points,
        surface.faces,
        surface.tags,
        surface.components,
        others,
        surface.face_data,
    )
    return bare, columns


def _write_folder(
    root: Path, surface: Surface, columns: Mapping[str, Array], units: str | None
) -> None:
    """A trix file per label."""
    folders: dict[str, str] = {}
    for label in columns:
        other = folders.setdefault(_folder(label, root), label)
        if other != label:
            raise FileError(
                f"{root}: {other!r} and {label!r} would both go to the folder "
                f"{_folder(label, root)}; rename one"
            )
    for folder, label in folders.items():
        try:
            (root / folder).mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            raise FileError(
                f"{root / folder}: cannot make the folder: {problem.strerror}"
            ) from None
        one = {label: columns[label]}
        linear = _with(surface, one)
        write(root / folder / LEAF, linear, units=units, format="trix", linearizations=one)


def _folder(label: str, root: Path) -> str:
    """The name that Cart3D gives to a variable's folder."""
    name = re.sub(r"[\[\],]", "_", label)
    if not re.fullmatch(r"[^/\\:*?\"<>|\x00-\x1f]+", name) or not name.strip("."):
        raise FileError(f"{root}: no folder can be named {text.quoted(label)}; rename the variable")
    return name


def _read_folder(root: Path) -> tuple[Surface | Cloud, Columns]:
    """All files of a folder, which must hold the same geometry."""
    files = sorted(root.glob(f"*/{LEAF}"))
    if not files:
        raise FileError(f"{root}: has no folders with a file {LEAF}, expected one per variable")
    geometry, columns = _read(files[0])
    for path in files[1:]:
        other, more = _read(path)
        if not np.array_equal(other.points, geometry.points):
            raise FileError(f"{path}: its points are not those of {files[0]}; write both again")
        columns |= more
    return geometry, columns


def _arrays(
    geometry: Geometry, points: np.ndarray, path: Path | str, columns: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """What a file of named arrays holds."""
    taken = sorted(set(_RESERVED) & columns.keys())
    if taken:
        raise FileError(f"{path}: no variable can be named {taken[0]!r} there; rename it")
    arrays = {"points": points}
    if hasattr(geometry, "faces"):
        arrays[_FACES] = np.asarray(geometry.faces)
    if isinstance(geometry, Surface):
        arrays |= {_TAGS: np.asarray(geometry.tags), _NAMES: np.array(geometry.components, str)}
    return arrays | dict(columns)


def _from_arrays(
    arrays: dict[str, np.ndarray], path: Path | str
) -> tuple[Surface | Cloud, Columns]:
    arrays = {name: np.atleast_1d(array) for name, array in arrays.items()}
    if "points" not in arrays:
        raise FileError(f"{path}: has no array 'points'; found: {', '.join(arrays) or 'none'}")
    points = arrays["points"]
    columns = {label: array for label, array in arrays.items() if label not in _RESERVED}
    for name, array in {"points": points, **columns}.items():
        if array.ndim != 2 or array.shape != (len(points), 3) or array.dtype.kind != "f":
            raise FileError(
                f"{path}: {text.quoted(name)} is {array.dtype} of shape {array.shape}, expected "
                f"floats of shape ({len(points)}, 3)"
            )
        if not np.isfinite(array).all():
            raise FileError(f"{path}: {text.quoted(name)} holds values that are not finite")
    if _FACES not in arrays:
        return Cloud(points), columns
    return _surface(points, arrays, path), columns


def _surface(points: np.ndarray, arrays: dict[str, np.ndarray], path: Path | str) -> Surface:
    faces, names = arrays[_FACES], arrays.get(_NAMES)
    tags = arrays.get(_TAGS, np.zeros(len(faces), np.int32))
    for name, array, shape in ((_FACES, faces, (len(faces), 3)), (_TAGS, tags, (len(faces),))):
        if array.shape != shape or array.dtype.kind not in "iu":
            raise FileError(
                f"{path}: {name!r} is {array.dtype} of shape {array.shape}, expected whole numbers "
                f"of shape {shape}"
            )
    components = ("1",) if names is None else tuple(map(str, names.ravel().tolist()))
    return Surface(
        points,
        text.indices(faces, len(points), path, lambda row: f"face {row}", 0),
        text.indices(tags, len(components), path, lambda row: f"tag of face {row}", 0),
        components,
    )
