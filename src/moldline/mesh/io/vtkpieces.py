"""What the pieces of VTK's data sets have in common: points, cells, their data and names."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float, Int

from ..._types import Array
from ...errors import FileError
from . import text
from .vtkxml import Document

COMPONENTS = "component_names"
"""The field data that name components."""


class Piece(NamedTuple):
    """A part of an unstructured grid; its cells lie one after the other in `corners`."""

    name: str
    points: Float[np.ndarray, "n 3"]
    corners: Int[np.ndarray, "w"]
    sizes: Int[np.ndarray, "c"]
    types: Int[np.ndarray, "c"]
    """VTK's number of each cell."""
    point_data: dict[str, np.ndarray]
    cell_data: dict[str, np.ndarray]


def pieces(document: Document, kind: str) -> list[Element]:
    """The pieces of a data set, such as `PolyData`; at least one."""
    mesh = document.root.find(kind)
    if mesh is None:
        raise FileError(
            f"{document.path}: holds {text.quoted(document.root.get('type', ''))}, expected "
            f"{kind!r}; extract its surface first"
        )
    found = mesh.findall("Piece")
    if not found:
        raise FileError(f"{document.path}: {kind} has no Piece, so there is nothing to read")
    return found


def grid_piece(document: Document, piece: Element) -> Piece:
    """A piece of an unstructured grid."""
    points = coordinates(document, piece)
    corners, sizes = cells(document, piece, "Cells", len(points))
    types = np.empty(0, np.int32)
    if len(sizes):
        found = _arrays(document, piece, "Cells", ("types",))["types"]
        place = document.place(found)
        types = _indices(document, place, document.array(found, len(sizes)).ravel(), 256)
        if len(types) != len(sizes):
            raise FileError(f"{place}: {len(types)} numbers, expected {len(sizes)}")
    return Piece(
        piece.get("Name", ""),
        points,
        corners,
        sizes,
        types,
        data(document, piece, "PointData", len(points)),
        data(document, piece, "CellData", len(sizes)),
    )


def coordinates(document: Document, piece: Element) -> Float[np.ndarray, "n 3"]:
    """Points of a piece."""
    count = document.count(piece, "NumberOfPoints")
    holder = piece.find("Points/DataArray")
    points = np.empty((0, 3)) if holder is None else document.array(holder, count)
    if points.shape != (count, 3) or not np.isfinite(points).all():
        raise FileError(f"{document.place(piece)} needs {count} points of three finite coordinates")
    return points.astype(np.float64)


def cells(
    document: Document, piece: Element, tag: str, points: int, least: int = 1
) -> tuple[Int[np.ndarray, "w"], Int[np.ndarray, "c"]]:
    """Points of a piece's cells, one cell after the other, and how many each cell has.

    `tag` is the element that holds them, such as `Polys`.
    """
    count = document.count(piece, f"NumberOf{tag}")
    if not count:
        return np.empty(0, np.int32), np.empty(0, np.int64)
    found = _arrays(document, piece, tag, ("connectivity", "offsets"))
    place = document.place(found["connectivity"])
    corners = _indices(document, place, document.array(found["connectivity"]).ravel(), points)
    ends = document.array(found["offsets"], count).astype(np.float64).ravel()
    with np.errstate(invalid="ignore"):  # infinity less infinity
        sizes = np.diff(ends, prepend=0.0)
    is_whole = (sizes >= least) & (sizes == np.floor(sizes))
    if len(ends) != count or ends[-1] != len(corners) or not is_whole.all():
        raise FileError(
            f"{document.place(found['offsets'])}: offsets must rise by {least} or more, up to the "
            f"{len(corners)} entries of connectivity"
        )
    return corners, sizes.astype(np.int64)


def data(document: Document, piece: Element, tag: str, rows: int) -> dict[str, np.ndarray]:
    """Arrays of numbers by name; some programs write an element of their own around each."""
    found: dict[str, np.ndarray] = {}
    for parent in piece.findall(tag):
        found |= document.arrays(parent, rows)
    return found


def merged(parts: Sequence[Mapping[str, Array]], path: Path | str) -> dict[str, np.ndarray]:
    """Arrays that all pieces have, one after the other."""
    shared = [name for name in parts[0] if all(name in part for part in parts)]
    for name in shared:
        if len({part[name].shape[1:] for part in parts}) > 1:
            raise FileError(
                f"{path}: the pieces' data {text.quoted(name)} differ in NumberOfComponents, "
                "expected the same in all"
            )
    return {name: np.concatenate([part[name] for part in parts]) for name in shared}


def components(
    labels: np.ndarray | None, names: tuple[str, ...], path: Path | str
) -> tuple[np.ndarray | None, tuple[str, ...] | None]:
    """Tags and names: the names' own numbers, or one component per different number."""
    if labels is None:
        return None, None
    check_single(labels, "component", path)
    if names:
        count = len(names)
        return text.indices(labels, count, path, lambda row: f"component of face {row}", 0), names
    found, tags = np.unique(labels, return_inverse=True)
    return tags, tuple(f"{label:.15g}" for label in found.tolist())


def check_single(labels: np.ndarray, name: str, path: Path | str) -> None:
    """Refuse a cell array that has several numbers per cell."""
    if labels.ndim != 1:
        raise FileError(f"{path}: the cell array {name!r} needs one number per cell")


def names(document: Document, key: str) -> tuple[str, ...]:
    """Names in the field data, which are written as codes of letters with a 0 after each name."""
    for element in document.root.findall("*/FieldData/Array"):
        if element.get("Name") == key:
            found = document.array(element).tobytes().split(b"\0")[:-1]
            return tuple(text.decoded(name) for name in found)
    return ()


def name_array(key: str, names: tuple[str, ...]) -> bytes:
    """An element of the field data that holds names."""
    codes = b"".join(name.replace("\0", "?").encode(errors="replace") + b"\0" for name in names)
    return (
        f'<Array type="String" Name="{key}" NumberOfTuples="{len(names)}" '
        f'format="ascii">{" ".join(map(str, codes))}</Array>\n'
    ).encode()


def _arrays(
    document: Document, piece: Element, tag: str, wanted: tuple[str, ...]
) -> dict[str | None, Element]:
    """Elements of the arrays below an element, by name."""
    found = {e.get("Name"): e for e in piece.findall(f"{tag}/DataArray")}
    if not set(wanted) <= found.keys():
        needed = " and ".join(wanted)
        raise FileError(f"{document.place(piece)}: {tag} need the arrays {needed}")
    return found


def _indices(document: Document, place: str, values: np.ndarray, count: int) -> np.ndarray:
    """Numbers from 0 that refer to one of `count` things."""
    inside = place.removeprefix(f"{document.path}: ")
    return text.indices(
        values, count, document.path, lambda row: f"{inside}, entry {row + 1},", base=0
    )
