"""Pictures: what is drawn, not how it looks."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

import moldline as ml
from moldline.errors import FileError, ParameterError
from moldline.plot import View, cut, draw_surface
from moldline.plot.figure import blank


def test_views_look_along_their_axes():
    np.testing.assert_allclose(View.of("top").project([[1.0, 2.0, 3.0]])[0, 2], 3.0, atol=1e-12)
    np.testing.assert_allclose(View.of("rear").project([[1.0, 2.0, 3.0]])[0], [2, 3, 1], atol=1e-12)
    np.testing.assert_allclose(View.of("iso").axes @ View.of("iso").axes.T, np.eye(3), atol=1e-12)


def test_near_triangles_are_drawn_last():
    points = np.array([[0, 0, z] for z in (0, 5, 2)], float).repeat(3, 0)
    points += np.tile([[0, 0, 0], [1, 0, 0], [0, 1, 0]], (3, 1))
    axes = blank().subplots()
    draw_surface(axes, points, np.arange(9).reshape(3, 3), [1.0, 2.0, 3.0], "top", is_signed=False)
    polygons = next(c for c in axes.collections if isinstance(c, PolyCollection))
    order = [0, 2, 1]  # by height
    colours = polygons.get_facecolor()
    assert len(colours) == 3
    plain = blank().subplots()
    for rank, face in enumerate(order):
        draw_surface(
            plain, points, np.arange(9).reshape(3, 3)[[face]], [face + 1.0], "top", is_signed=False
        )
        assert colours[rank][3] == 1.0


def test_values_of_a_wrong_length_are_refused(ball):
    with pytest.raises(ParameterError, match="values are one per point"):
        draw_surface(blank().subplots(), ball.points, ball.faces, np.zeros(3))


def test_a_cut_through_a_ball_is_its_circle(ball):
    segments = cut(ball.points, ball.faces, "z", 0.1)
    radius = np.linalg.norm(segments[..., :2], axis=-1)
    np.testing.assert_allclose(radius, np.sqrt(1 - 0.01), atol=0.02)  # the ball is a polyhedron
    np.testing.assert_allclose(segments[..., 2], 0.1, atol=1e-12)


def test_pictures_of_every_kind_of_geometry_are_made(ball, tmp_path):
    section = ml.Section(np.array([[1, 0, 0], [0.5, 0.1, 0], [0, 0, 0], [0.5, -0.1, 0]], float))
    for name, geometry in (("ball", ball), ("section", section), ("cloud", ml.Cloud(ball.points))):
        path = tmp_path / f"{name}.png"
        ml.plot.save(ml.plot.of_geometry(geometry), path, dpi=40)
        assert path.read_bytes().startswith(b"\x89PNG")


def test_a_section_is_drawn_before_and_after(tmp_path):
    x = np.linspace(0, 2 * np.pi, 40)
    section = ml.Section(np.stack([np.cos(x), 0.1 * np.sin(x), 0 * x], 1))
    box = ml.Lattice.around(section, (4, 2, 1))
    t = ml.variable("t", size=4)
    case = ml.Pipeline(section, [ml.Stage(box, {t: ml.links.thickness(box, "x", "y")})])
    figure = ml.plot.of_deformation(case, {"t": [0.0, 0.1, 0.1, 0.0]})
    assert len(figure.axes[0].lines) == 2


def test_a_picture_of_an_unknown_kind_is_refused(tmp_path):
    with pytest.raises(FileError, match=r"pictures are written as .png, .svg, .pdf"):
        ml.plot.save(blank(), tmp_path / "x.gif")


def test_a_window_without_pyvista_or_display_says_what_to_do(ball, monkeypatch):
    from moldline.plot import window

    monkeypatch.setattr(window, "TRIAL", "raise SystemExit(139)")
    with pytest.raises(ml.errors.MoldlineError, match="write a picture with -o FILE instead"):
        window.show(ball)
    monkeypatch.setattr(window, "TRIAL", "import no_such_module")
    with pytest.raises(ml.errors.MoldlineError, match="pip install"):
        window.show(ball)
