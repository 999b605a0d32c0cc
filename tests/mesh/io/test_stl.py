"""STL in both forms."""

import numpy as np
import pytest
from conftest import same_bits

from moldline.errors import FileError
from moldline.mesh.io import stl
from moldline.mesh.surface import Surface

FACET = (
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
)
SMALL = f"solid wing\n{FACET}endsolid wing\n"


def read(tmp_path, content, **options):
    path = tmp_path / "wing.stl"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return stl.read(path, **options)


def tetrahedron(components=("1",), tags=None):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.1, 0.1, 1 / 3]])
    return Surface(points, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), tags, components)


def test_text_keeps_coordinates_and_components_to_the_bit(tmp_path, surface):
    named = Surface(surface.points[:29], surface.faces % 29, surface.tags, ("a b", "ü", "c"))
    with np.errstate(all="ignore"):
        stl.write(tmp_path / "a.stl", named)
    read = stl.read(tmp_path / "a.stl")
    assert same_bits(read.points[read.faces], named.points[named.faces])
    assert same_bits(read.tags, named.tags)
    assert read.components == named.components


@pytest.mark.parametrize("binary", [False, True])
def test_corners_are_welded(tmp_path, binary):
    stl.write(tmp_path / "a.stl", tetrahedron(), binary=binary)
    read = stl.read(tmp_path / "a.stl")
    assert (len(read.points), len(read.faces)) == (4, 4)
    np.testing.assert_allclose(read.points[read.faces[0]], [[0, 0, 0], [0, 1, 0], [1, 0, 0]])


def test_a_tolerance_welds_what_lies_close(tmp_path):
    near = SMALL.replace("endsolid wing", FACET.replace("1 0 0", "1.001 0 0") + "endsolid wing")
    assert len(read(tmp_path, near).points) == 4
    welded = read(tmp_path, near, tolerance=0.01)
    assert 3 * len(welded.faces) - len(welded.points) == 3
    np.testing.assert_array_equal(welded.points[1], [1, 0, 0])


def test_a_binary_file_may_begin_with_solid(tmp_path):
    stl.write(tmp_path / "a.stl", tetrahedron(), binary=True)
    whole = (tmp_path / "a.stl").read_bytes()
    assert len(read(tmp_path, b"solid wing".ljust(80) + whole[80:]).faces) == 4


def test_solids_become_components(tmp_path):
    both = read(tmp_path, SMALL + SMALL.replace("wing", "body"))
    assert both.components == ("wing", "body")
    assert both.tags.tolist() == [0, 1]
    assert len(both.points) == 3


def test_keywords_may_be_upper_case_and_lines_end_in_any_way(tmp_path):
    assert len(read(tmp_path, SMALL.upper().replace("\n", "\r\n")).faces) == 1
    assert len(read(tmp_path, SMALL.replace("\n", "\r")).faces) == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (SMALL[:60], "line 2: found 'facet normal .*', expected a whole facet or endsolid; was"),
        (SMALL[:-14], "line 9: found 'the end of the file', expected a whole facet or endsolid"),
        (SMALL.replace("vertex 0 1 0\n", ""), "line 2: found 'facet"),
        (SMALL.replace("1 0 0", "1 0 x"), "found 'x', expected a number"),
        (SMALL.replace("1 0 0", "1 0 nan"), "found 'nan', expected a finite number"),
        (SMALL.replace("1 0 0", "1 0 2*0"), "holds repeat counts"),
        (SMALL + "rubbish", "line 10: found 'rubbish', expected a whole solid"),
        (b"\0" * 83, "neither a text that begins with 'solid' nor the 84 bytes"),
        (b"\0" * 80 + b"\2\0\0\0" + b"\0" * 50, "2 triangles need 184 bytes, the file has 134"),
        (b"\0" * 80 + b"\xff\xff\xff\xff" + b"\0" * 50, "4294967295 triangles need"),
        (b"\0" * 80 + b"\1\0\0\0" + b"\xff" * 50, "triangle 1 has the corner .*nan"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, content, message):
    with pytest.raises(FileError, match=message):
        read(tmp_path, content)


@pytest.mark.parametrize(
    ("name", "points", "faces"),
    [
        ("pygeo/bwb.stl", 2234, 4464),
        ("pygeo/c172.stl", 1830, 3627),
        ("su2/onera_m6_surface.stl", 1453, 2816),
    ],
)
def test_real_files_are_read(data, name, points, faces):
    surface = stl.read(data(name))
    assert (len(surface.points), len(surface.faces)) == (points, faces)
