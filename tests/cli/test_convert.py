"""`moldline convert` between kinds of geometry."""

import re

import numpy as np
import pytest

import moldline as ml
from moldline.cli import main
from moldline.mesh import Grid, quality
from moldline.mesh.health import health
from moldline.mesh.io import plot3d


@pytest.fixture
def half_box(tmp_path):
    """Five patches of a box from y = 0 to 1, its side at y = 0 open."""
    u, v = (np.array(w, float).ravel() for w in np.meshgrid([0, 1, 2], [0, 1, 2], indexing="ij"))
    zero = 0 * u
    sides = [(u, zero + 2, v), (zero, u, v), (zero + 2, u, v), (u, v, zero), (u, v, zero + 2)]
    blocks = [np.stack(side, axis=1) / 2 for side in sides]
    plot3d.write(tmp_path / "half.xyz", Grid(np.concatenate(blocks), ((3, 3, 1),) * 5))
    return str(tmp_path / "half.xyz")


def test_patches_become_a_closed_surface_and_the_cap_goes_again(half_box, tmp_path, capsys):
    target = str(tmp_path / "half.vtp")
    named = ["--component", "tip=1", "--component", "sides=2-3,4-5"]
    units = ["--from-units", "in", "--to-units", "m"]
    assert main(["convert", half_box, target, *named, *units, "--cap", "y"]) == 0
    told = capsys.readouterr().out
    assert "half.vtp: Surface of 25 points" in told
    assert "20 points welded across gaps of up to 0" in told
    assert "openings left: 1, of 8 points" in told
    assert "capped at y = 0: 1 opening of 8 points by 6 faces" in told
    assert "components: 1 tip, 2 sides, 3 symmetry" in told
    surface = ml.read(target)
    assert health(surface).is_sound
    assert quality.signed_volume(surface) == pytest.approx(0.0254**3)
    opened = str(tmp_path / "open.vtp")
    assert main(["convert", target, opened, "--uncap"]) == 0
    assert "component symmetry dropped" in capsys.readouterr().out
    assert ml.read(opened).components == ("tip", "sides")
    assert main(["convert", opened, target, "--cap", "y=0", "--tag", "plane"]) == 0
    assert ml.read(target).components == ("tip", "sides", "plane")


def test_patches_become_step_in_a_stated_unit(half_box, tmp_path, capsys):
    pytest.importorskip("OCP", reason="OpenCascade is optional: pip install 'moldline[step]'")
    target = str(tmp_path / "half.step")
    units = ["--from-units", "in", "--to-units", "mm"]
    arguments = ["convert", half_box, target, *units, "--tolerance", "1e-3"]
    assert main([*arguments, "--component", "tip=1"]) == 0
    told = capsys.readouterr().out
    assert "half.step: 5 B-spline surfaces with 45 poles for 45 points" in told
    assert re.search(r"largest deviation \S+ mm in block \d", told)
    text = (tmp_path / "half.step").read_text()
    assert "ADVANCED_FACE('tip 1'" in text and "25.4" in text
    assert ml.read(half_box).points.max() == 1.0


@pytest.mark.parametrize(
    ("target", "arguments", "message"),
    [
        ("a.vtp", ["--component", "wing"], "'wing': expected NAME=BLOCKS, e.g. wing=3-6,17"),
        ("a.vtp", ["--component", "wing=1-x"], "'wing=1-x': expected NAME=BLOCKS"),
        ("a.vtp", ["--component", "wing=1-2-3"], "'wing=1-2-3': expected NAME=BLOCKS"),
        ("a.vtp", ["--component", "wing=5-6"], "block 6; the grid has blocks 1 to 5"),
        ("a.vtp", ["--component", "wing=1-99999999999"], "expected NAME=BLOCKS"),
        ("a.vtp", ["--component", "wing=4-3"], "component 'wing' names no block"),
        ("a.vtp", ["--cap", "y=here"], "'y=here': expected a place such as y=0.5"),
        ("a.vtp", ["--cap", "q"], "a cap's plane is x, y or z, got 'q'"),
        ("a.vtp", ["--cap", "x=9"], "no opening lies in the plane x = 9"),
        ("a.vtp", ["--uncap"], "no component named 'symmetry'; the surface has: 1, 2, 3, 4, 5"),
        ("a.vtp", ["--tolerance", "1"], "--tolerance is for STEP"),
        ("a.vtp", ["--marker", "wall"], "markers belong to a volume mesh, got a Grid"),
        ("a.xyz", ["--cap", "y"], "a cap is a surface's, got a Grid"),
        ("a.step", [], "a STEP file states its unit: give --from-units"),
        ("a.step", ["--from-units", "m", "--cap", "y"], "STEP holds patches, which have no cap"),
        ("a.step", ["--from-units", "m", "--tolerance", "0"], "must be a length above 0, got 0"),
    ],
)
def test_what_makes_no_sense_is_refused(half_box, tmp_path, capsys, target, arguments, message):
    if target == "a.step" and "0" in arguments:
        pytest.importorskip("OCP", reason="OpenCascade is optional: pip install 'moldline[step]'")
    assert main(["convert", half_box, str(tmp_path / target), *arguments]) == 1
    assert message in capsys.readouterr().err
    assert not (tmp_path / target).exists()


def test_a_surface_is_no_step(tmp_path, capsys, ball):
    ml.write(tmp_path / "ball.tri", ball)
    arguments = [str(tmp_path / "ball.tri"), str(tmp_path / "a.step"), "--from-units", "m"]
    assert main(["convert", *arguments]) == 1
    assert "STEP is made of structured patches, got a Surface" in capsys.readouterr().err


def test_a_marker_of_a_real_volume_mesh_becomes_a_surface(data, tmp_path, capsys):
    mesh = data("su2/brick_tets_ffd.su2")
    name = next(iter(ml.read(mesh).markers))
    assert main(["convert", str(mesh), str(tmp_path / "a.stl"), "--marker", name]) == 0
    assert re.search(r"\d+ of 11703 points are on the boundary", capsys.readouterr().out)
    assert len(ml.read(tmp_path / "a.stl").faces) > 10
