"""Plane outlines are triangulated between given points."""

import numpy as np
import pytest

from moldline.errors import GeometryError
from moldline.mesh.planar import triangulated

ANGLES = 2 * np.pi * np.arange(20) / 20


def test_points_inside_become_corners_of_delaunays_triangles():
    rim = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
    inner = np.random.default_rng(0).uniform(-0.6, 0.6, (30, 2))
    points = np.concatenate([rim, inner])
    faces = triangulated(points, [np.arange(20)], range(20, 50))
    assert len(faces) == 20 + 2 * 30 - 2  # Euler: of r points around and i inside r + 2 i - 2
    np.testing.assert_array_equal(np.unique(faces), np.arange(50))
    a, b, c = (points[faces[:, k]] for k in range(3))
    first, second = b - a, c - a
    assert np.all(first[:, 0] * second[:, 1] > first[:, 1] * second[:, 0])
    for p, q, r in zip(a, b, c, strict=True):  # no point lies in the circle around any of them
        rows = [2 * (q - p), 2 * (r - p)]
        centre = np.linalg.solve(rows, [q @ q - p @ p, r @ r - p @ p])
        assert np.linalg.norm(points - centre, axis=1).min() > np.linalg.norm(p - centre) - 1e-9


def test_a_point_on_an_inner_edge_is_taken_too():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]])
    faces = triangulated(square, [np.arange(4)], [4])
    assert len(faces) == 4
    corners = square[faces]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    np.testing.assert_allclose(areas, 0.25)


def test_a_point_outside_is_refused():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.5]])
    with pytest.raises(GeometryError, match="lies inside of no outline"):
        triangulated(square, [np.arange(4)], [4])
