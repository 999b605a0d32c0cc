"""Drawn surfaces and lattices: which triangles, in which order, in which colours."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_rgb

from moldline.deformers.net import grid_lines
from moldline.errors import ParameterError
from moldline.plot import before_and_after, draw_net, draw_surface, sensitivity_map
from moldline.plot.figure import blank
from moldline.plot.nets import RED

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def stacked(*heights):
    """Level triangles, one over the other."""
    points = np.concatenate([TRIANGLE + np.array([0, 0, height]) for height in heights])
    return points, np.arange(len(points)).reshape(-1, 3)


def drawn(kind, *arguments, **named):
    """What `draw_surface` or `draw_net` adds to empty axes."""
    axes = blank().subplots()
    (draw_surface if kind is PolyCollection else draw_net)(axes, *arguments, **named)
    return [found for found in axes.collections if isinstance(found, kind)]


def box(*shape):
    """Lines and control points of a unit box."""
    grid = np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij")
    return grid_lines(np.arange(np.prod(shape)).reshape(shape)), np.stack(grid, -1).reshape(-1, 3)


def test_near_triangles_are_drawn_last():
    points, faces = stacked(0.0, 5.0, 2.0)
    values, order = np.array([1.0, 2.0, 3.0]), [0, 2, 1]
    axes = blank().subplots()
    scale = draw_surface(axes, points, faces, values, "top", colours="viridis", is_signed=False)
    shade = axes.collections[0].get_facecolor()[:, :3] / scale.to_rgba(values[order])[:, :3]
    np.testing.assert_allclose(shade, shade[0, 0])  # level triangles are equally bright


def test_of_a_closed_surface_only_the_side_towards_the_eye_is_drawn(ball):
    for faces in (ball.faces, ball.faces[:, ::-1]):  # inside out, the same side is seen
        (polygons,) = drawn(PolyCollection, ball.points, faces, view="top")
        inside = np.array([path.vertices[:3].mean(axis=0) for path in polygons.get_paths()])
        assert len(inside) == len(faces) // 2
        below = ball.points[ball.faces].mean(axis=1)
        seen = below[below[:, 2] > 0][:, [0, 1]]
        assert {tuple(p) for p in inside.round(6) + 0.0} == {tuple(p) for p in seen.round(6) + 0.0}


def test_of_an_open_surface_all_triangles_are_drawn(ball):
    (polygons,) = drawn(PolyCollection, ball.points, ball.faces[1:], view="top")
    assert len(polygons.get_paths()) == len(ball.faces) - 1


def test_signed_values_are_coloured_symmetrically_about_zero(ball):
    axes = blank().subplots()
    scale = draw_surface(axes, ball.points, ball.faces, ball.points[:, 2] + 1.0)
    assert (scale.norm.vmin, scale.norm.vmax) == (-2.0, 2.0)
    scale = draw_surface(axes, ball.points, ball.faces, ball.points[:, 2] + 1.0, is_signed=False)
    assert (scale.norm.vmin, scale.norm.vmax) == (0.0, 2.0)


def test_positive_values_are_red_and_negative_ones_blue():
    points, faces = stacked(0.0, 1.0)
    (polygons,) = drawn(PolyCollection, points, faces, np.array([1.0, -1.0]), "top")
    low, high = polygons.get_facecolor()[:, :3]
    assert low[0] > 2 * low[2]
    assert high[2] > 2 * high[0]


def test_values_per_point_colour_a_face_by_their_mean():
    points, faces = stacked(0.0)
    axes = blank().subplots()
    scale = draw_surface(axes, points, faces, np.array([0.0, 0.0, 3.0]), "top")
    shade = axes.collections[0].get_facecolor()[0, :3] / scale.to_rgba(1.0)[:3]
    np.testing.assert_allclose(shade, shade[0])


def test_triangles_that_face_the_light_are_brighter():
    points = np.concatenate([TRIANGLE, TRIANGLE + np.array([2, 0, 0])])
    points[4, 2] = 1.0  # the second leans to the left, where the light is
    (polygons,) = drawn(PolyCollection, points, np.arange(6).reshape(2, 3), view="top")
    level, leaning = polygons.get_facecolor()[:, :3]
    assert np.all(leaning > level)


def test_a_colour_bar_carries_the_label(ball):
    figure = sensitivity_map(ball.points, ball.faces, ball.points[:, 0], "dz / d t [m per m]")
    assert figure.axes[1].get_ylabel() == "dz / d t [m per m]"


def test_values_of_a_wrong_length_are_refused(ball):
    with pytest.raises(ParameterError, match=r"per point \(\d+\) or per face \(2048\), got \(3,\)"):
        draw_surface(blank().subplots(), ball.points, ball.faces, np.zeros(3))


def test_a_lattice_has_a_line_between_neighbours_along_each_axis():
    (lines,) = drawn(LineCollection, *box(4, 3, 2))
    assert len(lines.get_segments()) == 3 * (3 * 2) + 2 * (4 * 2) + 1 * (4 * 3)
    (flat,) = drawn(LineCollection, *box(4, 3, 1))
    assert len(flat.get_segments()) == 3 * 3 + 2 * 4


def test_moved_controls_are_red_over_the_dashed_lattice_at_rest():
    lines, rest = box(2, 2, 2)
    moved = rest + np.array([0, 0, 1])
    dashed, solid = drawn(LineCollection, lines, rest, moved, view="side")
    assert dashed.get_linestyle()[0][1] is not None
    assert solid.get_linestyle()[0][1] is None
    (controls,) = drawn(PathCollection, lines, rest, moved, view="side")
    assert controls.get_offsets()[:, 1].min() == pytest.approx(1.0)
    np.testing.assert_allclose(controls.get_facecolor()[:, :3], [to_rgb(RED)] * 8)


def test_what_is_farther_from_the_eye_is_paler():
    (controls,) = drawn(PathCollection, *box(2, 2, 2), view="top")
    alpha = controls.get_facecolor()[:, 3].reshape(2, 2, 2)
    assert np.all(alpha[..., 1] > alpha[..., 0])


def test_highlighted_controls_are_larger():
    every, chosen = drawn(PathCollection, *box(3, 2, 2), highlighted=[5, 10])
    assert len(every.get_offsets()) == 12
    assert len(chosen.get_offsets()) == 2
    assert chosen.get_sizes()[0] > 4 * every.get_sizes()[0]


def test_before_and_after_have_one_scale(ball):
    figure = before_and_after(ball.points, 2 * ball.points, ball.faces)
    figure.draw_without_rendering()
    left, right = figure.axes
    assert left.get_xlim() == right.get_xlim()
    assert left.get_ylim() == right.get_ylim()
