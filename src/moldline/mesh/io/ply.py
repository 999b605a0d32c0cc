"""PLY: points and polygons with data, as text or binary data.

Polygons become fans of triangles from their first corner, which is right for convex ones, and data
of a polygon go to each of its triangles. Every property of one number per point or face becomes
data of that name; lists other than a face's corners and elements other than `vertex` and `face`
are skipped. Components stand in the whole-number property `component` of the faces, and their
names in lines such as `comment component 0 wing`; other programs' files need neither.

Lost on writing: data of several numbers per point or face, white space in the names of data;
whole numbers of 8 bytes come back in 4 bytes, or as floats where they are too large. Coordinates
and other data keep every bit.
"""

import re
from collections.abc import Container, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._types import Array
from ...errors import FileError, GeometryError
from ..surface import Surface
from . import text
from .files import Bytes, loaded, replacing
from .ply_tables import TYPES, Element, Property, Table, tables
from .polygons import triangles

NAME = "PLY"
SUFFIXES = (".ply",)
HOLDS = Surface

MOST = 2**12
"""Elements and properties in a header, which are far fewer in any mesh."""

ROWS = 2**16
"""Points or faces that are put together for writing at a time."""

NO_FACES = Table(Element("face", 0, {}), {}, {})

_FIRST = re.compile(rb"ply[ \t]*(\r\n|\r|\n)")
_END = re.compile(rb"[\r\n][ \t]*end_header[ \t]*(\r\n|\r|\n|\Z)")
_ORDERS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")
_NAMES = {code: name for name, code in reversed(TYPES.items())}


class Header(NamedTuple):
    """What a file says before its numbers begin."""

    order: str
    """`<` little-endian, `>` big-endian, or nothing if the numbers are text."""
    elements: list[Element]
    components: dict[int, str]
    """Names of components by their number."""
    size: int
    lines: int


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether the first line is PLY's."""
    return _FIRST.match(head) is not None


def read(path: Path | str) -> Surface:
    """The surface in a file, whichever variant it is."""
    data = loaded(path)
    header = _header(data, path)
    body, unit = data[header.size :], 1
    if not header.order:
        body, unit = _as_floats(bytes(body), header.lines, path), 8
    found = tables(body, header.elements, unit, path)
    if "vertex" not in found:
        raise FileError(f"{path}: the header has no 'element vertex', so there are no points")
    if "face" not in found and "tristrips" in found:
        raise FileError(f"{path}: has triangle strips, expected faces; triangulate it first")
    points, point_data = _points(found["vertex"], path)
    faces, face_data = _faces(found.get("face", NO_FACES), points, path)
    tags, components = _components(face_data, header.components)
    return Surface(points, faces, tags, components, point_data, face_data)


