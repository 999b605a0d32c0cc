"""Wavefront OBJ: points, polygons and groups as text.

Groups (`g`), or objects (`o`) where there are no groups, become components. A polygon becomes a
fan of triangles from its first corner, which is right for convex ones. Texture coordinates,
normals, materials, lines and curves are ignored, and so are colours and weights of points.

Lost on writing: data on points and faces, components without triangles. Coordinates keep every
bit; faces keep their order only within a component.
"""

import re
from array import array
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FileError
from ..surface import Surface
from . import text
from .files import contents, replacing
from .polygons import triangles

NAME = "OBJ"
SUFFIXES = (".obj",)
HOLDS = Surface

_NUMBER = re.compile(rb"([+-]?\d{1,15})(?:/|$)")
_KEYWORDS = {b"v", b"vn", b"vt", b"f", b"g", b"o", b"s", b"mtllib", b"usemtl", b"l", b"p"}
_IGNORED = set(
    b"vt vn vp g o s mg l p mtllib usemtl maplib usemap cstype deg bmat step curv curv2 surf parm "
    b"trim hole scrv sp end con bevel c_interp d_interp lod shadow_obj trace_obj ctech stech call "
    b"csh".split()
)


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether the first words of the first lines are OBJ's and one of them is a point."""
    lines = [line for line in head.splitlines()[:-1] if line.strip() and line[:1] != b"#"]
    words = {line.split()[0] for line in lines[:200]}
    return text.is_text(head) and b"v" in words and words <= _KEYWORDS


class _Faces(NamedTuple):
    """Polygons without an object for each: a big file has millions."""

    corners: array
    sizes: array
    tags: array
    lines: array

    def add(self, words: bytes, before: int, line: int, tag: int, path: Path | str) -> None:
        """One more, after so many points; numbers may count back from the last of them."""
        found = [_NUMBER.match(word) for word in words.split()]
        if len(found) < 3 or None in found:
            raise FileError(
                f"{path}: line {line}: found the face {text.quoted(words)}, expected three or more "
                "numbers of points such as 1 2 3 or 1/1/1 2/2/2 3/3/3"
            )
        numbers = [int(match[1]) for match in found if match]
        self.corners.extend(k - 1 if k > 0 else before + k if k < 0 else -1 for k in numbers)
        self.sizes.append(len(found))
        self.tags.append(tag)
        self.lines.append(line)


def read(path: Path | str) -> Surface:
    """The surface in a file."""
    data = text.unix(contents(path)).replace(b"\\\n", b"  ")
    points, count = bytearray(), 0  # an entry per line, so that messages can tell the line
    faces = _Faces(array("q"), array("q"), array("q"), array("q"))
    names: dict[bytes, int] = {}
    name, is_grouped = b"1", False
    for number, line in enumerate(BytesIO(data), 1):
        key, *rest = line.split(None, 1) or [b""]
        words = rest[0].strip() if rest else b""
        if key == b"v":
            points += words or b"nothing"
            count += 1
        elif key == b"f":
            faces.add(words, count, number, names.setdefault(name, len(names)), path)
        elif key == b"g" or (key == b"o" and not is_grouped):
            is_grouped = key == b"g"
            name = words or b"default"
        elif key not in _IGNORED and key[:1] not in (b"#", b""):
            raise FileError(
                f"{path}: line {number}: found {text.quoted(key)}, which is no keyword of OBJ; "
                "remove the line if it does not matter"
            )
        points += b"\n"
    return _surface(_coordinates(bytes(points), path), faces, names, path)


def write(path: Path | str, surface: Surface) -> None:
    """Write points, then the triangles of each component."""
    with replacing(path) as file:
        for lines in text.written(surface.points):
            file.write(b"v " + lines[:-1].replace(b"\n", b"\nv ") + b"\n")
        for number, name in enumerate(surface.components):
            title = text.title(name).replace(b"\\", b"/")  # at the end it would join two lines
            file.write(b"g " + title + b"\n")
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
    points: np.ndarray, faces: _Faces, names: dict[bytes, int], path: Path | str
) -> Surface:
    corners, sizes, tags, lines = (np.array(part, np.int64) for part in faces)
    bad = np.flatnonzero((corners < 0) | (corners >= len(points)))
    if len(bad):
        line = lines[np.searchsorted(np.cumsum(sizes), bad[0], side="right")]
        raise FileError(
            f"{path}: line {line}: the face needs numbers of points from 1 to {len(points)}, or "
            "back from -1 to the first point"
        )
    found, owner = triangles(points, corners, sizes)
    components = tuple(map(text.decoded, names))
    return Surface(points, found, tags[owner], components or ("1",))
