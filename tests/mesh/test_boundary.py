"""Boundaries of volume meshes."""

import numpy as np
import pytest

import moldline as ml
from moldline.errors import GeometryError
from moldline.mesh.boundary import boundary
from moldline.mesh.health import health
from moldline.mesh.volume import Cells


def lines(pairs):
    pairs = np.asarray(pairs)
    return Cells(np.full(len(pairs), 3), np.arange(0, 2 * len(pairs) + 1, 2), pairs.ravel())


def plane(**markers):
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [5, 5, 0], [6, 5, 0]]
    cells = Cells(np.array([9]), np.array([0, 4]), np.arange(4))
    return ml.VolumeMesh(points, cells, {k: lines(v) for k, v in markers.items()}, 2)


def test_a_closed_curve_begins_behind_and_runs_over_the_top():
    mesh = plane(wall=[(0, 1), (3, 0), (2, 1), (2, 3)])
    section, nodes = boundary(mesh)
    assert section.is_closed
    assert nodes.tolist() == [1, 2, 3, 0]
    assert np.array_equal(section.points, np.asarray(mesh.points)[nodes])


def test_an_open_curve_runs_from_end_to_end():
    section, nodes = boundary(plane(wall=[(2, 1), (0, 1), (2, 3)]), ["wall"])
    assert not section.is_closed
    assert nodes.tolist() in ([3, 2, 1, 0], [0, 1, 2, 3])


def test_markers_join_to_one_curve():
    section, nodes = boundary(plane(low=[(0, 1)], high=[(1, 2), (2, 3), (3, 0)]))
    assert section.name == "low+high"
    assert len(nodes) == 4


@pytest.mark.parametrize(
    "pairs", [[(0, 1), (4, 5)], [(0, 1), (1, 2), (1, 3)], [(0, 1), (1, 0), (2, 3), (3, 2)]]
)
def test_what_is_no_single_curve_is_refused(pairs):
    with pytest.raises(GeometryError, match="no single curve"):
        boundary(plane(wall=pairs))


def test_a_marker_that_is_not_there_is_named():
    with pytest.raises(GeometryError, match="no marker named 'tip'; the mesh has: wall"):
        boundary(plane(wall=[(0, 1)]), ["tip"])


def test_the_boundary_of_a_hexahedron_is_closed():
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    points = np.concatenate([corners, corners + np.array([0, 0, 2])])
    sides = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    quads = Cells(np.full(6, 9), np.arange(0, 25, 4), np.ravel(sides))
    halves = {
        "ends": Cells(quads.types[:2], quads.starts[:3], quads.nodes[:8]),
        "sides": Cells(quads.types[2:], quads.starts[:5], quads.nodes[8:]),
    }
    mesh = ml.VolumeMesh(points, Cells(np.array([12]), np.array([0, 8]), np.arange(8)), halves)
    surface, nodes = boundary(mesh)
    assert surface.components == ("ends", "sides")
    assert health(surface).volume == pytest.approx(2.0)
    assert nodes.tolist() == list(range(8))
