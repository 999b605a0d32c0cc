"""VTU: volume meshes, and surfaces in unstructured grids."""

import jax
import numpy as np
import pytest
from conftest import same_bits
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import geometry

from moldline.errors import FileError
from moldline.mesh import io
from moldline.mesh.io import vtu
from moldline.mesh.surface import Surface
from moldline.mesh.volume import Cells, VolumeMesh

SOLID = "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 2 0 0"
"""A pyramid on the first four points, and a tetrahedron beside it."""

BENT = "0 0 0 1 0 0 1 1 0 0 1 0.5 0 0 1"


def array(name, kind, numbers, more=""):
    return f'<DataArray type="{kind}" Name="{name}" {more}format="ascii">\n{numbers}</DataArray>\n'


def grid(points, connectivity, offsets, types, data="", field=""):
    """A file as other programs write it."""
    return (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">\n'
        f"<UnstructuredGrid>\n{field}"
        f'<Piece NumberOfPoints="{len(points.split()) // 3}" '
        f'NumberOfCells="{len(types.split())}">\n{data}<Points>\n'
        + array("Points", "Float64", points, 'NumberOfComponents="3" ')
        + "</Points>\n<Cells>\n"
        + array("connectivity", "Int64", connectivity)
        + array("offsets", "Int64", offsets)
        + array("types", "UInt8", types)
        + "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    )


MIXED = grid(SOLID, "0 1 2 3 4 1 5 2 4 0 1 2 3 0 1 4 0 1 3", "5 9 13 16 18 19", "14 10 9 5 3 1")
"""Two cells, two faces of theirs, an edge and a point."""


def read(tmp_path, content):
    path = tmp_path / "flow.vtu"
    path.write_text(content)
    assert io.found(path) is vtu
    return io.read(path)


def rows(cells):
    types, starts, nodes = cells
    return [
        (kind, *nodes[one:two].tolist())
        for kind, one, two in zip(types.tolist(), starts[:-1], starts[1:], strict=True)
    ]


def same(one, other):
    assert jax.tree.structure(one) == jax.tree.structure(other)
    assert all(map(same_bits, jax.tree.leaves(one), jax.tree.leaves(other)))


@settings(max_examples=100, deadline=None, derandomize=True, database=None)
@given(seed=st.integers(0, 2**32))
def test_what_is_written_reads_back_to_the_bit(tmp_path_factory, seed):
    made = geometry(VolumeMesh, seed)
    mesh = VolumeMesh(made.points, made.cells, made.markers, made.dimension)
    path = tmp_path_factory.getbasetemp() / "random.vtu"
    io.write(path, mesh)
    same(io.read(path), mesh)


def test_a_mesh_without_markers_and_a_marker_without_cells_read_back(tmp_path):
    cells = Cells(np.array([5], np.int32), np.array([0, 3]), np.array([0, 1, 2], np.int32))
    empty = Cells(np.empty(0, np.int32), np.array([0]), np.empty(0, np.int32))
    for markers in ({}, {"wall": empty}):
        mesh = VolumeMesh(np.eye(3), cells, markers, 3)
        io.write(tmp_path / "a.vtu", mesh)
        same(io.read(tmp_path / "a.vtu"), mesh)


def test_faces_of_other_programs_become_the_boundary_and_smaller_cells_are_skipped(tmp_path):
    mesh = read(tmp_path, MIXED)
    assert mesh.dimension == 3
    assert rows(mesh.cells) == [(14, 0, 1, 2, 3, 4), (10, 1, 5, 2, 4)]
    assert list(mesh.markers) == ["boundary"]
    assert rows(mesh.markers["boundary"]) == [(9, 0, 1, 2, 3), (5, 0, 1, 4)]


def test_numbers_of_other_programs_become_markers(tmp_path):
    data = f"<CellData>{array('marker', 'Int32', '1 1 1234567 3 9 9')}</CellData>"
    mesh = read(tmp_path, MIXED.replace("<Points>", data + "<Points>"))
    assert {name: rows(cells) for name, cells in mesh.markers.items()} == {
        "3": [(5, 0, 1, 4)],
        "1234567": [(9, 0, 1, 2, 3)],
    }


def test_triangles_and_quads_in_space_are_a_surface_with_data(tmp_path):
    data = (
        f"<PointData>{array('Cp', 'Float64', '1 2 3 4 5')}</PointData>"
        f"<CellData>{array('component', 'Int32', '7 7 8')}{array('k', 'Int8', '1 2 3')}</CellData>"
    )
    surface = read(tmp_path, grid(BENT, "0 1 0 1 2 3 0 1 4", "2 6 9", "3 9 5", data))
    assert isinstance(surface, Surface)
    assert surface.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 4]]
    assert surface.components == ("7", "8")
    assert surface.tags.tolist() == [0, 0, 1]
    assert surface.face_data["k"].tolist() == [2, 2, 3]
    assert surface.point_data["Cp"].tolist() == [1, 2, 3, 4, 5]


