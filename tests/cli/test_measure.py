"""`moldline measure`, and what `deform`, `check` and `plot` make of pilots."""

import json

import numpy as np
import pytest

import moldline as ml
from moldline.cli import main

CASE = """
moldline = 1
[geometry.ball]
file = "ball.tri"
[variable.v]
size = 2
value = [0.2, 0.2]
[[stage]]
deformer = "pilots"
name = "held"
[stage.pilot.top]
measure = "position"
spot = { vertex = 2 }
along = "z"
[stage.pilot.twin]
measure = "position"
spot = { near = [0, 0, 1.5] }
along = "z"
[[stage.link]]
variable = "v"
link = "controls"
[measure.volume]
measure = "volume"
[measure.high]
measure = "position"
spot = { vertex = 2 }
along = "z"
bounds = [0, 1.1]
"""


@pytest.fixture
def case(tmp_path, ball):
    """A case of two pilots that are one."""
    ml.write(tmp_path / "ball.tri", ball)
    (tmp_path / "case.toml").write_text(CASE)
    return str(tmp_path / "case.toml")


def test_measures_are_told_before_and_after_with_their_bounds(case, capsys):
    assert main(["measure", case]) == 1
    volume, high = capsys.readouterr().out.splitlines()
    assert volume.startswith("volume") and "->" in volume and "within" not in volume
    assert high.split(maxsplit=1)[1] == "1 -> 1.2  within [0, 1.1]  ! beyond by 0.1"
    assert main(["measure", case, "high", "--set", "v=0.1,0.1"]) == 0
    assert main(["measure", case, "--json", "--derivatives"]) == 1
    report = json.loads(capsys.readouterr().out.split("\n", 1)[1])
    assert report["high"]["is_within"] is False
    assert np.sum(report["high"]["derivatives"]["v"]) == pytest.approx(1.0)


def test_a_file_is_measured_by_name(case, capsys, tmp_path):
    ball = str(tmp_path / "ball.tri")
    assert main(["measure", ball, "volume", "centroid"]) == 0
    volume, centroid = capsys.readouterr().out.splitlines()
    assert float(volume.split()[1]) == pytest.approx(4.1, abs=0.1) and centroid.count(",") == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["case.toml", "vol"], "no measure 'vol' in the case; it has: volume, high"),
        (["case.toml", "--derivatives"], "add --json"),
        (["ball.tri"], "name what to measure, such as: moldline measure"),
        (["ball.tri", "position"], "'position' needs spot; measure it in a case file"),
        (["ball.tri", "vol"], "no measures named 'vol'; installed: "),
        (["ball.tri", "chord"], "needs the station"),
    ],
)
def test_what_cannot_be_measured_is_told(case, tmp_path, capsys, arguments, message):
    name, *others = arguments
    assert main(["measure", str(tmp_path / name), *others]) == 1
    assert message in capsys.readouterr().err


def test_deform_and_check_tell_how_pilots_are_met(case, tmp_path, capsys):
    out = str(tmp_path / "new.tri")
    assert main(["deform", case, "-o", out]) == 0
    told = capsys.readouterr().out
    assert "stage 'held': 2 conditions on" in told and ": met, 1 step, largest miss" in told
    assert "implied by others: t" in told
    assert main(["deform", case, "-o", out, "--set", "v=0.2,0.1", "--json"]) == 1
    report = json.loads(capsys.readouterr().out)["pilots"][0]
    assert (report["status"], report["unmet"]) == ("least squares", ["top", "twin"])
    assert main(["check", case, "--set", "v=0.2,0.1"]) == 1
    told = capsys.readouterr().out
    assert "  ! unmet: top, twin; they contradict each other, or the hidden" in told
    assert "NOT sound" in told


def test_a_picture_shows_the_pilots_and_hides_the_lattice(case, tmp_path):
    from moldline.plot.pictures import nets

    hidden, pilots = nets(ml.load(case).pipeline)
    assert hidden.is_hidden and not pilots.is_hidden
    assert pilots.moved - pilots.rest == pytest.approx(np.array([[0, 0, 0.2]] * 2), abs=1e-12)
    assert main(["plot", case, "-o", str(tmp_path / "p.png")]) == 0
    assert main(["plot", case, "--sensitivity", "v[0]", "-o", str(tmp_path / "s.png")]) == 0
