"""Wavefront OBJ: points, polygons and groups as text.

Groups (`g`), or objects (`o`) where there are no groups, become components. A polygon becomes a
fan of triangles from its first corner, which is right for convex ones. Texture coordinates,
normals, materials, lines and curves are ignored, and so are colours and weights of points.

Lost on writing: data on points and faces, components without triangles. Coordinates keep every
bit; faces keep their order only within a component.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np

from ...errors import FileError
from ..surface import Surface
from . import text
from .files import contents, replacing

NAME = "OBJ"
SUFFIXES = (".obj",)
HOLDS = Surface

_KEYWORDS = {b"v", b"vn", b"vt", b"f", b"g", b"o", b"s", b"mtllib", b"usemtl", b"l", b"p"}


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether the first words of the first lines are OBJ's and one of them is a point."""
    lines = [line for line in head.splitlines()[:-1] if line.strip() and line[:1] != b"#"]
    words = {line.split()[0] for line in lines[:200]}
    return text.is_text(head) and b"v" in words and words <= _KEYWORDS


def read(path: Path | str) -> Surface:
    """The surface in a file."""
    data = text.unix(contents(path)).replace(b"\\\n", b"  ")
    points: list[bytes] = []  # an entry per line, so that messages can tell the line
    faces: list[tuple[int, bytes, int, bytes]] = []
    name, is_grouped, count = b"1", False, 0
    for number, line in enumerate(data.split(b"\n"), 1):
        key, *rest = line.split(None, 1) or [b""]
        points.append(b"")
        if key == b"v":
            points[-1] = rest[0] if rest else b"nothing"
            count += 1
        elif key == b"f":
            faces.append((number, rest[0] if rest else b"", count, name))
        elif key == b"g" or (key == b"o" and not is_grouped):
            is_grouped = key == b"g"
            name = rest[0].strip() if rest else b"default"
    return _surface(_coordinates(b"\n".join(points), path), faces, path)


def write(path: Path | str, surface: Surface) -> None:
    """Write points, then the triangles of each component."""
    with replacing(path) as file:
        for lines in text.written(surface.points):
            file.write(b"v " + lines[:-1].replace(b"\n", b"\nv ") + b"\n")
        for number, name in enumerate(surface.components):
            file.write(b"g " + " ".join(name.split()).encode() + b"\n")
            for lines in text.written(surface.faces[surface.tags == number] + 1):
                file.write(b"f " + lines[:-1].replace(b"\n", b"\nf ") + b"\n")


def _coordinates(data: bytes, path: Path | str) -> np.ndarray:
    """The first three numbers of each line."""
    if not data.strip():
        raise FileError(f"{path}: no line begins with 'v', so there are no points; is it OBJ?")
    rows = text.rows(data, path)
    width = np.diff(rows.starts)
    if width.min() < 3:
        row = int(np.argmin(width))
        raise FileError(
            f"{path}: line {rows.lines[row]}: 'v' has {width[row]} numbers, expected at least 3"
        )
    return rows.values[rows.starts[:-1, None] + np.arange(3)]


def _surface(
    points: np.ndarray, faces: list[tuple[int, bytes, int, bytes]], path: Path | str
) -> Surface:
    triangles: list[tuple[int, int, int]] = []
    tags: list[int] = []
    names: dict[str, int] = {}
    for number, words, before, name in faces:
        corners = _corners(number, words, before, len(points), path)
        tag = names.setdefault(text.decoded(name), len(names))
        for b, c in pairwise(corners[1:]):
            triangles.append((corners[0], b, c))
            tags.append(tag)
    index = np.array(triangles, np.int32).reshape(-1, 3)
    return Surface(points, index, np.array(tags, np.int32), tuple(names) or ("1",))


def _corners(number: int, words: bytes, before: int, count: int, path: Path | str) -> list[int]:
    """A face's points from 0; numbers may be followed by others, or count back from the last."""
    try:
        found = [int(word.partition(b"/")[0]) for word in words.split()]
    except ValueError:
        raise FileError(
            f"{path}: line {number}: found the face {text.decoded(words)!r}, "
            "expected numbers of points such as 1 2 3 or 1/1/1 2/2/2 3/3/3"
        ) from None
    corners = [k - 1 if k > 0 else before + k for k in found]
    if len(corners) < 3 or min(corners) < 0 or max(corners) >= count or 0 in found:
        raise FileError(
            f"{path}: line {number}: the face {text.decoded(words)!r} needs three or more "
            f"numbers of points, from 1 to {count} or from -1 to {-before}"
        )
    return corners
