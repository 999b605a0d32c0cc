"""`moldline check` of geometry files: mending and the picture."""

import json

import numpy as np
import pytest

import moldline as ml
from moldline.cli import main
from moldline.mesh.health import health


@pytest.fixture
def spoilt(ball, tmp_path):
    """A ball with a face turned over, one twice and a point of no face."""
    faces = ball.faces.copy()
    faces[5] = faces[5, ::-1]
    path = tmp_path / "spoilt.tri"
    points = np.vstack([ball.points, [[9, 9, 9]]])
    ml.write(path, ml.Surface(points, np.vstack([faces, faces[7:8]])))
    return path


def test_fix_writes_what_it_mended_and_tells_it(spoilt, tmp_path, capsys):
    target = tmp_path / "mended.tri"
    assert main(["check", str(spoilt)]) == 1
    capsys.readouterr()
    assert main(["check", str(spoilt), "--fix", str(target)]) == 0
    told = capsys.readouterr().out
    assert "  1 face turned over (first: 5)" in told
    assert "  1 face dropped that repeated an earlier one (first: 2048)" in told
    assert "  1 point dropped that belonged to no face (first: 1026)" in told
    assert "closed, manifold, consistently oriented" in told
    assert health(ml.read(target)).is_sound
    assert main(["check", str(target), "--fix", str(spoilt)]) == 0
    assert "nothing to mend" in capsys.readouterr().out


def test_fix_tells_a_script_too(spoilt, tmp_path, capsys):
    assert main(["check", str(spoilt), "--json", "--fix", str(tmp_path / "mended.tri")]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["mending"]["counts"]["turned_faces"] == 1
    assert report["mending"]["file"].endswith("mended.tri")
    assert report["mesh"]["is_oriented"] and report["is_sound"]


def test_weld_joins_points_that_are_near(ball, tmp_path, capsys):
    points = np.vstack([ball.points, ball.points[ball.faces[0]] * 1.0001])
    faces = ball.faces.copy()
    faces[0] = len(points) - 3 + np.arange(3)
    source, target = str(tmp_path / "apart.tri"), str(tmp_path / "joined.tri")
    ml.write(source, ml.Surface(points, faces))
    assert main(["check", source, "--fix", target]) == 1
    assert main(["check", source, "--fix", target, "--weld", "0.001"]) == 0
    assert "3 points welded to an earlier one" in capsys.readouterr().out


def test_a_picture_is_drawn(spoilt, tmp_path, capsys):
    picture = tmp_path / "faults.png"
    assert main(["check", str(spoilt), "--picture", str(picture), "--view", "top"]) == 1
    assert f"picture: {picture}" in capsys.readouterr().out
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["spoilt.tri", "--fix", "spoilt.tri"], "is the file that is checked; give another name"),
        (["spoilt.tri", "--weld", "1"], "--weld belongs to --fix OUT"),
        (["spoilt.tri", "--fix", "o.tri", "--weld", "nan"], "must be a finite length, got nan"),
        (["spoilt.tri", "--fix", "o.tri", "--weld", "9"], "joins each point to"),
        (["case.toml", "--fix", "o.tri"], "--fix mends a geometry file, not a case"),
        (["wing.dat", "--fix", "o.dat"], "--fix mends a surface, this is a Section"),
        (["wing.dat", "--picture", "o.png"], "draws the faults of a surface, this is a Section"),
    ],
)
def test_a_mistake_is_told_and_nothing_written(
    arguments, message, spoilt, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    x = np.array([1.0, 0.5, 0.0, 0.5])
    section = ml.Section(np.stack([x, [0, 0.1, 0, -0.1], 0 * x], axis=1))
    ml.write("wing.dat", section)
    before = spoilt.read_bytes()
    assert main(["check", *arguments]) == 1
    assert message in capsys.readouterr().err
    assert spoilt.read_bytes() == before
    assert not list(tmp_path.glob("o.*"))
