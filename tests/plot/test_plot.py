"""Pictures: what is drawn, not how it looks."""

import struct
import sys

import numpy as np
import pytest

import moldline as ml
from moldline.errors import FileError, ParameterError
from moldline.mesh.volume import Cells
from moldline.plot import View, window
from moldline.plot.figure import blank


def test_views_look_along_their_axes():
    np.testing.assert_allclose(View.of("top").project([[1.0, 2.0, 3.0]])[0, 2], 3.0, atol=1e-12)
    np.testing.assert_allclose(View.of("rear").project([[1.0, 2.0, 3.0]])[0], [2, 3, 1], atol=1e-12)
    np.testing.assert_allclose(View.of("iso").axes @ View.of("iso").axes.T, np.eye(3), atol=1e-12)


def test_a_view_of_an_unknown_name_is_refused():
    with pytest.raises(ParameterError, match="no view named 'left'; there is: iso, top"):
        View.of("left")


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


def test_a_saved_picture_has_the_size_asked_for(tmp_path):
    ml.plot.save(blank(4.0, 3.0), tmp_path / "x.png", dpi=50)
    header = (tmp_path / "x.png").read_bytes()[:24]
    assert header[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", header[16:]) == (200, 150)
    assert [path.name for path in tmp_path.iterdir()] == ["x.png"]


def test_pictures_are_also_written_as_drawings(ball, tmp_path):
    figure = ml.plot.of_geometry(ball)
    for name, start in (("x.svg", b"<?xml"), ("x.pdf", b"%PDF")):
        ml.plot.save(figure, tmp_path / name, dpi=40)
        assert (tmp_path / name).read_bytes().startswith(start)


def test_a_picture_that_cannot_be_written_says_why(tmp_path):
    with pytest.raises(FileError, match="no such folder; make it first"):
        ml.plot.save(blank(), tmp_path / "missing" / "x.png")


def test_a_picture_of_an_unknown_kind_is_refused(tmp_path):
    with pytest.raises(FileError, match=r"pictures are written as .png, .svg, .pdf"):
        ml.plot.save(blank(), tmp_path / "x.gif")


def test_a_window_without_pyvista_or_display_says_what_to_do(ball, monkeypatch):
    monkeypatch.setattr(window, "TRIAL", "raise SystemExit(139)")
    with pytest.raises(ml.errors.MoldlineError, match="write a picture with -o FILE instead"):
        window.show(ball)
    monkeypatch.setattr(window, "TRIAL", "import no_such_module")
    with pytest.raises(ml.errors.MoldlineError, match="pip install"):
        window.show(ball)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only X11 can lack a display")
def test_a_window_without_a_display_says_what_to_do(ball, monkeypatch):
    monkeypatch.setattr(window, "TRIAL", "")
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(ml.errors.MoldlineError, match="write a picture with -o FILE instead"):
        window.show(ball)


def test_of_a_solid_mesh_the_lines_of_its_boundary_are_drawn():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    tetra = Cells(np.array([10]), np.array([0, 4]), np.arange(4))
    base = Cells(np.array([5]), np.array([0, 3]), np.arange(3))
    whole = ml.plot.of_geometry(ml.VolumeMesh(points, tetra))
    skin = ml.plot.of_geometry(ml.VolumeMesh(points, tetra, {"base": base}))
    assert len(whole.axes[0].collections[0].get_segments()) == 6
    assert len(skin.axes[0].collections[0].get_segments()) == 3
