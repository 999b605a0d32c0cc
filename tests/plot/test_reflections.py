"""Reflection lines."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from moldline import Surface
from moldline.cli import main
from moldline.plot import of_reflections


def bumpy(kink):
    """A sheet bent along a parabola, with a crease along its middle where asked for."""
    x, y = np.meshgrid(np.linspace(-1, 1, 81), np.linspace(-1, 1, 81), indexing="ij")
    z = 0.3 * y**2 + kink * np.abs(x)
    number = np.arange(81 * 81).reshape(81, 81)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))  # fmt: skip  # noqa: E501
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return Surface(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def stripes(surface):
    """Light or dark of the faces, with their middles, as the picture has them."""
    (axes,) = of_reflections(surface, "top").axes
    (polygons,) = [c for c in axes.collections if isinstance(c, PolyCollection)]
    middles = np.array([path.vertices[:3].mean(axis=0) for path in polygons.get_paths()])
    return middles, polygons.get_facecolor()[:, 0] > 0.3


def test_a_bent_sheet_shows_straight_lines_along_its_generators():
    middles, light = stripes(bumpy(0.0))
    assert 0.2 < light.mean() < 0.8
    rows = np.round(middles[:, 1] / 0.0125)
    alike = [abs(light[rows == row].mean() - 0.5) for row in np.unique(rows)]
    assert np.median(alike) == pytest.approx(0.5, abs=0.05)


def test_a_crease_breaks_the_lines():
    light = stripes(bumpy(0.3))[1]
    smooth = stripes(bumpy(0.0))[1]
    assert np.mean(light != smooth) > 0.1


def test_the_command_draws_them_and_refuses_what_has_no_surface(tmp_path, capsys):
    wing = str(Path(__file__).parents[2] / "examples/data/transport_wing.tri")
    assert main(["plot", wing, "--reflections", "-o", str(tmp_path / "r.png")]) == 0
    assert (tmp_path / "r.png").stat().st_size > 20_000
    (tmp_path / "c.dat").write_text("foil\n1 0\n0.5 0.1\n0 0\n0.5 -0.1\n1 0\n")
    assert main(["plot", str(tmp_path / "c.dat"), "--reflections", "-o", "r.png"]) == 1
    assert "--reflections are a surface's, got a Section" in capsys.readouterr().err
