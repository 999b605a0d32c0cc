"""Triangles between rows, and the weights of stations in rows."""

import numpy as np
import pytest

from moldline.mesh import topology
from moldline.modelers.body_loft import body_weights
from moldline.modelers.loft import loft_weights, row_places
from moldline.modelers.skin import between_lines, between_rows, mirrored


def area(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def test_a_grid_is_covered_once_along_its_shorter_diagonals():
    x, y = np.meshgrid(np.arange(4.0), np.arange(3.0))
    points = np.stack([x + 0.4 * y, y], axis=-1).reshape(-1, 2)
    index = np.arange(12).reshape(3, 4)
    faces = between_rows(index, points)
    np.testing.assert_allclose(area(points, faces), 0.5)
    edges = {tuple(sorted(e)) for f in faces.tolist() for e in zip(f, f[1:] + f[:1], strict=True)}
    assert (1, 4) in edges  # of the sheared cell 0, 1, 5, 4
    assert (0, 5) not in edges


@pytest.mark.parametrize(("one", "other"), [(7, 4), (2, 9), (1, 5), (6, 6)])
def test_lines_of_other_numbers_of_points_are_joined_without_gap(one, other):
    x = np.concatenate([np.linspace(0, 1, one), np.linspace(0, 1, other)])
    points = np.stack([x, np.repeat([0.0, 1.0], [one, other])], axis=1)
    faces = between_lines(np.arange(one), one + np.arange(other))
    assert len(faces) == one + other - 2
    assert np.all(area(points, faces) > 0)


def test_lines_that_share_their_ends_leave_no_empty_triangles():
    faces = between_lines(np.array([0, 1, 2, 3]), np.array([0, 4, 3]))
    assert len(faces) == 3
    assert all(len(set(face)) == 3 for face in faces.tolist())


def test_a_mirror_image_closes_what_is_open_at_the_mirror():
    faces = np.array([[0, 1, 2]])
    image, moved = mirrored(faces, np.array([True, True, False]))
    np.testing.assert_array_equal(image, [[3, 1, 0]])
    np.testing.assert_array_equal(moved, [2])
    assert len(topology.edges(np.concatenate([faces, image])).misoriented) == 0


def test_rows_stand_at_stations_and_crowd_where_they_are_told_to():
    stations = np.array([0.0, 0.3, 1.0])
    rows = row_places(stations, 40, 1.0, (False, True))
    assert len(rows) == 41
    assert set(stations) <= set(rows)
    steps = np.diff(rows)
    assert np.all(steps > 0)
    assert steps[0] > 10 * steps[-1]
    even = row_places(np.array([0.0, 1.0]), 8, 0.0)
    np.testing.assert_allclose(even, np.linspace(0, 1, 9), atol=1e-12)


@pytest.mark.parametrize("loft", ["linear", "cubic", "bspline"])
def test_weights_sum_to_one_and_carry_what_is_straight(loft):
    stations = np.array([0.0, 0.2, 0.5, 0.8, 1.0])
    rows = np.linspace(0, 1, 33)
    weights = loft_weights(stations, rows, loft)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(weights[[0, -1]], np.eye(5)[[0, -1]])
    slope = loft_weights(stations, rows[-1:], loft, 1)
    near = loft_weights(stations, np.array([1.0, 1.0 - 1e-6]), loft)
    np.testing.assert_allclose((near[0] - near[1]) / 1e-6, slope[0], atol=1e-3)
    if loft != "bspline":
        np.testing.assert_allclose(weights @ stations, rows, atol=1e-14)


@pytest.mark.parametrize("loft", ["linear", "cubic", "bspline"])
def test_at_a_round_end_places_stand_still_while_sizes_grow(loft):
    stations = np.array([0.0, 0.3, 0.7, 1.0])
    step = 1e-5
    even, odd = body_weights(stations, np.array([0.0, step]), loft, (True, True))
    place, size = np.array([0.0, 0.2, 0.6, 1.0]), np.array([0.0, 0.2, 0.2, 0.0])
    assert (even @ place)[1] < 1e-3 * step
    assert (odd @ size)[1] > 0.2 * step
