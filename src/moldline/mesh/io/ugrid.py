"""UGRID: volume meshes of AFLR3, as text or binary data.

The file holds points, boundary faces with a whole number each, and solid cells sorted by type. The
name tells other programs how the numbers lie, and so it does when writing: `.ugrid` is text,
`.b8.ugrid` and `.lb8.ugrid` are big- and little-endian data with 8-byte floats (4-byte ones: `.b4`,
`.lb4`), and `.r8`, `.lr8`, `.r4`, `.lr4` the same between the record markers of Fortran. Reading
finds it out from the content. Faces of each number become a marker of that name; what may follow
the cells (numbers of volumes, flags of faces) is skipped, and so is a `.mapbc` file beside.

Lost on writing: the order of cells of different types, names of markers that are not whole numbers
(they are numbered from 1), markers without faces, what SU2 files hold besides the mesh. Text and
8-byte floats keep every bit; 4-byte floats round.
"""

import re
from collections.abc import Iterator
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FileError, GeometryError
from ..volume import NODES_PER_CELL, Cells, VolumeMesh
from . import binary as layouts
from . import text
from .binary import LAYOUTS, Fit, Layout, Part
from .files import Bytes, loaded, replacing
from .tri import whole_ids

NAME = "UGRID"
SUFFIXES = (".ugrid",)
HOLDS = VolumeMesh

MOST = 2**14
"""Markers in a file, which are far fewer in any mesh."""

FACES = (5, 9)
SOLIDS = (10, 14, 13, 12)
"""VTK's types in the order of the header: triangles, quads; tetra, pyramids, prisms, hexa."""

FROM_VTK = {14: [1, 0, 4, 2, 3]}
TO_VTK = {14: [1, 0, 3, 4, 2]}
"""A pyramid is a prism whose last edge shrank to a point: its tip is the third of its nodes."""

_WHAT = {5: "triangle", 9: "quad", 10: "tetrahedron", 14: "pyramid", 13: "prism", 12: "hexahedron"}
_NAME = re.compile(r"\.(l?)([br])([48])\.ugrid(\.gz)?$", re.IGNORECASE)


