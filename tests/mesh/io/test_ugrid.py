"""UGRID, the volume meshes of AFLR3."""

import struct

import numpy as np
import pytest
from conftest import same_bits
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from moldline.errors import FileError, GeometryError
from moldline.mesh import io
from moldline.mesh.io import ugrid
from moldline.mesh.quality import inverted_cells
from moldline.mesh.volume import NODES_PER_CELL, Cells, VolumeMesh

BINARY = [f"a.{order}{kind}.ugrid" for order in ("", "l") for kind in ("b8", "b4", "r8", "r4")]
NAMES = ["a.ugrid", *BINARY]

CUBE_POINTS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float
)

TWO_PRISMS = """ 8 4 1 0 0 2 0
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
1 3 2
1 4 3
5 6 7
5 7 8
1 2 6 5
3
3
7
7
11
1 2 3 5 6 7
1 3 4 5 7 8
"""
"""A cube of two prisms, with some of its faces."""


def read(folder, content, name="mesh.ugrid"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return io.read(path, format="ugrid")


def cells_of(rng, kinds, points, least):
    types = rng.choice(kinds, int(rng.integers(least, 9)))
    types = np.array([kind for kind in kinds for _ in range((types == kind).sum())], np.int32)
    sizes = [NODES_PER_CELL[kind] for kind in types.tolist()]
    nodes = [rng.choice(points, size, replace=False) for size in sizes]
    starts = np.cumsum([0, *sizes])
    return Cells(types, starts, np.concatenate(nodes).astype(np.int32))


def a_mesh(seed):
    """One with markers named by numbers, and cells in the format's order."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((int(rng.integers(8, 30)), 3)).astype("f4").astype(float)
    names = np.sort(rng.choice(999, int(rng.integers(0, 4)), replace=False))
    markers = {str(name): cells_of(rng, [5, 9], len(points), 1) for name in names}
    return VolumeMesh(points, cells_of(rng, [10, 14, 13, 12], len(points), 1), markers)


def assert_same(one, other):
    assert same_bits(one.points, other.points)
    assert [*one.markers] == [*other.markers]
    for some, others in zip(
        [one.cells, *one.markers.values()], [other.cells, *other.markers.values()], strict=True
    ):
        assert all(map(same_bits, some, others))


@settings(
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(seed=st.integers(0, 2**32), name=st.sampled_from(NAMES))
def test_any_mesh_reads_back_to_the_bit(tmp_path, seed, name):
    mesh = a_mesh(seed)
    io.write(tmp_path / name, mesh)
    assert_same(io.read(tmp_path / name), mesh)


def test_a_file_by_hand_is_understood(tmp_path):
    mesh = read(tmp_path, TWO_PRISMS)
    np.testing.assert_array_equal(mesh.points, CUBE_POINTS)
    assert mesh.cells.types.tolist() == [13, 13]
    assert mesh.cells.nodes.reshape(2, 6).tolist() == [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]]
    assert [*mesh.markers] == ["3", "7", "11"]
    assert mesh.markers["7"].nodes.tolist() == [4, 5, 6, 4, 6, 7]
    assert mesh.markers["11"].types.tolist() == [9]
    assert not len(inverted_cells(mesh))


@pytest.mark.parametrize(
    ("kind", "header", "nodes"),
    [
        (10, "1 0 0 0", [1, 2, 4, 5]),
        (14, "0 1 0 0", [1, 2, 3, 5, 6]),  # a prism whose last edge, 3 to 7, shrank to point 3
        (13, "0 0 1 0", [1, 2, 3, 5, 6, 7]),
        (12, "0 0 0 1", [1, 2, 3, 4, 5, 6, 7, 8]),
    ],
)
def test_cells_of_each_type_have_a_positive_volume(tmp_path, kind, header, nodes):
    points = "\n".join(" ".join(map(str, point)) for point in CUBE_POINTS)
    content = f"8 0 0 {header}\n{points}\n{' '.join(map(str, nodes))}\n"
    mesh = read(tmp_path, content)
    assert mesh.cells.types.tolist() == [kind]
    assert sorted(mesh.cells.nodes + 1) == nodes
    assert not len(inverted_cells(mesh))
    mirrored = mesh.moved(mesh.points * [1, 1, -1])
    assert len(inverted_cells(mirrored)) == (kind != 13)  # prisms may stand in both senses
    io.write(tmp_path / "b.ugrid", mesh)
    assert (tmp_path / "b.ugrid").read_text().split()[-len(nodes) :] == [str(n) for n in nodes]


@pytest.mark.parametrize(("name", "order"), [("a.lb8.ugrid", "<"), ("a.b8.ugrid", ">")])
def test_the_bytes_of_a_stream_are_as_published(tmp_path, name, order):
    mesh = read(tmp_path, TWO_PRISMS)
    io.write(tmp_path / name, mesh)
    words = TWO_PRISMS.split()
    floats, integers = list(map(float, words[7:31])), list(map(int, words[31:]))
    expected = struct.pack(
        f"{order}7i24d{len(integers)}i", *map(int, words[:7]), *floats, *integers
    )
    assert (tmp_path / name).read_bytes() == expected


def test_fortrans_data_stand_in_two_records(tmp_path):
    mesh = read(tmp_path, TWO_PRISMS)
    io.write(tmp_path / "a.lr8.ugrid", mesh)
    io.write(tmp_path / "a.lb8.ugrid", mesh)
    stream = (tmp_path / "a.lb8.ugrid").read_bytes()
    first, second = struct.pack("<i", 28), struct.pack("<i", len(stream) - 28)
    expected = first + stream[:28] + first + second + stream[28:] + second
    assert (tmp_path / "a.lr8.ugrid").read_bytes() == expected


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("lie", ["nameless", "a.ugrid", "a.b8.ugrid", "a.lr4.ugrid", "a.stl"])
def test_content_tells_the_variant_where_the_name_lies(tmp_path, name, lie):
    mesh = a_mesh(5)
    io.write(tmp_path / name, mesh)
    assert_same(io.read((tmp_path / name).rename(tmp_path / lie)), mesh)


@pytest.mark.parametrize("records", [False, True])
def test_what_follows_the_cells_is_skipped(tmp_path, records):
    name = "a.lr8.ugrid" if records else "a.lb8.ugrid"
    mesh = read(tmp_path, TWO_PRISMS)
    io.write(tmp_path / name, mesh)
    whole = (tmp_path / name).read_bytes()
    more = TWO_PRISMS
    for count, is_complete in ((1, True), (2, True), (5, False), (5, True)):
        mark = struct.pack("<i", 4 * count) * records
        whole += mark + bytes(4 * count) + mark
        more += "0\n" * count
        if is_complete:
            assert_same(read(tmp_path, whole, name), mesh)
            assert_same(read(tmp_path, more), mesh)
        else:
            with pytest.raises(FileError, match=r"points, 5 faces and 2 cells.* need"):
                read(tmp_path, whole, name)


def test_markers_with_other_names_are_numbered(tmp_path):
    mesh = read(tmp_path, TWO_PRISMS)
    named = VolumeMesh(
        mesh.points, mesh.cells, dict(zip("abc", mesh.markers.values(), strict=True))
    )
    io.write(tmp_path / "b.ugrid", named)
    assert [*io.read(tmp_path / "b.ugrid").markers] == ["1", "2", "3"]


def test_cells_are_sorted_by_type(tmp_path):
    types, sizes = [12, 14, 10, 14], [8, 5, 4, 5]
    points = np.random.default_rng(3).random((13, 3))
    nodes = np.concatenate([np.arange(size) + k for k, size in enumerate(sizes)]).astype(np.int32)
    mesh = VolumeMesh(points, Cells(np.array(types, "i4"), np.cumsum([0, *sizes]), nodes))
    io.write(tmp_path / "a.b8.ugrid", mesh)
    cells = io.read(tmp_path / "a.b8.ugrid").cells
    assert cells.types.tolist() == [10, 14, 14, 12]
    assert cells.nodes[:4].tolist() == [2, 3, 4, 5]
    assert cells.nodes[4:14].tolist() == [1, 2, 3, 4, 5, 3, 4, 5, 6, 7]


@pytest.mark.parametrize("name", NAMES)
def test_a_file_cut_short_anywhere_is_refused(tmp_path, name):
    io.write(tmp_path / name, read(tmp_path, TWO_PRISMS))
    whole = (tmp_path / name).read_bytes().rstrip(b"\n")
    path = tmp_path / f"cut{name[1:]}"
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        with pytest.raises(FileError, match=r"cut short|header|refers to|a record of"):
            ugrid.read(path)


STREAM = struct.pack("<7i12d4i", 4, 0, 0, 1, 0, 0, 0, *np.eye(4)[:, :3].ravel(), 1, 2, 3, 4)


def counted(*header):
    return struct.pack("<7i", *header) + STREAM[28:]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (TWO_PRISMS.replace("1 3 2\n", "1 3 9\n", 1), "triangle 1 refers to 9, .* from 1 to 8"),
        (TWO_PRISMS.replace("1 2 6 5", "1 2 6 0"), "quad 1 refers to 0, expected"),
        (TWO_PRISMS.replace("1 3 4 5 7 8", "1 3 4 5 7 -8"), "prism 2 refers to -8, expected"),
        (TWO_PRISMS.replace("1 3 4 5 7 8", "1 3 4 5 7 1.5"), "prism 2 refers to 1.5, expected"),
        (TWO_PRISMS.replace("1 1 1", "1 nan 1"), "line 8: found 'nan', expected a finite number"),
        (TWO_PRISMS.replace("1 1 1", "1 1,0 1"), "line 8: found '1,0', .*decimal commas"),
        (TWO_PRISMS.replace("\n11\n", "\n1.5\n"), "face 5 has the boundary number 1.5, expected a"),
        (TWO_PRISMS.replace("\n11\n", "\n3000000000\n"), "face 5 has the boundary number 30000000"),
        (TWO_PRISMS.replace("0 2 0", "0 -2 0"), "found -2 as the number of prisms, expected"),
        (TWO_PRISMS.replace("0 2 0", "0 2.5 0"), "found 2.5 as the number of prisms, expected"),
        (TWO_PRISMS.replace(" 8", " 0"), "found 0 as the number of points, expected"),
        (
            TWO_PRISMS.replace(" 8", " 2000000000"),
            "2000000000 points, 5 faces and 2 cells need 6000",
        ),
        (
            TWO_PRISMS.replace("0 2 0", "0 0 0"),
            "8 points, 5 faces and 0 cells: a surface or a two-",
        ),
        ("1 2 3\n", "the header needs 7 numbers, the file has 3"),
        (STREAM[:-4] + struct.pack("<i", 5), "tetrahedron 1 refers to 5, expected"),
        (STREAM[:-4] + struct.pack("<i", -1), "tetrahedron 1 refers to -1, expected"),
        (STREAM[:28] + struct.pack("<d", np.nan) + STREAM[36:], r"point 1 is \[nan +0. +0.\]"),
        (counted(4, 0, 0, 2**31 - 1, 0, 0, 0), "and 2147483647 cells need 34359738428 bytes"),
        (counted(2**31 - 1, 0, 0, 1, 0, 0, 0), "2147483647 points, .* was the copy cut short"),
        (counted(4, 0, 0, -1, 0, 0, 0), "the header of 140 bytes of binary data counts nothing"),
        (counted(4, 3, 0, 0, 0, 0, 0), "4 points, 3 faces and 0 cells: a surface or a two-dimens"),
        (STREAM[:-1], "as a little-endian stream of .*need 140 bytes, the file has 139"),
        (STREAM + b"\0", "need 140 bytes, the file has 141"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, content, message):
    with pytest.raises(FileError, match=rf"mesh\.ugrid: .*{message}"):
        read(tmp_path, content)


def test_a_damaged_record_is_told(tmp_path):
    io.write(tmp_path / "a.r8.ugrid", read(tmp_path, TWO_PRISMS))
    whole = (tmp_path / "a.r8.ugrid").read_bytes()
    for place in (36, len(whole) - 4):
        damaged = whole[:place] + struct.pack(">i", 5) + whole[place + 4 :]
        with pytest.raises(FileError, match="a record of 5 bytes, expected 324; is the file damag"):
            read(tmp_path, damaged)


def test_thousands_of_boundary_numbers_are_refused(tmp_path):
    numbers = np.arange(20_000, dtype="<i4")
    header = struct.pack("<7i", 4, len(numbers), 0, 1, 0, 0, 0)
    faces = np.tile(np.array([1, 2, 3], "<i4"), len(numbers)).tobytes()
    content = header + STREAM[28:124] + faces + numbers.tobytes() + STREAM[124:]
    with pytest.raises(FileError, match="20000 different boundary numbers, expected 16384 at most"):
        read(tmp_path, content)


def test_what_the_format_cannot_hold_is_refused(tmp_path):
    triangle = Cells(np.array([5], np.int32), np.array([0, 3]), np.array([0, 1, 2], np.int32))
    edge = Cells(np.array([3], np.int32), np.array([0, 2]), np.array([0, 1], np.int32))
    solid = Cells(np.array([10], np.int32), np.array([0, 4]), np.arange(4, dtype=np.int32))
    points = np.eye(4)[:, :3]
    for mesh, message in [
        (VolumeMesh(points * [1, 1, 0], triangle, dimension=2), "no two-dimensional meshes; write"),
        (VolumeMesh(points, triangle), "no cells of VTK's type 5; it has: tetrahedron, pyramid,"),
        (
            VolumeMesh(points, solid, {"1": edge}),
            "no faces of VTK's type 3; it has: triangle, quad",
        ),
        (VolumeMesh(points, Cells(*(array[:0] for array in solid))), "no solid cells"),
    ]:
        with pytest.raises(GeometryError, match=message):
            io.write(tmp_path / "a.ugrid", mesh)
    assert not list(tmp_path.iterdir())
