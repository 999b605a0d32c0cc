"""PLY."""

import struct

import numpy as np
import pytest
import trimesh
from conftest import same_bits
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from moldline.errors import FileError, GeometryError
from moldline.mesh.io import ply
from moldline.mesh.surface import Surface

SQUARE = """ply
format ascii 1.0
comment a square, by hand
obj_info made for a test
element vertex 4
property float x
property float y
property float z
property uchar red
element face 2
property uchar material
property list uchar int vertex_indices
property short component
end_header
0 0 0 255
1 0 0 0
1 1 0 7
0 1 0 8
5 3 0 1 2 4
6 3 0 2 3 -7
"""


def read(folder, content):
    path = folder / "wing.ply"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return ply.read(path)


def headed(order, properties, body, vertices=3, faces=1):
    """A binary file with so many points, one in each line of `properties`, and faces."""
    header = f"ply\nformat binary_{order}_endian 1.0\nelement vertex {vertices}\n"
    lines = "".join(f"property {words}\n" for words in ["float x", "float y", "float z"])
    header += f"{lines}element face {faces}\n"
    return (
        header + "".join(f"property {p}\n" for p in properties) + "end_header\n"
    ).encode() + body


RAGGED = headed(
    "big",
    ["list uchar uchar vertex_indices", "uchar last"],
    bytes(36) + bytes([4, 0, 0, 1, 2, 9, 3, 0, 1, 2, 9]),
    3,
    2,
)
"""Polygons of several sizes."""


@pytest.mark.parametrize("binary", [True, False])
def test_what_is_written_reads_back_to_the_bit(tmp_path, surface, binary):
    named = Surface(
        surface.points,
        surface.faces,
        surface.tags,
        ("a b", "ü", "c", "none of the faces"),
        {"Cp": surface.points[:, 0], "n": np.arange(30, dtype=np.uint16)},
        {"area": np.linspace(0, 1, 30, dtype=np.float32), "nan": np.full(30, np.nan)},
    )
    ply.write(tmp_path / "a.ply", named, binary)
    read = ply.read(tmp_path / "a.ply")
    for name in ("points", "faces", "tags"):
        assert same_bits(getattr(read, name), getattr(named, name))
    assert read.components == named.components
    for one, other in ((read.point_data, named.point_data), (read.face_data, named.face_data)):
        assert one.keys() == other.keys()
        assert all(same_bits(one[name], other[name]) for name in one)


numbers = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def contents(draw):
    """Arguments of a surface."""
    count, faces = draw(st.integers(0, 9)), draw(st.integers(0, 9))
    points = draw(st.lists(numbers, min_size=3 * count, max_size=3 * count))
    corners = st.lists(st.integers(0, count - 1), min_size=3 * faces, max_size=3 * faces)
    parts = draw(st.lists(st.text(st.characters(categories=["L", "N", "P"])), min_size=1))
    tags = st.lists(st.integers(0, len(parts) - 1), min_size=faces, max_size=faces)
    kind = draw(st.sampled_from([np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32]))
    return (
        np.reshape(points, (-1, 3)),
        np.reshape(draw(corners) if count else [], (-1, 3)),
        draw(tags) if count else [],
        tuple(parts),
        {"Cp": np.array(draw(st.lists(numbers, min_size=count, max_size=count)))},
        {"label": np.full(faces if count else 0, np.iinfo(kind).max, kind)},
    )


