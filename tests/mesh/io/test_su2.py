"""SU2 meshes."""

import numpy as np
import pytest
from conftest import hard_points, same_bits

from moldline.errors import FileError
from moldline.mesh.io import su2
from moldline.mesh.volume import NODES_PER_CELL, Cells, VolumeMesh

SMALL = """% made by hand
NDIME= 2
NELEM= 2   % two kinds
5 0 1 2 0

9 0 2 3 4 1
NPOIN= 5 4
0 0 0
1 0 1
1 1 2
0 1 3
0 0.5 4
NMARK= 1
MARKER_TAG= wall
MARKER_ELEMS= 1
3 0 1
FFD_NBOX= 1
FFD_CORNER_POINTS= 1
 0.5\t0.5   % kept
"""
EXTRA = SMALL[SMALL.index("FFD_NBOX") :]


def read(tmp_path, content):
    path = tmp_path / "mesh.su2"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return su2.read(path)


def random_cells(kinds, count, points):
    rng = np.random.default_rng(3)
    types = rng.choice(kinds, count).astype(np.int32)
    starts = np.concatenate([[0], np.cumsum([NODES_PER_CELL[k] for k in types.tolist()])])
    return Cells(types, starts, rng.integers(0, points, starts[-1]).astype(np.int32))


@pytest.mark.parametrize(("dimension", "kinds"), [(2, [5, 9]), (3, [10, 12, 13, 14])])
def test_what_is_written_reads_back_to_the_bit(tmp_path, dimension, kinds):
    points = hard_points(20)
    points[:, dimension:] = 0.0
    markers = {name: random_cells([3], 7, 20) for name in ("wall", "far field", "ü")}
    mesh = VolumeMesh(points, random_cells(kinds, 40, 20), markers, dimension, "X= 1\n\xff\n")
    su2.write(tmp_path / "a.su2", mesh)
    read = su2.read(tmp_path / "a.su2")
    assert same_bits(read.points, mesh.points)
    assert read.dimension == dimension
    assert read.extra == mesh.extra
    assert list(read.markers) == list(markers)
    for one, other in [(read.cells, mesh.cells), (read.markers["ü"], markers["ü"])]:
        assert all(map(same_bits, one, other))


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_comments_blank_lines_and_numbers_of_rows_are_skipped(tmp_path, line_end):
    mesh = read(tmp_path, SMALL.replace("\n", line_end))
    np.testing.assert_array_equal(mesh.points[4], [0, 0.5, 0])
    assert mesh.cells.types.tolist() == [5, 9]
    assert mesh.cells.nodes.tolist() == [0, 1, 2, 0, 2, 3, 4]
    assert mesh.markers["wall"].nodes.tolist() == [0, 1]


def test_other_sections_survive_word_for_word(tmp_path):
    mesh = read(tmp_path, SMALL)
    assert mesh.extra == EXTRA
    su2.write(tmp_path / "again.su2", mesh)
    assert (tmp_path / "again.su2").read_text().endswith(EXTRA)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("NDIME= 2", "NDIME= 4", "line 2: NDIME= 4, expected 2 or 3"),
        ("NDIME= 2", "NDIME= two", "line 2: found 'NDIME= two', expected a whole number"),
        ("NDIME= 2\n", "", "NDIME= is missing; was the copy cut short"),
        ("NDIME= 2", "NZONE= 2\nNDIME= 2", "line 2: the mesh has several zones; split it"),
        ("NDIME= 2", "NDIME= 2\nNDIME= 3", "line 3: a second NDIME="),
        ("% made by hand", "made by hand", "found 'made', expected a keyword such as 'NDIME='"),
        ("5 0 1 2 0\n", "", "line 3: NELEM= 2, but 1 rows follow; was the copy cut short"),
        ("NELEM= 2", "NELEM= 999999999", "NELEM= 999999999, but 2 rows follow"),
        ("5 0 1 2 0", "5 0 1 9 0", "line 4 refers to 9, expected a whole number from 0 to 4"),
        ("5 0 1 2 0", "5 0 1 -2 0", "line 4 refers to -2"),
        ("5 0 1 2 0", "5 0 1", "line 4: a cell of type 5 and 2 numbers, expected 3 nodes"),
        ("5 0 1 2 0", "6 0 1 2 0", "line 4: a cell of type 6 .*, expected a type of"),
        ("1 1 2\n", "1 x 2\n", "line 10: found 'x', expected a number"),
        ("1 1 2\n", "1 inf 2\n", "line 10: found 'inf', expected a finite number"),
        ("1 1 2\n", "1\n", "line 10: a point of 1 numbers, expected 2"),
        ("1 1 2\n", "2*1 2\n", "line 7 or later holds repeat counts"),
        ("NMARK= 1", "NMARK= 2", "line 13: NMARK= 2, but 1 markers follow"),
        ("MARKER_TAG= wall\n", "", "line 14: MARKER_ELEMS= without MARKER_TAG="),
        (EXTRA, SMALL[SMALL.index("MARKER_TAG") :], "line 17: a second marker 'wall'"),
        (SMALL, "", "the file is empty"),
        (SMALL, "\n", "found 'nothing', expected a keyword"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, old, new, message):
    with pytest.raises(FileError, match=message):
        read(tmp_path, SMALL.replace(old, new, 1))


@pytest.mark.parametrize(
    ("name", "points", "cells", "markers", "extra"),
    [
        ("naca0012_inviscid", 5233, 10216, {"airfoil": 200, "farfield": 50}, ""),
        ("rae2822_turbulent_ffd", 13937, 22842, {"AIRFOIL": 192, "FARFIELD": 40}, "NPERIODIC"),
        ("brick_tets_ffd", 11703, 59156, {"x_m": 722, "z_p": 1482}, "NPERIODIC"),
        ("brick_prism_ffd", 16800, 29640, {"x_m": 380, "z_p": 1482}, "NPERIODIC"),
    ],
)
def test_real_files_survive_a_round_trip(data, tmp_path, name, points, cells, markers, extra):
    mesh = su2.read(data(f"su2/{name}.su2"))
    assert (len(mesh.points), len(mesh.cells.types)) == (points, cells)
    assert markers.items() <= {tag: len(part.types) for tag, part in mesh.markers.items()}.items()
    assert mesh.extra.startswith(extra)
    su2.write(tmp_path / "a.su2", mesh)
    again = su2.read(tmp_path / "a.su2")
    assert same_bits(again.points, mesh.points)
    assert all(map(same_bits, again.cells, mesh.cells))
    assert again.extra == mesh.extra