def write(path: Path | str, surface: Surface, binary: bool = True) -> None:
    """Write little-endian binary data, or text."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    corners = [np.full(len(faces), 3, np.uint8), *faces.T]
    vertices = {axis: points[:, k] for k, axis in enumerate("xyz")}
    scalars: dict[str, Array] = {}
    components = () if surface.components == ("1",) else surface.components
    if components:
        scalars["component"] = surface.tags
    vertices |= _scalars(surface.point_data, "point", vertices, path)
    scalars |= _scalars(surface.face_data, "face", {*_CORNERS, "component"}, path)
    kind = "binary_little_endian" if binary else "ascii"
    lines = ["ply", f"format {kind} 1.0", "comment written by moldline"]
    lines += [
        f"comment component {k} {' '.join(name.split())}" for k, name in enumerate(components)
    ]
    lines += [f"element vertex {len(points)}", *_properties(vertices), f"element face {len(faces)}"]
    lines += ["property list uchar int vertex_indices", *_properties(scalars), "end_header", ""]
    with replacing(path) as file:
        file.write("\n".join(lines).encode())
        for columns in ([*vertices.values()], [*corners, *scalars.values()]):
            for part in _rows(columns):
                file.write(part.tobytes() if binary else _as_text(part))


def _header(data: Bytes, path: Path | str) -> Header:
    first, end = _FIRST.match(data), _END.search(data)
    if not first:
        raise FileError(
            f"{path}: found {text.quoted(bytes(data[:20]))}, expected 'ply' on the first line"
        )
    if not end:
        raise FileError(f"{path}: the header has no 'end_header'; was the copy cut short?")
    lines = text.unix(bytes(data[: end.start()])).split(b"\n")
    encodings = [line.split() for line in lines if line.lstrip().startswith(b"format")]
    if len(encodings) != 1 or len(encodings[0]) != 3 or encodings[0][1] not in _ORDERS:
        raise FileError(
            f"{path}: the header needs one line such as 'format ascii 1.0', with ascii, "
            "binary_little_endian or binary_big_endian"
        )
    order = _ORDERS[encodings[0][1]]
    elements: list[Element] = []
    components: dict[int, str] = {}
    for number, line in enumerate(lines, 1):
        words = line.split()
        if words[:2] == [b"comment", b"component"] and re.fullmatch(
            rb"\d{1,9}", b"".join(words[2:3])
        ):
            components[int(words[2])] = text.decoded(b" ".join(words[3:]))
        elif words and words[0] not in (b"ply", b"format", b"comment", b"obj_info"):
            _declare(words, elements, order, f"{path}: line {number}")
    # after a lone CR, data may begin with the LF that would else belong to the line's end
    size = end.start(1) + 1 if first[1] == b"\r" and end[1] else end.end()
    return Header(order, elements, components, size, len(lines) + 2)


def _as_floats(body: bytes, line: int, path: Path | str) -> memoryview:
    """The bytes of the numbers of a text that begins at a line."""
    return text.numbers(body, path, line, finite=False).view(np.uint8).data


def _declare(words: list[bytes], elements: list[Element], order: str, place: str) -> None:
    """Add the element or the property that a line of the header tells of."""
    match words:
        case [b"element", name, count] if re.fullmatch(rb"\d{1,10}", count):
            if any(element.name == text.decoded(name) for element in elements):
                raise FileError(f"{place}: a second element {text.quoted(name)}")
            elements.append(Element(text.decoded(name), int(count), {}))
        case [b"property", *types, name] if elements and _are_types(types):
            length = types[1].decode() if len(types) == 3 else None
            new = Property.of(types[-1].decode(), length, order)
            if text.decoded(name) in elements[-1].properties:
                raise FileError(f"{place}: a second property {text.quoted(name)}")
            elements[-1].properties[text.decoded(name)] = new
        case _:
            raise FileError(
                f"{place}: found {text.quoted(b' '.join(words))}, expected such as 'element face "
                "12', 'property double x' or 'property list uchar int vertex_indices'"
            )
    if len(elements) + sum(len(element.properties) for element in elements[-1:]) > MOST:
        raise FileError(f"{place}: more than {MOST} elements or properties, which no mesh has")


def _are_types(words: list[bytes]) -> bool:
    """Whether words name a type, or those of a list: its length, a whole number, and its items."""
    codes = [TYPES.get(text.decoded(word), "") for word in words[-2:]]
    is_list = len(words) == 3 and words[0] == b"list" and codes[0][:1] in ("i", "u")
    return all(codes) and (len(words) == 1 or is_list)


def _points(table: Table, path: Path | str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Coordinates, and data."""
    missing = [axis for axis in "xyz" if axis not in table.scalars]
    if missing:
        raise FileError(f"{path}: points have no property {missing[0]!r}, expected x, y and z")
    points = np.empty((table.element.rows, 3))
    with np.errstate(invalid="ignore"):  # NaN of any kind is refused below
        for k, axis in enumerate("xyz"):
            points[:, k] = table.scalars[axis]
    if not np.isfinite(points).all():
        row = int(np.argwhere(~np.isfinite(points))[0, 0])
        raise FileError(f"{path}: vertex {row} is {points[row]}, expected finite numbers")
    return points, {name: table.column(name, path) for name in table.scalars if name not in "xyz"}