@settings(
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(content=contents(), binary=st.booleans())
def test_any_surface_reads_back_to_the_bit(tmp_path, content, binary):
    surface = Surface(*content)
    ply.write(tmp_path / "a.ply", surface, binary)
    read = ply.read(tmp_path / "a.ply")
    assert same_bits(read.points, surface.points)
    assert same_bits(read.faces, surface.faces)
    assert same_bits(read.tags, surface.tags)
    assert read.components == surface.components
    assert same_bits(read.point_data["Cp"], surface.point_data["Cp"])
    assert same_bits(read.face_data["label"], surface.face_data["label"])


def test_a_file_by_hand_is_understood(tmp_path):
    found = read(tmp_path, SQUARE)
    assert found.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert found.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert found.components == ("-7", "4")
    assert found.tags.tolist() == [1, 0]
    assert same_bits(found.point_data["red"], np.array([255, 0, 7, 8], np.uint8))
    assert same_bits(found.face_data["material"], np.array([5, 6], np.uint8))


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_line_ends_of_other_systems_are_understood(tmp_path, end):
    assert read(tmp_path, SQUARE.replace("\n", end)).faces.shape == (2, 3)


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_binary_data_may_begin_with_what_looks_like_a_line_end(tmp_path, end):
    x = struct.unpack("<f", b"\n\r\n\r")[0]
    body = struct.pack("<9fB3i", x, 0, 0, 1, 0, 0, 0, 1, 0, 3, 0, 1, 2)
    header, last = headed("little", ["list uchar int vertex_index"], b"").split(b"end_header")
    content = (header + b"end_header" + last).replace(b"\n", end) + body
    assert read(tmp_path, content).points[0, 0] == x


@pytest.mark.parametrize(("order", "mark"), [("little", "<"), ("big", ">")])
@pytest.mark.parametrize(("length", "l"), [("uchar", "B"), ("short", "h"), ("uint32", "I")])
@pytest.mark.parametrize(("item", "i"), [("int", "i"), ("uint8", "B"), ("ushort", "H")])
def test_polygons_of_any_types_become_fans(tmp_path, order, mark, length, l, item, i):  # noqa: E741
    points = struct.pack(f"{mark}15f", *range(15))
    lists = [f"list {length} {item} vertex_indices", "float area", f"list {length} double texcoord"]
    body = b""
    for row, (corners, texture) in enumerate([([0, 1, 2, 3, 4], []), ([0, 2, 4], [0.5])]):
        body += struct.pack(f"{mark}{l}{len(corners)}{i}", len(corners), *corners)
        body += struct.pack(f"{mark}f{l}{len(texture)}d", row / 2, len(texture), *texture)
    found = read(tmp_path, headed(order, lists, points + body, 5, 2))
    assert found.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 2, 4]]
    assert same_bits(found.face_data["area"], np.array([0, 0, 0, 0.5], np.float32))
    np.testing.assert_array_equal(found.points.ravel(), np.arange(15))


def test_other_elements_are_skipped_wherever_they_stand(tmp_path):
    content = SQUARE.replace(
        "element vertex", "element edge 2\nproperty int a\nproperty list char int b\nelement vertex"
    ).replace("0 0 0 255", "7 2 1 1\n8 0\n0 0 0 255")
    assert read(tmp_path, content).faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_points_without_faces_are_a_surface_without_faces(tmp_path):
    header, _, body = SQUARE.partition("element face 2\n")
    points = body.partition("end_header\n")[2].split("\n")[:4]
    found = read(tmp_path, f"{header}end_header\n" + "\n".join(points))
    assert found.faces.shape == (0, 3)
    assert len(found.points) == 4


def test_trimesh_reads_what_we_write_and_we_read_what_it_writes(tmp_path, surface):
    ply.write(tmp_path / "a.ply", surface)
    theirs = trimesh.load(tmp_path / "a.ply", process=False)
    np.testing.assert_array_equal(theirs.vertices, surface.points)
    np.testing.assert_array_equal(theirs.faces, surface.faces)
    ball = trimesh.creation.icosphere(2)
    for encoding in ("ascii", "binary"):
        ball.export(tmp_path / "b.ply", encoding=encoding)
        ours, theirs = ply.read(tmp_path / "b.ply"), trimesh.load(tmp_path / "b.ply", process=False)
        rounding = 1e-7 * (encoding == "ascii")  # trimesh takes the header's float by its word
        np.testing.assert_allclose(ours.points, theirs.vertices, rtol=rounding)
        np.testing.assert_array_equal(ours.faces, theirs.faces)


def test_numbers_of_eight_bytes_become_smaller_ones_or_floats(tmp_path):
    triangle = Surface(
        np.eye(3),
        [[0, 1, 2]],
        point_data={
            "small": np.arange(3),
            "large": np.arange(3) + 2**40,
            "is it": np.eye(3)[0] > 0,
        },
    )
    ply.write(tmp_path / "a.ply", triangle)
    found = ply.read(tmp_path / "a.ply").point_data
    assert same_bits(found["small"], np.arange(3, dtype=np.int32))
    assert same_bits(found["large"], np.arange(3.0) + 2**40)
    assert same_bits(found["is_it"], np.array([1, 0, 0], np.uint8))


def test_data_that_would_hide_other_data_are_refused(tmp_path):
    for data in ({"x": np.zeros(3)}, {"a b": np.zeros(3), "a_b": np.zeros(3)}):
        with pytest.raises(GeometryError, match=r"which there is already; rename it"):
            ply.write(tmp_path / "a.ply", Surface(np.eye(3), [[0, 1, 2]], point_data=data))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", ["text", "binary", "ragged"])
def test_a_file_cut_short_anywhere_is_refused(tmp_path, content):
    whole = SQUARE.encode().rstrip()
    if content == "binary":
        ply.write(tmp_path / "a.ply", read(tmp_path, SQUARE))
        whole = (tmp_path / "a.ply").read_bytes()
    if content == "ragged":
        whole = RAGGED
    read(tmp_path, whole)
    for size in range(1, len(whole)):
        with pytest.raises(FileError, match=r"cut short|on the first line|found '-', expected"):
            read(tmp_path, whole[:size])


