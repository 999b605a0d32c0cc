"""Trix: Cart3D's extended triangulations, VTK's XML as text, with derivatives of the points.

Each component is a `Piece` with points of its own; components that share points, or whose points
or triangles lie between those of others, share a piece, so that nothing changes its place. The
components' numbers stand in the cell arrays `IntersectComponents` and `GMPtags`, their names in
the string array `component_names` of the field data, which other programs' files need not have:
there a piece is a component by its name, or each number in it is one. Derivatives of the points by
a variable are point data of the type `SHAPE_LINEARIZATION`; a piece that lacks one does not move
with that variable. Points that pieces share are not welded. Cart3D also calls these files
`.i.tri`; the content tells them from its plain triangulations.

Lost on writing: nothing, but arrays of more than two axes come back with the later ones run
together. Text keeps every bit.
"""

import re
from collections.abc import Collection, Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._types import Array
from ...errors import FileError, ParameterError
from ..surface import Surface
from . import vtkpieces
from .files import contents, replacing
from .tri import whole_ids
from .vtkpieces import Piece
from .vtkxml import Document, attribute, opening, text_array

NAME = "Cart3D trix"
SUFFIXES = (".trix",)
HOLDS = Surface

MARK = "SHAPE_LINEARIZATION"
TAGS, PATCHES = "IntersectComponents", "GMPtags"
TRIANGLE = 5

_NAMED_PIECE = re.compile(rb"<Piece\s[^>]*\bName\s*=")


class Part(NamedTuple):
    """What a piece holds of a surface."""

    points: slice
    faces: slice


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether it is a VTK file of an unstructured grid with Cart3D's additions."""
    is_grid = b"<VTKFile" in head and b"UnstructuredGrid" in head
    return is_grid and (b"TRIXtype" in head or _NAMED_PIECE.search(head) is not None)


def read(path: Path | str) -> Surface:
    """The surface in a file; derivatives are point data like any other."""
    return read_marked(path)[0]


def read_marked(path: Path | str) -> tuple[Surface, tuple[str, ...]]:
    """The surface, and which of its point data are derivatives of its points."""
    document = Document(contents(path), path)
    elements = vtkpieces.pieces(document, "UnstructuredGrid")
    arrays = (e for element in elements for e in element.findall("PointData/DataArray"))
    marked = tuple(dict.fromkeys(e.get("Name", "") for e in arrays if e.get("TRIXtype") == MARK))
    pieces = [vtkpieces.grid_piece(document, element) for element in elements]
    for piece, element in zip(pieces, elements, strict=True):
        _check(piece, marked, document.place(element))
    tags, components = _components(pieces, vtkpieces.names(document, vtkpieces.COMPONENTS), path)
    before = np.cumsum([0] + [len(piece.points) for piece in pieces])
    return Surface(
        np.concatenate([piece.points for piece in pieces]),
        np.concatenate(
            [p.corners.reshape(-1, 3) + n for p, n in zip(pieces, before[:-1], strict=True)]
        ),
        tags,
        components,
        vtkpieces.merged([piece.point_data for piece in pieces], path),
        vtkpieces.merged([piece.cell_data for piece in pieces], path),
    ), marked


def write(
    path: Path | str, surface: Surface, linearizations: Collection[str] | None = None
) -> None:
    """Write a piece for each group of components.

    `linearizations` names the point data that are derivatives of the points; unless it is given,
    all that are vectors are.
    """
    marked = vectors(surface) if linearizations is None else set(linearizations)
    wrong = sorted(marked - vectors(surface))
    if wrong:
        raise ParameterError(f"{path}: no point data of three floats named {wrong[0]!r}")
    ids = _ids(surface.components, path)
    with replacing(path) as file:
        names = vtkpieces.name_array(vtkpieces.COMPONENTS, surface.components)
        file.write(opening("UnstructuredGrid"))
        for name, part in _parts(surface).items():
            file.writelines(_piece(surface, name, part, ids, marked))
        file.write(b"<FieldData>\n" + names + b"</FieldData>\n</UnstructuredGrid>\n</VTKFile>\n")


def _check(piece: Piece, marked: tuple[str, ...], place: str) -> None:
    """Refuse what is no triangulation; a derivative that a piece lacks is zero there."""
    other = piece.types[(piece.types != TRIANGLE) | (piece.sizes != 3)]
    if len(other):
        raise FileError(f"{place} has cells of VTK's type {other[0]}, expected triangles (5)")
    for name in marked:
        shape = piece.point_data.setdefault(name, np.zeros((len(piece.points), 3))).shape
        if shape != (len(piece.points), 3):
            raise FileError(f"{place}: derivatives {name!r} need three numbers per point")


