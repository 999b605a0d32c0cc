"""VTP: triangulations with data, in VTK's XML.

Polygons become fans of triangles from their first corner, which is right for convex ones, and data
of a polygon go to each of its triangles. Points without faces and lines are skipped, strips
refused. Components stand in the cell array `component` (from 0) and their names in the string
array `component_names` of the field data; other programs' files need neither.

Lost on writing: nothing, but arrays of more than two axes come back with the later ones run
together. Coordinates and data keep every bit.
"""

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from ..._types import Array
from ...errors import FileError
from ..surface import Surface
from . import text
from .files import contents, replacing
from .vtkxml import Document, data_array, opening

NAME = "VTP"
SUFFIXES = (".vtp",)
HOLDS = Surface


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether it is a VTK file of poly data."""
    return b"<VTKFile" in head and b"PolyData" in head


def read(path: Path | str) -> Surface:
    """The surface in a file."""
    document = Document(contents(path), path)
    mesh = document.root.find("PolyData")
    if mesh is None:
        raise FileError(
            f"{path}: holds {document.root.get('type')!r}, expected 'PolyData'; "
            "extract its surface first"
        )
    pieces = [_piece(document, piece) for piece in mesh.findall("Piece")]
    if not pieces:
        raise FileError(f"{path}: PolyData has no Piece, so there is nothing to read")
    before = np.cumsum([0] + [len(piece.points) for piece in pieces])
    face_data = _merged([piece.face_data for piece in pieces])
    tags, components = _components(face_data.pop("component", None), _names(document, mesh), path)
    return Surface(
        np.concatenate([piece.points for piece in pieces]),
        np.concatenate([p.faces + start for p, start in zip(pieces, before[:-1], strict=True)]),
        tags,
        components,
        _merged([piece.point_data for piece in pieces]),
        face_data,
    )


def write(path: Path | str, surface: Surface) -> None:
    """Write one piece, in base64."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    with replacing(path) as file:
        file.write(opening("PolyData"))
        file.write(b"<FieldData>\n" + _name_array(surface.components) + b"</FieldData>\n")
        file.write(
            b'<Piece NumberOfPoints="%d" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" '
            b'NumberOfPolys="%d">\n' % (len(points), len(faces))
        )
        file.write(b"<PointData>\n")
        file.writelines(data_array(name, data) for name, data in surface.point_data.items())
        file.write(b"</PointData>\n<CellData>\n")
        file.writelines(data_array(name, data) for name, data in surface.face_data.items())
        file.write(data_array("component", surface.tags))
        file.write(b"</CellData>\n<Points>\n" + data_array("Points", points) + b"</Points>\n")
        file.write(b"<Polys>\n" + data_array("connectivity", faces.ravel()))
        file.write(data_array("offsets", 3 * np.arange(1, len(faces) + 1)) + b"</Polys>\n")
        file.write(b"</Piece>\n</PolyData>\n</VTKFile>\n")


def _piece(document: Document, piece: Element) -> Surface:
    place = document.place(piece)
    count = document.count(piece, "NumberOfPoints")
    if document.count(piece, "NumberOfStrips"):
        raise FileError(f"{place} has triangle strips, expected polygons; triangulate it first")
    holder = piece.find("Points/DataArray")
    points = np.empty((0, 3)) if holder is None else document.array(holder, count)
    if points.shape != (count, 3) or not np.isfinite(points).all():
        raise FileError(f"{place} needs {count} points of three finite coordinates")
    triangles, owner = _triangles(document, piece, count)
    skipped = document.count(piece, "NumberOfVerts") + document.count(piece, "NumberOfLines")
    cells = skipped + document.count(piece, "NumberOfPolys")
    face_data = document.arrays(piece.find("CellData"), cells)
    return Surface(
        points.astype(np.float64),
        triangles,
        point_data=document.arrays(piece.find("PointData"), count),
        face_data={name: data[skipped:][owner] for name, data in face_data.items()},
    )


def _triangles(document: Document, piece: Element, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of all polygons, and the polygon each comes from."""
    count = document.count(piece, "NumberOfPolys")
    polygons = piece.find("Polys")
    found = {} if polygons is None else {e.get("Name"): e for e in polygons.findall("DataArray")}
    if not count:
        return np.empty((0, 3), np.int32), np.empty(0, np.int64)
    if not {"connectivity", "offsets"} <= found.keys():
        raise FileError(f"{document.place(piece)}: Polys need the arrays connectivity and offsets")
    ends = document.array(found["offsets"], count).astype(np.int64)
    place = document.place(found["connectivity"])
    corners = text.indices(
        document.array(found["connectivity"]),
        points,
        document.path,
        lambda row: f"{place.removeprefix(f'{document.path}: ')}, entry {row + 1},",
        base=0,
    )
    sizes = np.diff(ends, prepend=0)
    if ends[-1] != len(corners) or (sizes < 3).any():
        raise FileError(
            f"{document.place(found['offsets'])}: offsets must rise by 3 or more, up to the "
            f"{len(corners)} entries of connectivity"
        )
    owner = np.repeat(np.arange(count), sizes - 2)
    first = (ends - sizes)[owner]
    second = first + 1 + np.arange(len(owner)) - (np.cumsum(sizes - 2) - (sizes - 2))[owner]
    return np.stack([corners[first], corners[second], corners[second + 1]], axis=1), owner


def _merged(data: list[dict[str, Array]]) -> dict[str, np.ndarray]:
    """Arrays that all pieces have, one after the other."""
    shared = [name for name in data[0] if all(name in other for other in data)]
    return {name: np.concatenate([other[name] for other in data]) for name in shared}


def _names(document: Document, mesh: Element) -> tuple[str, ...]:
    """Names of components, which are written as codes of letters with a 0 after each name."""
    for element in mesh.findall("FieldData/Array"):
        if element.get("Name") == "component_names":
            names = document.array(element).tobytes().split(b"\0")[:-1]
            return tuple(text.decoded(name) for name in names)
    return ()


def _components(
    labels: np.ndarray | None, names: tuple[str, ...], path: Path | str
) -> tuple[np.ndarray | None, tuple[str, ...] | None]:
    """Tags and names: the names' own numbers, or one component per different number."""
    if labels is None:
        return None, None
    if labels.ndim != 1:
        raise FileError(f"{path}: the cell array 'component' needs one number per cell")
    if names:
        count = len(names)
        return text.indices(labels, count, path, lambda row: f"component of face {row}", 0), names
    found, tags = np.unique(labels, return_inverse=True)
    return tags, tuple(f"{label:g}" for label in found.tolist())


def _name_array(names: tuple[str, ...]) -> bytes:
    codes = b"".join(name.encode() + b"\0" for name in names)
    return (
        f'<Array type="String" Name="component_names" NumberOfTuples="{len(names)}" '
        f'format="ascii">{" ".join(map(str, codes))}</Array>\n'
    ).encode()
