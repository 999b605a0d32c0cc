"""VTU: volume meshes in VTK's XML; files of triangles and quads are read as surfaces.

The boundary cells follow the others and have the number of their marker, from 0, in the cell array
`marker`, where the others have -1; the markers' names stand in the string array `marker_names` of
the field data. Other programs' files need none of it: what has one dimension less than the cells
is the boundary, in a marker per number in `marker`, or else in one named `boundary`; what has
fewer is skipped, and so are data, for which a volume mesh has no room.

Cells of two dimensions are a mesh of two dimensions if they lie in the plane z = 0. Elsewhere they
are a surface, with data and components as in VTP; polygons always are. Points that pieces share are
not welded.

Lost on writing: what SU2 files hold besides the mesh. Coordinates keep every bit.
"""

from pathlib import Path

import numpy as np

from ...errors import FileError
from ..surface import Surface
from ..volume import NODES_PER_CELL, Cells, VolumeMesh
from . import text, trix, vtkpieces
from .files import contents, replacing
from .polygons import triangles
from .vtkpieces import Piece
from .vtkxml import Document, data_array, opening

NAME = "VTU"
SUFFIXES = (".vtu",)
HOLDS = VolumeMesh

MARKERS, DIMENSION = "marker_names", "mesh_dimension"
POLYGON = 7
_DIMENSIONS = {1: 0, 3: 1, 5: 2, POLYGON: 2, 9: 2, 10: 3, 12: 3, 13: 3, 14: 3}


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether it is a VTK file of an unstructured grid, without Cart3D's additions."""
    is_grid = b"<VTKFile" in head and b"UnstructuredGrid" in head
    return is_grid and not trix.sniff(head, path)


def read(path: Path | str) -> VolumeMesh | Surface:
    """The mesh in a file, or the surface if that is all it holds."""
    document = Document(contents(path), path)
    elements = vtkpieces.pieces(document, "UnstructuredGrid")
    grid = _joined([vtkpieces.grid_piece(document, element) for element in elements], path)
    dimensions = _dimensions(grid, path)
    dimension = _own_dimension(document)
    if dimension:
        names = vtkpieces.names(document, MARKERS)
        owner = _owner(grid, names, path)
        return _mesh(grid, owner, names, dimension, path)
    top = int(dimensions.max(initial=0))
    if top < 2:
        raise FileError(f"{path}: holds no cells of two or three dimensions, but points or lines")
    if top == 2 and (grid.points[:, 2].any() or (grid.types == POLYGON).any()):
        return _surface(
            grid, dimensions == 2, vtkpieces.names(document, vtkpieces.COMPONENTS), path
        )
    owner, names = _boundary(grid, dimensions, top, path)
    return _mesh(grid, owner, names, top, path)


def write(path: Path | str, mesh: VolumeMesh) -> None:
    """Write one piece, in base64."""
    groups = [mesh.cells, *mesh.markers.values()]
    types = np.concatenate([np.asarray(group.types, np.uint8) for group in groups])
    sizes = np.concatenate([np.diff(group.starts) for group in groups])
    nodes = np.concatenate([np.asarray(group.nodes) for group in groups])
    owner = np.repeat(np.arange(-1, len(mesh.markers)), [len(group.types) for group in groups])
    with replacing(path) as file:
        names = vtkpieces.name_array(MARKERS, tuple(mesh.markers))
        file.write(opening("UnstructuredGrid") + b"<FieldData>\n" + names)
        file.write(data_array(DIMENSION, np.array([mesh.dimension]), NumberOfTuples="1"))
        file.write(
            b'</FieldData>\n<Piece NumberOfPoints="%d" NumberOfCells="%d">\n<PointData/>\n'
            % (len(mesh.points), len(types))
        )
        file.write(
            b"<CellData>\n" + data_array("marker", owner.astype(np.int32)) + b"</CellData>\n"
        )
        file.write(b"<Points>\n" + data_array("Points", mesh.points) + b"</Points>\n<Cells>\n")
        file.write(data_array("connectivity", nodes) + data_array("offsets", np.cumsum(sizes)))
        file.write(data_array("types", types) + b"</Cells>\n</Piece>\n")
        file.write(b"</UnstructuredGrid>\n</VTKFile>\n")


