"""FFD boxes in SU2 meshes, whole and damaged, and the configurations that use them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import broken
from test_fuzz import BASE, bounded, quick, thorough, unpacked_size

from moldline.case.su2_config import convert
from moldline.errors import FileError, MoldlineError
from moldline.mesh.io.su2_boxes import read_boxes

MESH = b"""\
NDIME= 2
NELEM= 2
5 0 1 2
5 0 2 3
NPOIN= 4
0 0
1 0
1 1
0 1
NMARK= 1
MARKER_TAG= wall
MARKER_ELEMS= 4
3 0 1
3 1 2
3 2 3
3 3 0
FFD_NBOX= 2
FFD_NLEVEL= 2
FFD_TAG= outer
FFD_LEVEL= 0
FFD_DEGREE_I= 1
FFD_DEGREE_J= 2
FFD_BLENDING= BEZIER
FFD_PARENTS= 0
FFD_CHILDREN= 1
inner
FFD_CORNER_POINTS= 4
-1 -1
2 -1
2 2
-1 2
FFD_CONTROL_POINTS= 12
0 0 0 -1 -1 -0.5
0 0 1 -1 -1 0.5
0 1 0 -1 0.5 -0.5
0 1 1 -1 0.5 0.5
0 2 0 -1 2 -0.5
0 2 1 -1 2 0.5
1 0 0 2 -1 -0.5
1 0 1 2 -1 0.5
1 1 0 2 0.5 -0.5
1 1 1 2 0.5 0.5
1 2 0 2 2 -0.5
1 2 1 2 2 0.5
FFD_SURFACE_POINTS= 1
wall 2 0.666 0.666 0.5
FFD_TAG= inner
FFD_LEVEL= 1
FFD_DEGREE_I= 1
FFD_DEGREE_J= 1
FFD_BLENDING= BSPLINE_UNIFORM
BSPLINE_ORDER_I= 2
BSPLINE_ORDER_J= 2
FFD_PARENTS= 1
outer
FFD_CHILDREN= 0
FFD_CONTROL_POINTS= 8
1 1 1 1 1 0.5
0 0 0 0 0 -0.5
0 0 1 0 0 0.5
0 1 0 0 1 -0.5
0 1 1 0 1 0.5
1 0 0 1 0 -0.5
1 0 1 1 0 0.5
1 1 0 1 1 -0.5
"""

LONE = MESH[: MESH.index(b"FFD_TAG= inner")]
"""One box, which cases may have."""

CONFIG = b"""\
% a case
MESH_FILENAME= mesh.su2
DV_KIND= FFD_CONTROL_POINT_2D, FFD_THICKNESS_2D
DV_MARKER= ( wall )
DV_PARAM= ( outer, 1, 1, 0.0, 1.0 ); \\
 ( outer, 0 )
DV_VALUE= 0.1, -0.2
FFD_COORD_SYSTEM= CARTESIAN
"""


def test_boxes_are_read_with_all_that_stands_there(tmp_path):
    (tmp_path / "mesh.su2").write_bytes(MESH)
    outer, inner = read_boxes(tmp_path / "mesh.su2")
    assert (outer.name, outer.degrees, outer.parents) == ("outer", (1, 2, 1), ())
    assert (inner.name, inner.degrees, inner.parents) == ("inner", (1, 1, 1), ("outer",))
    np.testing.assert_array_equal(inner.points[1, 1, 1], [1, 1, 0.5])
    np.testing.assert_array_equal(outer.points[1, 2, 0], [2, 2, -0.5])
    assert outer.markers == ("wall",)
    np.testing.assert_array_equal(outer.nodes, [2])
    np.testing.assert_array_equal(outer.coordinates, [[0.666, 0.666, 0.5]])


def test_two_boxes_of_one_name_are_refused(tmp_path):
    (tmp_path / "mesh.su2").write_bytes(MESH.replace(b"FFD_TAG= inner", b"FFD_TAG= outer"))
    with pytest.raises(FileError, match="two boxes are named 'outer'"):
        read_boxes(tmp_path / "mesh.su2")


def boxes_or_refused(folder, damaged):
    path = folder / "mesh.su2"
    path.write_bytes(damaged)
    with bounded(unpacked_size(damaged), BASE):
        try:
            for box in read_boxes(path):
                assert np.isfinite(box.points).all()
                assert min(box.degrees) >= 0
        except FileError as error:
            assert str(error).startswith(f"{path}: ")


def case_or_refused(folder, mesh, config):
    (folder / "mesh.su2").write_bytes(mesh)
    (folder / "case.cfg").write_bytes(config)
    try:
        convert(folder / "case.cfg", folder / "case.toml")
    except MoldlineError as error:
        assert len(str(error)) > 15


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("boxes")


@quick
@given(damaged=broken([MESH]))
def test_damaged_boxes_are_refused_or_valid(folder, damaged):
    boxes_or_refused(folder, damaged)


@quick
@given(mesh=st.one_of(st.just(LONE), broken([LONE])), config=broken([CONFIG]))
def test_damaged_configurations_are_refused_or_converted(folder, mesh, config):
    case_or_refused(folder, mesh, config)


@pytest.mark.slow
@thorough
@given(mesh=broken([MESH, LONE]), config=broken([CONFIG]))
def test_ten_thousand_damaged_cases_are_refused_or_converted(folder, mesh, config):
    boxes_or_refused(folder, mesh)
    case_or_refused(folder, mesh, config)
