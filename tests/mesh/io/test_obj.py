"""Wavefront OBJ."""

import numpy as np
import pytest
from conftest import same_bits

from moldline.errors import FileError
from moldline.mesh.io import obj
from moldline.mesh.surface import Surface

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def read(tmp_path, content):
    path = tmp_path / "wing.obj"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return obj.read(path)


def test_what_is_written_reads_back_to_the_bit(tmp_path, surface):
    named = Surface(surface.points, surface.faces, surface.tags, ("a b", "ü", "c"))
    obj.write(tmp_path / "a.obj", named)
    read = obj.read(tmp_path / "a.obj")
    assert same_bits(read.points, named.points)
    assert same_bits(read.faces, named.faces)
    assert same_bits(read.tags, named.tags)
    assert read.components == named.components


def test_polygons_become_fans(tmp_path):
    assert read(tmp_path, SQUARE + "f 1 2 3 4\n").faces.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("first", range(6))
def test_a_polygon_that_is_not_convex_is_cut_inside_itself(tmp_path, first):
    """An L, from any corner on; a fan leaves it from all but two."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    points = "".join(f"v {x} {y} 0\n" for x, y in outline)
    loop = " ".join(str((first + i) % 6 + 1) for i in range(6))
    faces = read(tmp_path, f"{points}f 1 2 3\nf {loop}\nf 1 2 3 4\n").faces
    assert len(faces) == 1 + 4 + 2
    a, b, c = (outline[faces[1:5, k]] for k in range(3))
    areas = np.linalg.det(np.stack([b - a, c - a], axis=1)) / 2
    assert areas.min() > 0 and areas.sum() == pytest.approx(3.0)


@pytest.mark.parametrize("face", ["1/1/1 2/2/2 3/3/3", "1//1 2//1 3//1", "1/4 2/4 3/4", "-4 -3 -2"])
def test_corners_are_written_in_many_ways(tmp_path, face):
    assert read(tmp_path, f"{SQUARE}vt 0 0\nvn 0 0 1\nf {face}\n").faces.tolist() == [[0, 1, 2]]


def test_numbers_count_back_from_the_last_point_so_far(tmp_path):
    assert read(tmp_path, f"{SQUARE}f -4 -3 -2\nv 9 9 9\nf -1 1 2").faces[1].tolist() == [4, 0, 1]


def test_groups_become_components_and_objects_where_there_are_none(tmp_path):
    grouped = f"{SQUARE}o plane\ng wing\nf 1 2 3\ng body\nf 1 3 4\ng wing\nf 1 2 4\n"
    assert read(tmp_path, grouped).components == ("wing", "body")
    assert read(tmp_path, grouped).tags.tolist() == [0, 1, 0]
    assert read(tmp_path, f"{SQUARE}o plane\nf 1 2 3\n").components == ("plane",)


def test_tabs_comments_colours_and_continued_lines_are_understood(tmp_path):
    content = "# made by hand\nv\t0 0 0 0.5 0.5 0.5\nv 1 0 \\\n0\nv 0 1 0 1\r\nf\t1 2 3\n"
    np.testing.assert_array_equal(read(tmp_path, content).points[1], [1, 0, 0])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (SQUARE + "f 1 2 5\n", "line 5: the face needs numbers of points from 1 to 4, or back"),
        (SQUARE + "f 1 2 0\n", "line 5: the face"),
        (SQUARE + "f 1 2 -5\n", "line 5: the face"),
        (SQUARE + "f 1 2\n", "line 5: found the face '1 2', expected three or more numbers"),
        (SQUARE + "f 1 2 x\n", "line 5: found the face '1 2 x', expected three or more"),
        (SQUARE + "f 1 2 1_0\n", "line 5: found the face '1 2 1_0', expected three or more"),
        (SQUARE.replace("v 1 1", "w 1 1"), "line 3: found 'w', which is no keyword of OBJ"),
        (SQUARE.replace("1 1 0", "1 1 o"), "line 3: found 'o', expected a number"),
        (SQUARE.replace("1 1 0", "1 1 inf"), "line 3: found 'inf', expected a finite number"),
        (SQUARE.replace("1 1 0", "1 1"), "line 3: 'v' has 2 numbers, expected at least 3"),
        (SQUARE.replace("v 1 1 0", "v"), "line 3: found 'nothing', expected a number"),
        ("f 1 2 3\n", "no line begins with 'v'"),
        (b"\xff\0\xfe", "line 1: found .*, which is no keyword of OBJ"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, content, message):
    with pytest.raises(FileError, match=message):
        read(tmp_path, content)