def test_flat_cells_are_a_mesh_of_two_dimensions_and_polygons_a_surface(tmp_path):
    flat = "0 0 0 1 0 0 1 1 0 0 1 0 0.5 2 0"
    mesh = read(tmp_path, grid(flat, "0 1 2 3 3 2 4 0 1", "4 7 9", "9 5 3"))
    assert mesh.dimension == 2
    assert rows(mesh.markers["boundary"]) == [(3, 0, 1)]
    surface = read(tmp_path, grid(flat, "0 1 2 4 3", "5", "7"))
    assert surface.faces.tolist() == [[0, 1, 2], [0, 2, 4], [0, 4, 3]]


def test_pieces_are_joined(tmp_path):
    one = grid(BENT, "0 1 2", "3", "5")
    piece = one[one.index("<Piece") : one.index("</UnstructuredGrid>")]
    surface = read(tmp_path, one.replace(piece, piece + piece))
    assert surface.faces.tolist() == [[0, 1, 2], [5, 6, 7]]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("14 10 9", "14 24 9", "cell 1 has VTK's type 24, expected one of 1, 3, .*linear cells"),
        ("14 10 9", "10 10 9", "cell 0 of VTK's type 10 has 5 points, expected 4"),
        ("14 10 9", "14 10 7", "holds polygons, expected triangles and quadrilaterals"),
        ("14 10 9", "14 10 999", "'types': holds '999', which is no UInt8"),
        ("5 9 13", "5 9 8", "'offsets': offsets must rise by 1 or more, up to the 19 entries"),
        ("5 9 13", "5 9 9223372036854775807", "'offsets': offsets must rise by 1"),
        ("18 19<", "18<", "'offsets': 5 numbers, expected 6 times 1; was the copy cut short"),
        ("0 1 2 3 4", "0 1 2 3 6", "'connectivity', entry 5, refers to 6, expected .* from 0 to 5"),
        ("0 1 2 3 4", "0 1 2 3 -1", "'connectivity', entry 5, refers to -1"),
        ('Cells="6"', 'Cells="99999999999"', "expected 99999999999 times 1"),
        ('Cells="6"', 'Cells="0"', "holds no cells of two or three dimensions"),
        ('Points="6"', 'Points="99999999999"', "18 numbers, expected 99999999999 times 3"),
        ("0 0 0 1", "0 0 inf 1", "needs 6 points of three finite coordinates"),
        ('"offsets"', '"ends"', "Cells need the arrays connectivity and offsets"),
        ('"types"', '"kinds"', "Cells need the arrays types"),
        ("<Piece", "<Peace", "mismatched tag"),
        ("<Cells>", "<Cells>" * 99, "more than 32 elements within each other"),
        ("<VTKFile", '<!DOCTYPE a [<!ENTITY b "c">]><VTKFile', "line 1: found a document type"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, old, new, message):
    assert old in MIXED
    with pytest.raises(FileError, match=message):
        read(tmp_path, MIXED.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (">\n3<", ">\n4<", r"'mesh_dimension' is \[4\], expected 2 or 3"),
        ('"marker"', '"mark"', "the cell array 'marker' is missing"),
        (">\n-1 0 1<", ">\n-1 0 2<", "marker of cell 2 refers to 2, expected .* from -1 to 1"),
        ("97 0 98 0", "97 0 97 0", "two markers have the same name"),
    ],
)
def test_what_is_wrong_with_our_own_files_is_named(tmp_path, old, new, message):
    field = (
        '<FieldData><Array type="String" Name="marker_names" format="ascii">97 0 98 0</Array>'
        f"{array('mesh_dimension', 'Int32', '3')}</FieldData>"
    )
    data = f"<CellData>{array('marker', 'Int32', '-1 0 1')}</CellData>"
    whole = grid(SOLID, "1 5 2 4 1 2 4 1 5 2", "4 7 10", "10 5 5", data, field)
    assert list(read(tmp_path, whole).markers) == ["a", "b"]
    assert old in whole
    with pytest.raises(FileError, match=message):
        read(tmp_path, whole.replace(old, new))


def test_lines_alone_are_refused(tmp_path):
    with pytest.raises(FileError, match="holds no cells of two or three dimensions, but points or"):
        read(tmp_path, grid(BENT, "0 1 1 2", "2 4", "3 3"))


def test_a_file_cut_short_anywhere_is_refused(tmp_path):
    path = tmp_path / "a.vtu"
    io.write(path, geometry(VolumeMesh, 5))
    for whole in (path.read_bytes().rstrip(), MIXED.rstrip().encode()):
        for size in range(len(whole)):
            path.write_bytes(whole[:size])
            with pytest.raises(FileError):
                vtu.read(path)


@pytest.mark.parametrize("name", ["su2/brick_prism_ffd.su2", "su2/rae2822_turbulent_ffd.su2"])
def test_real_meshes_read_back_to_the_bit(tmp_path, data, name):
    mesh = io.read(data(name))
    io.write(tmp_path / "a.vtu", mesh)
    again = io.read(tmp_path / "a.vtu")
    same(again, VolumeMesh(mesh.points, mesh.cells, mesh.markers, mesh.dimension))