TRIANGLES = headed(
    "little", ["list int int vertex_indices"], bytes(36) + struct.pack("<4i", 3, 0, 1, 2)
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("polygon\n", "found 'polygon.n', expected 'ply' on the first line"),
        (SQUARE.replace("ascii", "binary_middle_endian"), "needs one line such as 'format ascii"),
        (SQUARE.replace("format ascii 1.0\n", ""), "needs one line such as 'format ascii"),
        (SQUARE.replace("end_header", "end"), "the header has no 'end_header'"),
        (SQUARE.replace("float x", "quad x"), "line 6: found 'property quad x', expected such as"),
        (SQUARE.replace("list uchar", "list float"), "line 12: found 'property list float int ver"),
        (SQUARE.replace("float y", "float x"), "line 7: a second property 'x'"),
        (SQUARE.replace("face 2", "vertex 2"), "line 10: a second element 'vertex'"),
        (SQUARE.replace("face 2", "face two"), "line 10: found 'element face two', expected"),
        (SQUARE.replace("float z", "float w"), "points have no property 'z', expected x, y and z"),
        (SQUARE.replace("element vertex", "element node"), "the header has no 'element vertex'"),
        (SQUARE.replace("vertex_indices", "corners"), "faces have no list 'vertex_indices'"),
        (SQUARE.replace("face", "tristrips"), "has triangle strips, expected faces; triangulate"),
        (SQUARE.replace("1 1 0 7", "1 nan 0 7"), r"vertex 2 is \[ 1. nan  0.\], expected finite"),
        (SQUARE.replace("1 1 0 7", "1 1,5 0 7"), "line 17: found '1,5', .* decimal commas"),
        (SQUARE.replace("1 1 0 7", "1 1 0 256"), "'red' of vertex 2 is 256, expected a whole"),
        (
            SQUARE.replace("0 2 3 -7", "0 2 4 -7"),
            "face 1 refers to 4, expected a whole number from 0",
        ),
        (SQUARE.replace("0 2 3 -7", "0 2 -3 -7"), "face 1 refers to -3, expected"),
        (SQUARE.replace("0 2 3 -7", "0 2 1.5 -7"), "face 1 refers to 1.5, expected"),
        (SQUARE.replace("6 3 0 2 3 -7", "6 2 0 2 -7"), "face 1 has 2 corners, expected 3 or more"),
        (SQUARE.replace("6 3 0 2 3 -7", "6 -3 0 2 3 -7"), "'face' 1 has a list of -3 numbers"),
        (SQUARE.replace("6 3 0 2 3 -7", "6 nan 0 2 3 -7"), "'face' 1 has a list of nan numbers"),
        (SQUARE + "1\n", "1 more numbers than the header promises"),
        (
            SQUARE.replace("vertex 4", "vertex 4000000000"),
            "4000000000 rows of 'vertex' need at least",
        ),
        (SQUARE.replace("face 2", "face 9999999999"), "9999999999 rows of 'face' need at least"),
        (SQUARE.replace("vertex 4", "vertex 99999999999"), "line 5: found 'element vertex 99999"),
        (
            SQUARE.replace("property float x", "property float x\n" * 1 + "property char a\n" * 2),
            "a sec",
        ),
        (TRIANGLES + b"\0", "1 more bytes than the header promises"),
        (TRIANGLES.replace(b"little", b"big"), "'face' 0 has a list of 50331648 numbers"),
        (TRIANGLES[:-16] + struct.pack("<4i", 2**31 - 1, 0, 1, 2), "has a list of 2147483647 numb"),
        (TRIANGLES[:-16] + struct.pack("<4i", -1, 0, 1, 2), "'face' 0 has a list of -1 numbers"),
        (TRIANGLES[:-4] + struct.pack("<i", -1), "face 0 refers to -1, expected"),
        (
            TRIANGLES.replace(b"vertex 3", b"vertex 2147483647"),
            "2147483647 rows of 'vertex' need at least 25769803764 bytes, 52 are left",
        ),
        (
            TRIANGLES.replace(b"end_h", b"element e 3\nproperty list int double v\nend_h"),
            "3 rows of 'e' need at least 12 bytes, 0 are left; was the copy cut short",
        ),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, content, message):
    with pytest.raises(FileError, match=rf"wing\.ply: .*{message}"):
        read(tmp_path, content)


def test_a_header_of_thousands_of_properties_is_refused(tmp_path):
    many = "".join(f"property char p{k}\n" for k in range(5000))
    with pytest.raises(FileError, match="more than 4096 elements or properties, which no mesh has"):
        read(tmp_path, SQUARE.replace("element face", f"{many}element face"))
