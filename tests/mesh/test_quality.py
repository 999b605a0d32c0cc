"""Areas, angles, volumes and inverted cells."""

import numpy as np
import pytest
from shapes import CUBE, CUBE_POINTS, cube

from moldline.mesh import io, quality
from moldline.mesh.surface import Surface
from moldline.mesh.volume import NODES_PER_CELL, Cells, VolumeMesh


def mesh(points, kind, *cells, dimension=3):
    starts = NODES_PER_CELL[kind] * np.arange(len(cells) + 1)
    types = np.full(len(cells), kind, np.int32)
    joined = Cells(types, starts, np.ravel(cells).astype(np.int32))
    return VolumeMesh(np.array(points, float), joined, dimension=dimension)


def test_a_cube_has_its_area_volume_and_box():
    assert quality.area(cube()) == pytest.approx(6.0)
    np.testing.assert_array_equal(quality.bounding_box(CUBE_POINTS), [[0, 0, 0], [1, 1, 1]])
    assert np.isnan(quality.bounding_box(np.empty((0, 3)))).all()


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_volume_does_not_depend_on_the_place_but_on_the_side(offset):
    # coordinates of 1e6 are rounded to 1e-10
    assert quality.signed_volume(cube(offset)) == pytest.approx(1.0, rel=1e-9)
    turned = Surface(CUBE_POINTS, CUBE[:, ::-1])
    assert quality.signed_volume(turned) == pytest.approx(-1.0)


def test_angles_are_those_of_known_triangles():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, np.sqrt(0.75), 0], [2, 0, 0]])
    faces = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 0, 1]])
    angles = np.degrees(quality.smallest_angles(Surface(points, faces)))
    np.testing.assert_allclose(angles, [45, 60, 0, 0], atol=1e-12)


def test_degenerate_faces_are_found_at_any_size():
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1e-6, 0]])
    faces = np.array([[0, 1, 2], [0, 1, 1], [0, 1, 3]])
    for scale in (1e-9, 1.0, 1e9):
        assert quality.degenerate_faces(Surface(points * scale, faces)).tolist() == [0, 1]


def test_plane_cells_must_run_counter_clockwise():
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.9, 0.9, 0]]
    triangles = mesh(square, 5, [0, 1, 2], [0, 2, 1], [0, 0, 1], dimension=2)
    assert quality.inverted_cells(triangles).tolist() == [1, 2]
    dart = mesh(square, 9, [0, 1, 2, 3], [1, 2, 3, 4], dimension=2)
    assert quality.inverted_cells(dart).tolist() == [1]


@pytest.mark.parametrize(
    ("kind", "cell"),
    [(10, [0, 1, 3, 4]), (12, range(8)), (13, [0, 1, 3, 4, 5, 7]), (14, [0, 1, 2, 3, 4])],
)
def test_solid_cells_are_right_until_a_node_is_pulled_through(kind, cell):
    cell = list(cell)
    # prisms are written in both senses: most of a mesh's count as right
    good = mesh(CUBE_POINTS, kind, cell, cell, cell)
    assert quality.inverted_cells(good).tolist() == []
    for node in range(len(cell)):
        points = np.concatenate([CUBE_POINTS, 1.5 - 2 * CUBE_POINTS[cell[node]][None]])
        bad = [*cell[:node], 8, *cell[node + 1 :]]
        assert quality.inverted_cells(mesh(points, kind, cell, bad, cell)).tolist() == [1]


@pytest.mark.parametrize(
    "name",
    ["naca0012_inviscid", "rae2822_turbulent_ffd", "brick_tets_ffd", "brick_prism_ffd"],
)
def test_real_meshes_have_no_inverted_cells(data, name):
    assert not len(quality.inverted_cells(io.read(data(f"su2/{name}.su2"))))
