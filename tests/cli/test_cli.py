"""The commands as a user runs them."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.cli import COMMANDS, main

ROOT = Path(__file__).parent.parent.parent
CASE = str(ROOT / "examples/transport_wing.toml")
WING = str(ROOT / "examples/data/transport_wing.tri")


@pytest.fixture
def ball_file(tmp_path, ball):
    """A closed geometry file."""
    ml.write(tmp_path / "ball.tri", ball)
    return str(tmp_path / "ball.tri")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example(command, capsys):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    assert f"moldline {command}" in capsys.readouterr().out.split("example:")[1]


def test_help_and_wrong_arguments_answer_at_once():
    for arguments, status in ((["--help"], 0), (["deform", "--wrong"], 2)):
        start = time.perf_counter()
        done = subprocess.run([sys.executable, "-m", "moldline", *arguments], capture_output=True)
        assert done.returncode == status
        assert time.perf_counter() - start < 2.0  # 0.05 s alone; these machines are shared
        assert b"Traceback" not in done.stderr


def test_help_imports_no_heavy_library():
    code = (
        "import sys, moldline.cli as c\nc.parser()\n"
        "print([m for m in ('jax', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_deform_writes_the_moved_surface(tmp_path, capsys):
    target = tmp_path / "new.tri"
    assert main(["deform", CASE, "--set", "droop[2]=0.1", "-o", str(target), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["points"] == 9720
    assert report["tears"] == []
    case = ml.load(CASE)
    values = case.values({"droop": [-0.3, -0.3, 0.1, -0.3]})
    np.testing.assert_array_equal(ml.read(target).points, case.pipeline(values).points)


def test_sensitivity_writes_exact_vectors(tmp_path):
    target = tmp_path / "new.vtp"
    assert main(["sensitivity", CASE, "--variable", "droop", "-o", str(target)]) == 0
    written = ml.read(target)
    case = ml.load(CASE)
    exact = case.pipeline.sensitivity(None, "droop")
    for i in range(4):
        np.testing.assert_array_equal(written.point_data[f"droop[{i}]"], exact[..., i])
    assert main(["sensitivity", CASE, "--variable", "droop", "-o", str(tmp_path / "new.npz")]) == 0
    np.testing.assert_array_equal(np.load(tmp_path / "new.npz")["droop[3]"], exact[..., 3])


def test_check_proves_the_example_sound(capsys):
    assert main(["check", CASE, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["is_sound"] and report["mesh"]["is_closed"]
    assert report["derivatives"]["order"] == pytest.approx(2, abs=0.1)
    assert report["derivatives"]["mismatch"] < 1e-12
    assert report["folding"]["smallest"] > 0.5


def test_check_fails_where_space_folds_and_the_mesh_tears(capsys, tmp_path, ball_file):
    (tmp_path / "case.toml").write_text(
        'moldline = 1\n[geometry.b]\nfile = "ball.tri"\n[variable.t]\nvalue = 3.0\n'
        '[[stage]]\nname = "nose"\ndeformer = "lattice"\nlow = [-2, -2, -2]\nhigh = [0, 2, 2]\n'
        'shape = [4, 2, 2]\n[[stage.link]]\nvariable = "t"\nlink = "camber"\nalong = "y"\n'
        'axis = "x"\n'.replace("[variable.t]", "[variable.t]\nsize = 2")
    )
    assert main(["check", str(tmp_path / "case.toml")]) == 1
    told = capsys.readouterr().out
    assert "stage 'nose' tears the mesh" in told
    assert "NOT sound" in told


def test_a_rider_is_written_in_its_own_unit(tmp_path, ball_file):
    (tmp_path / "case.toml").write_text(
        'moldline = 1\n[geometry.b]\nfile = "ball.tri"\nunits = "m"\n'
        '[rider.r]\nfile = "ball.tri"\nunits = "in"\n'
    )
    target = tmp_path / "rider.tri"
    case = str(tmp_path / "case.toml")
    assert main(["deform", case, "--rider", "r", "-o", str(target)]) == 0
    np.testing.assert_allclose(ml.read(target).points, ml.read(ball_file).points, rtol=1e-15)


def test_check_of_a_geometry_file_tells_its_health(capsys, ball_file):
    assert main(["check", ball_file]) == 0
    assert "closed, manifold, consistently oriented" in capsys.readouterr().out


def test_info_and_convert_round_trip(tmp_path, capsys, ball_file):
    assert main(["info", ball_file, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["kind"] == "Surface" and report["points"] == len(ml.read(ball_file).points)
    target = str(tmp_path / "ball.stl")
    arguments = ["convert", ball_file, target, "--from-units", "in", "--to-units", "m"]
    assert main(arguments) == 0
    high = ml.read(target).points.max()
    assert high == pytest.approx(0.0254 * ml.read(ball_file).points.max())


def test_plot_writes_pictures(tmp_path):
    for arguments in (
        [WING, "-o", "wing.png", "--view", "top"],
        [CASE, "-o", "moved.svg"],
        [CASE, "--sensitivity", "droop[1]", "-o", "map.png"],
        [CASE, "--cuts", "5,20", "-o", "cuts.pdf"],
    ):
        arguments[arguments.index("-o") + 1] = str(tmp_path / arguments[arguments.index("-o") + 1])
        assert main(["plot", *arguments]) == 0
        assert (tmp_path / arguments[arguments.index("-o") + 1]).stat().st_size > 5000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["deform", CASE, "--set", "drop=1", "-o", "x.tri"], "nothing named 'drop'; there is: "),
        (["deform", CASE, "--set", "droop", "-o", "x.tri"], "expected NAME=VALUE"),
        (["deform", CASE, "--set", "droop[9]=1", "-o", "x.tri"], "'droop' has 4 numbers"),
        (["deform", CASE, "--set", "droop=a", "-o", "x.tri"], "'a' is not a list of numbers"),
        (["deform", CASE, "--set", "droop=nan,0,0,0", "-o", "x.tri"], "must be finite"),
        (["deform", CASE, "-o", "x.xyzzy"], "the suffix tells no format"),
        (["deform", "none.toml", "-o", "x.tri"], "none.toml: cannot be read"),
        (["info", "none.tri"], "none.tri: no such file"),
        (["plot", CASE], "give -o FILE for a picture"),
        (["plot", CASE, "-o", "x.png", "--view", "inside"], "no view named 'inside'"),
        (["plot", CASE, "-o", "x.gif"], "pictures are written as"),
        (["plot", CASE, "-o", "x.png", "--sensitivity", "thick"], "no number 'thick'; there is"),
    ],
)
def test_a_mistake_is_told_on_one_line_with_status_1(
    arguments, message, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 1
    told = capsys.readouterr().err
    assert message in told and "Traceback" not in told
    assert not list(tmp_path.iterdir())


def test_jobs_sets_how_many_threads_may_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("MOLDLINE_THREADS", "7")
    assert main(["deform", CASE, "--jobs", "1", "-o", str(tmp_path / "wing.tri")]) == 0
    assert os.environ["MOLDLINE_THREADS"] == "1"
    with pytest.raises(SystemExit):
        main(["deform", CASE, "--jobs", "0", "-o", str(tmp_path / "wing.tri")])
    assert "expected a count of at least 1, got '0'" in capsys.readouterr().err