class Counts(NamedTuple):
    """What a header promises."""

    points: int
    triangles: int
    quads: int
    tetrahedra: int
    pyramids: int
    prisms: int
    hexahedra: int

    @property
    def faces(self) -> int:
        """Boundary faces."""
        return self.triangles + self.quads

    @property
    def cells(self) -> int:
        """Solid cells."""
        return sum(self[3:])

    @property
    def body(self) -> list[Part]:
        """The arrays that follow the header."""
        lengths = [n * NODES_PER_CELL[k] for k, n in zip(FACES + SOLIDS, self[1:], strict=True)]
        integers = [*lengths[:2], self.faces, *lengths[2:]]
        return [Part("f", 3 * self.points), *(Part("i", length) for length in integers)]

    @property
    def endings(self) -> list[list[Part]]:
        """What may follow the cells: the number of thin ones, a number for each, two per face."""
        parts = [Part("i", n) for n in (1, self.cells, self.faces, self.faces)]
        return [parts[:k] for k in (0, 1, 2, 4)]

    def __str__(self) -> str:
        return f"{self.points} points, {self.faces} faces and {self.cells} cells"


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether the file begins as a mesh with solid cells does."""
    if text.is_text(head):
        header, point = text.first_lines(head, 2)
        are_counts = len(header) == 7 and all(re.fullmatch(rb"\d{1,10}", word) for word in header)
        is_point = len(point) == 3 and all(map(text.is_number, point))
        return are_counts and is_point and Counts(*map(int, header)).cells > 0
    size = Path(path).stat().st_size
    return any(fit.size == size for fit in _fits(head, path))


def read(path: Path | str) -> VolumeMesh:
    """The mesh in a file, whichever variant it is."""
    data = loaded(path)
    parts = _from_text(bytes(data), path) if text.is_text(data[:4096]) else _from_binary(data, path)
    points = parts[0].reshape(-1, 3)
    if not np.isfinite(points).all():
        row = int(np.argwhere(~np.isfinite(points))[0, 0])
        raise FileError(f"{path}: point {row + 1} is {points[row]}, expected finite numbers")
    nodes = {
        kind: _nodes(part, kind, len(points), path)
        for kind, part in zip(FACES + SOLIDS, [*parts[1:3], *parts[4:8]], strict=True)
    }
    solids = [nodes[kind] for kind in SOLIDS]
    cells = _cells(np.repeat(SOLIDS, [len(rows) for rows in solids]), solids)
    return VolumeMesh(points, cells, _markers(nodes[5], nodes[9], parts[3], path))


def write(path: Path | str, mesh: VolumeMesh) -> None:
    """Write text, or binary data where the name says so."""
    header, *body = _arrays(mesh, path)
    layout = _named(path)
    with replacing(path) as file:
        if layout is None:
            for array in (header, *body):
                file.writelines(text.written(array))
            return
        for record in ([header], body):
            marker = _marker(record, layout, path)
            file.write(marker)
            file.writelines(layout._replace(records=False).joined(record, path))
            file.write(marker)


def _named(path: Path | str) -> Layout | None:
    """How numbers lie in a file of this name; None for text."""
    found = _NAME.search(str(path))
    if not found:
        return None
    return Layout("<" if found[1] else ">", found[2] in "rR", int(found[3]))


def _headers(data: Bytes, path: Path | str) -> Iterator[tuple[Layout, Counts]]:
    """Every way to understand the header as a binary one, that of the name first."""
    named = _named(path)
    for layout in sorted(LAYOUTS, key=lambda layout: layout != named):
        header = layout.integers(data, 7, 7)
        if header and min(header) >= 0 and header[0]:
            yield layout, Counts(*header)


def _fits(data: Bytes, path: Path | str) -> list[Fit]:
    """Every way to understand the whole file; marks of records count as parts."""
    fits = []
    for layout, counts in _headers(data, path):
        mark = [Part("i", 1)] * layout.records
        for ending in counts.endings if counts.cells else []:
            records = [[Part("i", 7)], counts.body, *([part] for part in ending)]
            parts = tuple(part for record in records for part in (*mark, *record, *mark))
            what = f"{counts}{' in records' * layout.records}"
            fits.append(Fit(layout._replace(records=False), parts, what))
    return fits


def _from_binary(data: Bytes, path: Path | str) -> list[np.ndarray]:
    """Points, triangles, quads, their numbers, and the four kinds of cells."""
    fits = _fits(data, path)
    if not any(fit.size == len(data) for fit in fits):
        for layout, counts in _headers(data, path):
            if not counts.cells and layout.size(counts.body) <= len(data):
                raise _flat(counts, path)
    fit = layouts.fitting(fits, len(data), path)
    arrays = fit.layout.split(data, fit.parts, path)
    if len(arrays[0]) == 7:
        return arrays[1:9]
    size = fit.layout.size(fit.parts[4:12])
    for marker in (arrays[3], arrays[12]):
        if marker[0] != size:
            raise FileError(
                f"{path}: a record of {marker[0]} bytes, expected {size}; is the file damaged?"
            )
    return arrays[4:12]


def _from_text(data: bytes, path: Path | str) -> list[np.ndarray]:
    """The same as from binary data, but of floats."""
    values = text.numbers(data, path)
    if len(values) < 7:
        raise FileError(f"{path}: the header needs 7 numbers, the file has {len(values)}")
    names = ("points", *(f"{_WHAT[kind]}s" for kind in FACES + SOLIDS))
    counts = Counts(
        *(
            text.count_of(value, path, name, least=int(name == "points"))
            for value, name in zip(values[:7].tolist(), names, strict=True)
        )
    )
    if not counts.cells:
        raise _flat(counts, path)
    lengths = [part.length for part in counts.body]
    sizes = [7 + sum(lengths) + sum(part.length for part in end) for end in counts.endings]
    if len(values) not in sizes:
        raise FileError(
            f"{path}: {counts} need {sizes[0]} numbers, the file has {len(values)}; was the copy "
            "cut short?"
        )
    return np.split(values, list(accumulate(lengths, initial=7)))[1:-1]


def _flat(counts: Counts, path: Path | str) -> FileError:
    return FileError(
        f"{path}: {counts}: a surface or a two-dimensional mesh, expected solid cells; write it "
        "as STL or SU2 with the program that made it"
    )


def _nodes(part: np.ndarray, kind: int, count: int, path: Path | str) -> np.ndarray:
    """The nodes of all cells of a type, from 0 and in VTK's order."""
    rows = text.indices(
        part.reshape(-1, NODES_PER_CELL[kind]),
        count,
        path,
        lambda row: f"{_WHAT[kind]} {row + 1}",
    )
    return rows[:, TO_VTK[kind]] if kind in TO_VTK else rows