def _components(
    pieces: list[Piece], names: tuple[str, ...], path: Path | str
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The component of each face, and all components' names."""
    numbers = []
    for piece in pieces:
        found = piece.cell_data.pop(TAGS, np.zeros(len(piece.sizes), np.int16))
        vtkpieces.check_single(found, TAGS, path)
        if np.array_equal(found, piece.cell_data.get(PATCHES, ())):
            del piece.cell_data[PATCHES]
        numbers.append(found)
    if names:
        return _named(np.concatenate(numbers), names, path), names
    titles: dict[str, int] = {}
    tags = []
    for piece, found in zip(pieces, numbers, strict=True):
        values, inverse = np.unique(found, return_inverse=True)
        several = [f"{value:.15g}" for value in values.tolist()]
        if len(pieces) > 1:
            several = [f"{piece.name}:{value}" for value in several]
        own = several if len(values) > 1 or not piece.name else [piece.name]
        index = [titles.setdefault(title, len(titles)) for title in own[: len(values)]]
        tags.append(np.array(index, np.int32)[inverse])
    return np.concatenate(tags), tuple(titles) or ("1",)


def _named(numbers: np.ndarray, names: tuple[str, ...], path: Path | str) -> np.ndarray:
    """Numbers of components become their places among the names."""
    ids = _ids(names, path)
    order = np.argsort(ids)
    places = order[np.searchsorted(ids, numbers, sorter=order).clip(max=len(ids) - 1)]
    wrong = np.flatnonzero(ids[places] != numbers)
    if len(wrong):
        raise FileError(
            f"{path}: triangle {wrong[0]} is of the component {numbers[wrong[0]]:.15g}, expected "
            f"one of the {len(ids)} that have names"
        )
    return places


def _ids(components: tuple[str, ...], path: Path | str) -> np.ndarray:
    """Numbers of the components: their names where those are different ones, else 1, 2, ..."""
    ids = whole_ids(components)
    if len(set(components)) < len(components) or not 1 <= ids.min() <= ids.max() < 2**15:
        ids = np.arange(1, len(components) + 1)
    if len(ids) >= 2**15:
        raise FileError(f"{path}: {len(ids)} components, but trix counts only {2**15 - 1}")
    return ids.astype(np.int16)


def vectors(surface: Surface) -> set[str]:
    """Point data of three floats each."""
    data = {name: np.asarray(array) for name, array in surface.point_data.items()}
    return {name for name, a in data.items() if a.shape[1:] == (3,) and a.dtype.kind == "f"}


def _parts(surface: Surface) -> dict[str, Part]:
    """What each piece holds, by its name: as few components as keep the order of everything."""
    tags, faces = np.asarray(surface.tags), np.asarray(surface.faces)
    last = np.zeros(len(surface.components), np.int64)
    np.maximum.at(last, tags, np.arange(len(tags)))
    highest = np.maximum.accumulate(faces.max(axis=1, initial=0))
    lowest = np.minimum.accumulate(faces.min(axis=1, initial=len(surface.points))[::-1])[::-1]
    is_cut = np.maximum.accumulate(last[tags])[:-1] < np.arange(1, len(tags))
    is_cut &= highest[:-1] < lowest[1:]
    cuts = (1 + np.flatnonzero(is_cut)).tolist()
    ends = zip(
        pairwise([0, *lowest[cuts].tolist(), len(surface.points)]),
        pairwise([0, *cuts, len(faces)]),
        strict=True,
    )
    parts: dict[str, Part] = {}
    for points, own in ends:
        used = dict.fromkeys(tags[slice(*own)].tolist())
        name = "+".join(surface.components[tag] for tag in used)[:80] or "1"
        unique = name if name not in parts else f"{name}:{len(parts) + 1}"
        parts[unique] = Part(slice(*points), slice(*own))
    return parts


def _piece(
    surface: Surface, name: str, part: Part, ids: np.ndarray, marked: Collection[str]
) -> Iterator[bytes]:
    points, faces = np.asarray(surface.points)[part.points], surface.faces[part.faces]
    tags = ids[surface.tags[part.faces]]
    cell_data: dict[str, Array] = {TAGS: tags, PATCHES: tags}
    cell_data |= {k: a[part.faces] for k, a in surface.face_data.items() if k != TAGS}
    yield (
        f'<Piece Name={attribute(name)} NumberOfPoints="{len(points)}" '
        f'NumberOfCells="{len(faces)}">\n<Points>\n'
    ).encode()
    yield from text_array("Points", points)
    yield b"</Points>\n<Cells>\n"
    yield from text_array("connectivity", faces.ravel() - part.points.start)
    yield from text_array("offsets", 3 * np.arange(1, len(faces) + 1, dtype=np.int32))
    yield from text_array("types", np.full(len(faces), TRIANGLE, np.uint8))
    yield b"</Cells>\n<CellData>\n"
    for key, array in cell_data.items():
        kind = "COMPONENT_TAG" if key in (TAGS, PATCHES) else "OTHER"
        yield from text_array(key, array, TRIXtype=kind)
    yield b"</CellData>\n<PointData>\n"
    for key, array in surface.point_data.items():
        kind = MARK if key in marked else "FLOW_VARIABLE"
        yield from text_array(key, np.asarray(array)[part.points], TRIXtype=kind)
    yield b"</PointData>\n</Piece>\n"
