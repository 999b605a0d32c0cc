"""Cuts of surfaces, and drawn sections."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from moldline.errors import ParameterError
from moldline.plot import Net, cut, draw_section, section_picture
from moldline.plot.figure import blank


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


def test_a_cut_through_an_open_surface_runs_from_border_to_border():
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]], float)
    faces = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
    (line,) = cut(points, faces, "y", 0.25)
    assert len(line) == 5
    assert sorted([line[0, 0], line[-1, 0]]) == [0.0, 2.0]
    assert np.all(np.diff(line[:, 0]) > 0) or np.all(np.diff(line[:, 0]) < 0)


def test_a_plane_that_misses_the_surface_cuts_nothing(ball):
    assert cut(ball.points, ball.faces, "x", 2.0) == []
    with pytest.raises(ParameterError, match="no section at x = 2; the surface reaches from -1 to"):
        section_picture(ball.points, ball.points, ball.faces, [2.0], axis="x")


def test_an_unknown_axis_is_refused(ball):
    with pytest.raises(ParameterError, match="an axis is x, y or z, got 'w'"):
        cut(ball.points, ball.faces, "w", 0.0)


def test_a_section_is_dashed_at_rest_and_solid_when_deformed():
    axes = blank().subplots()
    curve = np.array([[1, 0, 0], [0, 0.1, 0], [1, 0.1, 0]], float)
    up = np.array([0, 0.2, 0])
    draw_section(axes, curve, curve + up, [Net(np.array([[0, 1], [1, 2]]), curve, curve + up)])
    rest, moved = axes.lines
    assert rest.is_dashed() and not moved.is_dashed()
    np.testing.assert_allclose(moved.get_ydata(), curve[:, 1] + 0.2)
    assert axes.get_aspect() == 1.0
    assert len([c for c in axes.collections if isinstance(c, LineCollection)]) == 2


def test_a_picture_of_cuts_has_a_panel_per_station(ball):
    figure = section_picture(ball.points, 1.1 * ball.points, ball.faces, [0.0, 0.2, 0.4])
    assert [panel.get_title(loc="left") for panel in figure.axes] == ["y = 0", "y = 0.2", "y = 0.4"]
    assert all(len(panel.collections) == 2 for panel in figure.axes)
