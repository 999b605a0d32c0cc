"""Sections that planes cut from triangulations."""

import numpy as np
import pytest

from moldline.errors import ParameterError
from moldline.mesh.slices import cut, section


def test_a_cut_through_a_ball_is_one_closed_circle(ball):
    (circle,) = cut(ball.points, ball.faces, "z", 0.1)
    np.testing.assert_array_equal(circle[0], circle[-1])
    radius = np.linalg.norm(circle[:, :2], axis=1)
    np.testing.assert_allclose(radius, np.sqrt(1 - 0.01), atol=0.02)  # the ball is a polyhedron
    np.testing.assert_allclose(circle[:, 2], 0.1, atol=1e-12)
    lengths = np.linalg.norm(np.diff(circle, axis=0), axis=1)
    np.testing.assert_allclose(lengths.sum(), 2 * np.pi * np.sqrt(1 - 0.01), rtol=0.02)


def test_a_cut_through_points_in_the_plane_closes_too(ball):
    assert np.any(ball.points[:, 2] == 0.0)
    (circle,) = cut(ball.points, ball.faces, "z", 0.0)
    np.testing.assert_array_equal(circle[0], circle[-1])


def test_a_cut_through_two_bodies_gives_both(ball):
    points = np.concatenate([ball.points, ball.points + np.array([3.0, 0, 0])])
    faces = np.concatenate([ball.faces, ball.faces + len(ball.points)])
    one, other = cut(points, faces, "y", 0.05)
    assert {round(one[:, 0].mean()), round(other[:, 0].mean())} == {0, 3}


STRIP = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]], float)
STRIP_FACES = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])


def test_a_cut_through_an_open_surface_runs_from_border_to_border():
    (line,) = cut(STRIP, STRIP_FACES, "y", 0.25)
    assert len(line) == 5
    assert sorted([line[0, 0], line[-1, 0]]) == [0.0, 2.0]
    assert np.all(np.diff(line[:, 0]) > 0) or np.all(np.diff(line[:, 0]) < 0)


def test_a_plane_that_misses_the_surface_cuts_nothing(ball):
    assert cut(ball.points, ball.faces, "x", 2.0) == []
    assert section(ball.points, ball.faces, "x", 2.0) == []


@pytest.mark.parametrize("at", [0.0, 1.0])
def test_a_section_at_either_end_is_the_border(at):
    rough = STRIP + 1e-7 * np.array([[0, (-1.0) ** i, 0] for i in range(6)])
    (line,) = section(rough, STRIP_FACES, "y", at)
    np.testing.assert_array_equal(np.unique(line[:, 0]), [0, 1, 2])
    np.testing.assert_array_equal(line[:, 1], at)


def test_an_unknown_axis_is_refused(ball):
    with pytest.raises(ParameterError, match="an axis is x, y or z, got 'w'"):
        cut(ball.points, ball.faces, "w", 0.0)