def _faces(
    table: Table, points: np.ndarray, path: Path | str
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Triangles, and data."""
    names = [name for name in _CORNERS if name in table.lists]
    if not names:
        if table.element.rows:
            raise FileError(f"{path}: faces have no list 'vertex_indices', so they have no corners")
        return np.empty((0, 3), np.int32), {}
    sizes, corners = table.lists[names[0]]
    if len(sizes) and sizes.min() < 3:
        row = int(np.argmin(sizes))
        raise FileError(f"{path}: face {row} has {sizes[row]} corners, expected 3 or more")

    def place(corner: int) -> str:
        return f"face {np.searchsorted(np.cumsum(sizes), corner, side='right')}"

    numbers = text.indices(corners, len(points), path, place, base=0)
    faces, owner = triangles(points, numbers, sizes)
    return faces, {name: table.column(name, path)[owner] for name in table.scalars}


def _components(
    face_data: dict[str, np.ndarray], names: dict[int, str]
) -> tuple[np.ndarray | None, tuple[str, ...] | None]:
    """Tags and names, taken out of the data of faces."""
    if "component" not in face_data or face_data["component"].dtype.kind == "f":
        return None, None
    numbers = face_data.pop("component").astype(np.int64)
    known = np.union1d(numbers, np.array([*names], np.int64))
    return np.searchsorted(known, numbers), tuple(names.get(n, str(n)) for n in known.tolist())


def _scalars(
    data: Mapping[str, Array], what: str, taken: Container[str], path: Path | str
) -> dict[str, np.ndarray]:
    """Data of one number per point or face, in types and by names that the file can have."""
    found: dict[str, np.ndarray] = {}
    for given, values in data.items():
        column, name = np.asarray(values), "_".join(given.split()) or "_"
        if column.ndim != 1 or column.dtype.kind not in "biuf":
            continue
        if name in taken or name in found:
            raise GeometryError(
                f"{path}: {what} data {given!r} would be written as {name!r}, which there is "
                "already; rename it"
            )
        found[name] = _fitted(column)
    return found


def _fitted(column: np.ndarray) -> np.ndarray:
    """Numbers in a type that the format knows."""
    if column.dtype.kind == "b":
        return column.astype(np.uint8)
    if column.dtype.str[1:] in _NAMES:
        return column
    if column.dtype.kind == "f":
        return column.astype(np.float32 if column.dtype.itemsize < 4 else np.float64)
    limits = np.iinfo(np.int32)
    fits = not len(column) or (column.min() >= limits.min and column.max() <= limits.max)
    return column.astype(np.int32 if fits else np.float64)


def _properties(columns: Mapping[str, Array]) -> list[str]:
    """The lines that declare columns."""
    return [f"property {_NAMES[array.dtype.str[1:]]} {name}" for name, array in columns.items()]


def _rows(columns: Sequence[Array]) -> Iterator[np.ndarray]:
    """Columns side by side, some rows at a time."""
    packed = np.dtype(
        [(f"{k}", column.dtype.newbyteorder("<")) for k, column in enumerate(columns)]
    )
    for start in range(0, len(columns[0]), ROWS):
        rows = np.empty(len(columns[0][start : start + ROWS]), packed)
        for k, column in enumerate(columns):
            rows[f"{k}"] = column[start : start + ROWS]
        yield rows


def _as_text(rows: np.ndarray) -> bytes:
    """Lines of text, one per row; floating-point numbers read back to the same bits."""
    kinds = [rows.dtype[name].kind for name in rows.dtype.names or ()]
    line = " ".join("%r" if kind == "f" else "%d" for kind in kinds) + "\n"
    return "".join(line % values for values in rows.tolist()).encode()
