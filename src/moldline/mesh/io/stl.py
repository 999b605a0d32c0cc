"""STL: a soup of triangles, as text or binary data.

The file holds three corners per triangle and nothing that joins them, so reading welds corners
that are equal (`tolerance=0.0`), or that lie within a tolerance of each other; `3 * faces - points`
corners were merged. Text has named solids, which become components; binary data has none.

Lost on writing: points without faces, data on points and faces, components without triangles;
points in one place become one. Text keeps every bit of a coordinate; binary data rounds to 4-byte
floats and loses the components. Normals are written from the corners and ignored on reading.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...errors import FileError
from ..surface import Surface
from ..topology import weld
from . import text
from .binary import narrowed
from .files import contents, replacing
from .mapped import Run

NAME = "STL"
SUFFIXES = (".stl",)
HOLDS = Surface

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

_SOLID = re.compile(rb"\s*solid\b[ \t]*([^\r\n]*)", re.IGNORECASE)
_FACET = re.compile(
    rb"\s*facet(?:\s+normal\s+\S+\s+\S+\s+\S+)?\s+outer\s+loop"
    rb"\s+vertex\s+(\S+\s+\S+\s+\S+)\s+vertex\s+(\S+\s+\S+\s+\S+)\s+vertex\s+(\S+\s+\S+\s+\S+)"
    rb"\s+endloop\s+endfacet",
    re.IGNORECASE,
)
_END = re.compile(rb"\s*endsolid\b[^\r\n]*", re.IGNORECASE)


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether it is text that begins with a solid, or binary data of the right size."""
    if _is_text(head):
        return True
    return len(head) >= 84 and Path(path).stat().st_size == _size(head)


def read(path: Path | str, tolerance: float = 0.0) -> Surface:
    """The welded surface in a file."""
    data = contents(path)
    components: tuple[str, ...] = ("1",)
    if len(data) != _size(data) and _is_text(data[:4096]):
        corners, tags, components = _read_text(data, path)
    else:
        corners = _read_binary(data, path)
        tags = np.zeros(len(corners) // 3, np.int32)
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=1))
    if len(bad):
        raise FileError(
            f"{path}: triangle {bad[0] // 3 + 1} has the corner {corners[bad[0]]}, "
            "expected finite numbers"
        )
    kept, index = weld(corners, tolerance)
    return Surface(corners[kept], index.reshape(-1, 3), tags, components)


def write(path: Path | str, surface: Surface, binary: bool = False) -> None:
    """Write text with a solid per component, or binary data."""
    corners = np.asarray(surface.points)[surface.faces]
    normals = facing(corners)
    with replacing(path) as file:
        if binary:
            records = np.zeros(len(corners), _RECORD)
            records["normal"], records["corners"] = (
                normals,
                narrowed(corners, np.dtype("<f4"), path),
            )
            file.write(b"moldline".ljust(80) + len(corners).to_bytes(4, "little"))
            file.write(records.view(np.uint8).data)
            return
        for number, name in enumerate(surface.components):
            own = surface.tags == number
            title = text.title(name)
            file.write(b"solid " + title + b"\n")
            for lines in _facets(normals[own], corners[own]):
                file.write(lines)
            file.write(b"endsolid " + title + b"\n")


def facing(corners: np.ndarray) -> np.ndarray:
    """Unit normals; zero where a triangle has none that can be computed."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
    sound = (length > 0) & np.isfinite(length)
    return np.divide(normals, length, out=np.zeros_like(normals), where=sound)


def runs(data: np.ndarray, path: Path | str) -> list[Run]:
    """Where the corners and normals lie in the bytes of a binary file."""
    head = data[:84].tobytes()
    if len(head) < 84 or len(data) != _size(head):
        raise FileError(f"{path}: only binary STL can be streamed; convert it")
    records = data[84:].view(_RECORD)
    return [Run(records["corners"], records["normal"])]


def _is_text(head: bytes) -> bool:
    return text.is_text(head) and _SOLID.match(head) is not None


def _size(head: bytes) -> int:
    """The size that a binary file's header promises."""
    return 84 + _RECORD.itemsize * int.from_bytes(head[80:84], "little")


def _read_binary(data: bytes, path: Path | str) -> np.ndarray:
    if len(data) < 84:
        raise FileError(
            f"{path}: neither a text that begins with 'solid' nor the 84 bytes of a binary header"
        )
    if len(data) != _size(data):
        count = int.from_bytes(data[80:84], "little")
        raise FileError(
            f"{path}: {count} triangles need {_size(data)} bytes, the file has {len(data)}; "
            "was the copy cut short?"
        )
    records = np.frombuffer(data, _RECORD, offset=84)
    with np.errstate(invalid="ignore"):  # NaN of any kind is refused later
        return records["corners"].reshape(-1, 3).astype(np.float64)


def _read_text(data: bytes, path: Path | str) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    names: dict[str, int] = {}
    corners, tags, at = [np.empty((0, 3))], [np.empty(0, np.int32)], 0
    while start := _SOLID.match(data, at):
        name = text.decoded(start[1].strip()) or str(len(names) + 1)
        found, at = _read_solid(data, start.end(), path)
        corners.append(found)
        tags.append(np.full(len(found) // 3, names.setdefault(name, len(names)), np.int32))
    if data[at:].strip():
        raise _unexpected(data, at, "solid", path)
    return np.concatenate(corners), np.concatenate(tags), tuple(names)


def _read_solid(data: bytes, begin: int, path: Path | str) -> tuple[np.ndarray, int]:
    scanner = _FACET.scanner(data, begin)  # type: ignore[attr-defined]  # unknown to typeshed
    found, at = [], begin
    while facet := scanner.match():
        found.append(b" ".join(facet.groups()))
        at = facet.end()
    end = _END.match(data, at)
    if not end:
        raise _unexpected(data, at, "facet or endsolid", path)
    line = text.line_at(data, begin)
    numbers = text.numbers(b"\n".join(found), path, line)
    if len(numbers) != 9 * len(found):
        raise FileError(f"{path}: the solid at line {line} holds repeat counts, expected numbers")
    return numbers.reshape(-1, 3), end.end()


def _unexpected(data: bytes, at: int, expected: str, path: Path | str) -> FileError:
    at += len(data[at:]) - len(data[at:].lstrip())
    found = " ".join(text.decoded(data[at : at + 60]).split()) or "the end of the file"
    return FileError(
        f"{path}: line {text.line_at(data, at)}: found {found!r}, expected a whole {expected}; "
        "was the copy cut short?"
    )


def _facets(normals: np.ndarray, corners: np.ndarray) -> Iterator[bytes]:
    facet = (
        "facet normal %.9g %.9g %.9g\nouter loop\n"
        + "vertex %r %r %r\n" * 3
        + "endloop\nendfacet\n"
    )
    numbers = np.concatenate([normals, corners.reshape(-1, 9)], axis=1)
    for start in range(0, len(numbers), 4096):
        part = numbers[start : start + 4096]
        yield (facet * len(part) % tuple(part.ravel().tolist())).encode()
