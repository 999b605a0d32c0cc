"""SU2 meshes in two and three dimensions.

The file holds points, cells of mixed types in their order, and named markers of boundary cells.
Numbers that only repeat a row's place are not kept; comments in these sections are not either.
Every other section (control boxes, periodic pairs ...) is kept word for word in `extra` and stands
behind the mesh when written.

Lost on writing: z of a two-dimensional mesh; `%` in a marker's name becomes `_`. Coordinates keep
every bit.
"""

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FileError
from ..volume import NODES_PER_CELL, Cells, VolumeMesh
from . import text
from .files import contents, replacing

NAME = "SU2"
SUFFIXES = (".su2",)
HOLDS = VolumeMesh

MOST = 2**14
"""Keywords in a file; each marker has two."""

_KEYWORD = re.compile(rb"^[ \t]*([A-Za-z]\w*)[ \t]*=[ \t]*([^\n]*)$", re.MULTILINE)
_COMMENT = re.compile(rb"%[^\n]*")
_SINGLE = {"NDIME", "NELEM", "NPOIN", "NMARK"}
_REPEATED = {"MARKER_TAG", "MARKER_ELEMS"}


class Section(NamedTuple):
    """A keyword, its value and the rows below it."""

    keyword: str
    value: bytes
    body: bytes
    line: int
    """Where the keyword stands."""
    verbatim: bytes


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether one of the keywords that every mesh has is among the first lines."""
    found = {match[1].decode().upper() for match in _KEYWORD.finditer(text.unix(head))}
    return text.is_text(head) and bool(found & (_SINGLE | {"NZONE"}))


def read(path: Path | str) -> VolumeMesh:
    """The mesh in a file."""
    found = list(sections(text.unix(contents(path)), path))
    mesh = _by_keyword(found, path)
    dimension = whole(mesh["NDIME"], path)
    if dimension not in (2, 3):
        raise FileError(f"{path}: line {mesh['NDIME'].line}: NDIME= {dimension}, expected 2 or 3")
    points = _points(mesh["NPOIN"], dimension, path)
    cells = _cells(mesh["NELEM"], len(points), path)
    markers = _markers(found, mesh.get("NMARK"), len(points), path)
    known = _SINGLE | _REPEATED
    extra = b"".join(section.verbatim for section in found if section.keyword not in known)
    return VolumeMesh(points, cells, markers, dimension, extra.decode("latin-1"))


def write(path: Path | str, mesh: VolumeMesh) -> None:
    """Write cells, points and markers, then whatever else the mesh carries along."""
    points = np.asarray(mesh.points)[:, : mesh.dimension]
    with replacing(path) as file:
        file.write(b"NDIME= %d\nNELEM= %d\n" % (mesh.dimension, len(mesh.cells.types)))
        file.writelines(_rows(mesh.cells, numbered=True))
        file.write(b"NPOIN= %d\n" % len(points))
        row = " ".join(["%r"] * mesh.dimension) + " %d\n"
        for number, point in enumerate(points.tolist()):
            file.write((row % (*point, number)).encode())
        file.write(b"NMARK= %d\n" % len(mesh.markers))
        for name, cells in mesh.markers.items():
            title = text.title(name).replace(b"%", b"_")  # which begins a comment
            file.write(b"MARKER_TAG= " + title + b"\n")
            file.write(b"MARKER_ELEMS= %d\n" % len(cells.types))
            file.writelines(_rows(cells, numbered=False))
        file.write(mesh.extra.encode("latin-1"))


def sections(data: bytes, path: Path | str) -> Iterator[Section]:
    found = list(islice(_KEYWORD.finditer(data), MOST + 1))
    if len(found) > MOST:
        raise FileError(f"{path}: more than {MOST} keywords, which no mesh has; is it SU2?")
    before = _COMMENT.sub(b"", data[: found[0].start()] if found else data).split()
    if before or not found:
        word = text.quoted(before[0] if before else "nothing")
        raise FileError(f"{path}: found {word}, expected a keyword such as 'NDIME=' first")
    line, at = 1, 0
    for match, following in zip(found, [*found[1:], None], strict=True):
        end = following.start() if following else len(data)
        line += data.count(b"\n", at, match.start(1))
        at = match.start(1)
        value = _COMMENT.sub(b"", match[2]).strip()
        body = _COMMENT.sub(b"", data[match.end() : end])
        verbatim = data[match.start() : end]
        yield Section(match[1].decode().upper(), value, body, line, verbatim)


def _by_keyword(sections: list[Section], path: Path | str) -> dict[str, Section]:
    """The sections that occur once."""
    found: dict[str, Section] = {}
    for section in sections:
        if section.keyword == "NZONE" and section.value != b"1":
            raise FileError(
                f"{path}: line {section.line}: the mesh has several zones; split it into one "
                "file for each"
            )
        if section.keyword in _SINGLE and found.setdefault(section.keyword, section) != section:
            raise FileError(f"{path}: line {section.line}: a second {section.keyword}= section")
    missing = sorted({"NDIME", "NELEM", "NPOIN"} - found.keys())
    if missing:
        raise FileError(f"{path}: {missing[0]}= is missing; was the copy cut short?")
    return found


def whole(section: Section, path: Path | str) -> int:
    """The whole number behind a keyword; others may follow it."""
    words = section.value.split()
    if not words or not words[0].isdigit() or len(words[0]) > 10:
        found = text.quoted(f"{section.keyword}= {text.decoded(section.value)}")
        raise FileError(f"{path}: line {section.line}: found {found}, expected a whole number")
    return int(words[0])


def table(section: Section, path: Path | str) -> text.Rows:
    """As many rows as the keyword promises."""
    count = whole(section, path)
    rows = text.rows(section.body, path, section.line)
    if len(rows.lines) != count:
        raise FileError(
            f"{path}: line {section.line}: {section.keyword}= {count}, but {len(rows.lines)} rows "
            "follow; was the copy cut short?"
        )
    return rows


def _points(section: Section, dimension: int, path: Path | str) -> np.ndarray:
    rows = table(section, path)
    width = np.diff(rows.starts)
    bad = np.flatnonzero((width < dimension) | (width > dimension + 2))
    if len(bad):
        raise FileError(
            f"{path}: line {rows.lines[bad[0]]}: a point of {width[bad[0]]} numbers, expected "
            f"{dimension}, and its own number at most"
        )
    points = np.zeros((len(width), 3))
    points[:, :dimension] = rows.values[rows.starts[:-1, None] + np.arange(dimension)]
    return points


def _cells(section: Section, count: int, path: Path | str) -> Cells:
    rows = table(section, path)
    width = np.diff(rows.starts)
    types = rows.values[rows.starts[:-1]]
    sizes = np.zeros(len(types), np.int64)
    for kind, size in NODES_PER_CELL.items():
        sizes[types == kind] = size
    bad = np.flatnonzero((sizes == 0) | (width < 1 + sizes) | (width > 2 + sizes))
    if len(bad):
        row = bad[0]
        needs = f"{sizes[row]} nodes" if sizes[row] else f"a type of {sorted(NODES_PER_CELL)}"
        raise FileError(
            f"{path}: line {rows.lines[row]}: a cell of type {types[row]:g} and {width[row] - 1} "
            f"numbers, expected {needs}"
        )
    starts = np.concatenate([[0], np.cumsum(sizes)])
    owner = np.repeat(np.arange(len(sizes)), sizes)
    nodes = rows.values[rows.starts[owner] + 1 + np.arange(starts[-1]) - starts[owner]]
    index = text.indices(nodes, count, path, lambda k: f"line {rows.lines[owner[k]]}", base=0)
    return Cells(types.astype(np.int32), starts, index)


def _markers(
    sections: list[Section], promised: Section | None, count: int, path: Path | str
) -> dict[str, Cells]:
    markers: dict[str, Cells] = {}
    name = None
    for section in sections:
        if section.keyword == "MARKER_TAG":
            name = text.decoded(section.value)
            if name in markers:
                raise FileError(f"{path}: line {section.line}: a second marker {text.quoted(name)}")
        elif section.keyword == "MARKER_ELEMS":
            if name is None:
                raise FileError(f"{path}: line {section.line}: MARKER_ELEMS= without MARKER_TAG=")
            markers[name] = _cells(section, count, path)
            name = None
    if promised and whole(promised, path) != len(markers):
        raise FileError(
            f"{path}: line {promised.line}: NMARK= {whole(promised, path)}, but {len(markers)} "
            "markers follow; was the copy cut short?"
        )
    return markers


def _rows(cells: Cells, numbered: bool) -> Iterator[bytes]:
    starts, nodes = np.asarray(cells.starts).tolist(), np.asarray(cells.nodes).tolist()
    for number, kind in enumerate(np.asarray(cells.types).tolist()):
        words = [kind, *nodes[starts[number] : starts[number + 1]]]
        if numbered:
            words.append(number)
        yield (" ".join(map(str, words)) + "\n").encode()
