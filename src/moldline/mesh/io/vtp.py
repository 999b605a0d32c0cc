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

from ...errors import FileError
from ..surface import Surface
from . import vtkpieces
from .files import contents, replacing
from .polygons import triangles
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
    parts = [_piece(document, piece) for piece in vtkpieces.pieces(document, "PolyData")]
    before = np.cumsum([0] + [len(part.points) for part in parts])
    face_data = vtkpieces.merged([part.face_data for part in parts], path)
    names = vtkpieces.names(document, vtkpieces.COMPONENTS)
    tags, components = vtkpieces.components(face_data.pop("component", None), names, path)
    return Surface(
        np.concatenate([part.points for part in parts]),
        np.concatenate([p.faces + start for p, start in zip(parts, before[:-1], strict=True)]),
        tags,
        components,
        vtkpieces.merged([part.point_data for part in parts], path),
        face_data,
    )


def write(path: Path | str, surface: Surface) -> None:
    """Write one piece, in base64."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    with replacing(path) as file:
        file.write(opening("PolyData"))
        names = vtkpieces.name_array(vtkpieces.COMPONENTS, surface.components)
        file.write(b"<FieldData>\n" + names + b"</FieldData>\n")
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
    if document.count(piece, "NumberOfStrips"):
        raise FileError(
            f"{document.place(piece)} has triangle strips, expected polygons; triangulate it first"
        )
    points = vtkpieces.coordinates(document, piece)
    corners, sizes = vtkpieces.cells(document, piece, "Polys", len(points), least=3)
    faces, owner = triangles(points, corners, sizes)
    skipped = document.count(piece, "NumberOfVerts") + document.count(piece, "NumberOfLines")
    face_data = vtkpieces.data(document, piece, "CellData", skipped + len(sizes))
    return Surface(
        points,
        faces,
        point_data=vtkpieces.data(document, piece, "PointData", len(points)),
        face_data={name: data[skipped:][owner] for name, data in face_data.items()},
    )