def _cells(types: np.ndarray, nodes: list[np.ndarray]) -> Cells:
    """Cells of several types, one type after the other."""
    sizes = [np.full(len(rows), rows.shape[1]) for rows in nodes]
    starts = np.concatenate([[0], np.cumsum(np.concatenate(sizes))])
    return Cells(types.astype(np.int32), starts, np.concatenate([rows.ravel() for rows in nodes]))


def _markers(
    triangles: np.ndarray, quads: np.ndarray, numbers: np.ndarray, path: Path | str
) -> dict[str, Cells]:
    """The faces of each number, by it."""
    limits = np.iinfo(np.int32)
    bad = (numbers != np.floor(numbers)) | (numbers < limits.min) | (numbers > limits.max)
    if bad.any():
        row = int(np.argmax(bad))
        raise FileError(
            f"{path}: face {row + 1} has the boundary number {numbers[row]:.15g}, expected a whole "
            "number of 4 bytes"
        )
    order = np.argsort(numbers, kind="stable")
    found, begins = np.unique(numbers[order], return_index=True)
    if len(found) > MOST:
        raise FileError(f"{path}: {len(found)} different boundary numbers, expected {MOST} at most")
    markers = {}
    for number, own in zip(found.tolist(), np.split(order, begins)[1:], strict=True):
        split = np.searchsorted(own, len(triangles))
        faces = [triangles[own[:split]], quads[own[split:] - len(triangles)]]
        types = np.repeat(FACES, [len(rows) for rows in faces])
        markers[f"{number:.0f}"] = _cells(types, faces)
    return markers


def _arrays(mesh: VolumeMesh, path: Path | str) -> list[np.ndarray]:
    """Header, points, triangles, quads, their numbers, and the four kinds of cells, as rows."""
    if mesh.dimension != 3:
        raise GeometryError(f"{path}: UGRID holds no two-dimensional meshes; write SU2 instead")
    if not len(mesh.cells.types):
        raise GeometryError(f"{path}: the mesh has no solid cells, and UGRID needs some")
    cells = _by_type(mesh.cells, SOLIDS, "cells", path)
    found = [_by_type(faces, FACES, "faces", path) for faces in mesh.markers.values()]
    numbers = whole_ids(tuple(mesh.markers))
    faces, owners = [], []
    for k, kind in enumerate(FACES):
        rows = [np.empty((0, NODES_PER_CELL[kind]), np.int32), *(parts[k] for parts in found)]
        faces.append(np.concatenate(rows))
        owners.append(np.repeat(numbers, [len(part) for part in rows[1:]]))
    counts = [len(mesh.points), *map(len, faces), *map(len, cells)]
    owner = np.concatenate(owners)[:, None]
    nodes = [rows + 1 for rows in (*faces, *cells)]
    return [np.array([counts]), np.asarray(mesh.points), *nodes[:2], owner, *nodes[2:]]


def _by_type(cells: Cells, kinds: tuple[int, ...], what: str, path: Path | str) -> list[np.ndarray]:
    """The nodes of the cells of each type, in UGRID's order."""
    types, starts, nodes = (np.asarray(array) for array in cells)
    others = np.setdiff1d(types, kinds)
    if len(others):
        names = ", ".join(_WHAT[kind] for kind in kinds)
        raise GeometryError(
            f"{path}: UGRID holds no {what} of VTK's type {others[0]}; it has: {names}"
        )
    found = []
    for kind in kinds:
        begins = starts[:-1][types == kind]
        rows = nodes[begins[:, None] + np.arange(NODES_PER_CELL[kind])]
        found.append(rows[:, FROM_VTK[kind]] if kind in FROM_VTK else rows)
    return found


def _marker(record: list[np.ndarray], layout: Layout, path: Path | str) -> bytes:
    """What stands before and after a record: its size, or nothing in a stream."""
    if not layout.records:
        return b""
    kinds = ["f" if array.dtype.kind == "f" else "i" for array in record]
    parts = [Part(kind, array.size) for kind, array in zip(kinds, record, strict=True)]
    size = layout._replace(records=False).size(parts)
    if size >= 2**31:
        raise GeometryError(
            f"{path}: Fortran's records end at 2 GB, this one needs {size} bytes; write it as "
            ".lb8.ugrid"
        )
    return np.array(size, f"{layout.order}i4").tobytes()