def _joined(pieces: list[Piece], path: Path | str) -> Piece:
    before = np.cumsum([0] + [len(piece.points) for piece in pieces]).tolist()
    return Piece(
        "",
        np.concatenate([piece.points for piece in pieces]),
        np.concatenate([p.corners + n for p, n in zip(pieces, before[:-1], strict=True)]),
        np.concatenate([piece.sizes for piece in pieces]),
        np.concatenate([piece.types for piece in pieces]),
        vtkpieces.merged([piece.point_data for piece in pieces], path),
        vtkpieces.merged([piece.cell_data for piece in pieces], path),
    )


def _dimensions(grid: Piece, path: Path | str) -> np.ndarray:
    """Dimension of each cell; refuses cells of unknown types or wrong numbers of points."""
    dimension, size = np.full(256, -1), np.zeros(256, int)
    dimension[list(_DIMENSIONS)] = list(_DIMENSIONS.values())
    size[list(NODES_PER_CELL)] = list(NODES_PER_CELL.values())
    unknown = np.flatnonzero(dimension[grid.types] < 0)
    if len(unknown):
        raise FileError(
            f"{path}: cell {unknown[0]} has VTK's type {grid.types[unknown[0]]}, expected one of "
            f"{', '.join(map(str, _DIMENSIONS))}; make linear cells of it"
        )
    least = np.where(grid.types == POLYGON, 3, 1)
    needed = np.where(size[grid.types] > 0, size[grid.types], np.maximum(grid.sizes, least))
    wrong = np.flatnonzero(grid.sizes != needed)
    if len(wrong):
        first = wrong[0]
        raise FileError(
            f"{path}: cell {first} of VTK's type {grid.types[first]} has {grid.sizes[first]} "
            f"points, expected {needed[first]}"
        )
    return dimension[grid.types]


def _own_dimension(document: Document) -> int | None:
    """What only our own files say."""
    for element in document.root.findall("*/FieldData/DataArray"):
        if element.get("Name") == DIMENSION:
            found = document.array(element).tolist()
            if found not in ([2], [3]):
                raise FileError(f"{document.place(element)} is {found}, expected 2 or 3")
            return int(found[0])
    return None


def _owner(grid: Piece, names: tuple[str, ...], path: Path | str) -> np.ndarray:
    """The marker of each cell, and -1 for the others, as our own files say."""
    found = grid.cell_data.get("marker", np.empty(0))
    vtkpieces.check_single(found, "marker", path)
    if len(found) != len(grid.types):
        raise FileError(f"{path}: the cell array 'marker' is missing")
    return text.indices(found, len(names) + 1, path, lambda row: f"marker of cell {row}", -1) - 1


def _boundary(
    grid: Piece, dimensions: np.ndarray, top: int, path: Path | str
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The marker of each cell, -1 for cells of the mesh and -2 for what is skipped."""
    owner = np.where(dimensions == top, -1, -2)
    on_boundary = dimensions == top - 1
    labels = grid.cell_data.get("marker")
    if labels is None:
        names: tuple[str, ...] | None = ("boundary",) if on_boundary.any() else ()
        owner[on_boundary] = 0
    else:
        owner[on_boundary], names = vtkpieces.components(labels[on_boundary], (), path)
    return owner, names or ()


def _mesh(
    grid: Piece, owner: np.ndarray, names: tuple[str, ...], dimension: int, path: Path | str
) -> VolumeMesh:
    if (grid.types[owner >= -1] == POLYGON).any():
        raise FileError(f"{path}: holds polygons, expected triangles and quadrilaterals")
    if len(set(names)) < len(names):
        raise FileError(f"{path}: two markers have the same name, expected different ones")
    markers = {name: _chosen(grid, owner == number) for number, name in enumerate(names)}
    return VolumeMesh(grid.points, _chosen(grid, owner == -1), markers, dimension)


def _chosen(grid: Piece, mask: np.ndarray) -> Cells:
    starts = np.concatenate([[0], np.cumsum(grid.sizes[mask])])
    return Cells(grid.types[mask], starts, grid.corners[np.repeat(mask, grid.sizes)])


def _surface(grid: Piece, mask: np.ndarray, names: tuple[str, ...], path: Path | str) -> Surface:
    cells = _chosen(grid, mask)
    faces, owner = triangles(grid.points, np.asarray(cells.nodes), np.diff(cells.starts))
    face_data = {name: data[mask][owner] for name, data in grid.cell_data.items()}
    tags, components = vtkpieces.components(face_data.pop("component", None), names, path)
    return Surface(grid.points, faces, tags, components, grid.point_data, face_data)
