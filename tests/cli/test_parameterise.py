"""`moldline parameterise`: a case file to begin with, that runs."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from bodies import fuselage

import moldline as ml
from moldline.cli import main

WING = Path(__file__).parents[2] / "examples/data/transport_wing.tri"


def made(tmp_path, capsys, *options, source=WING):
    shutil.copy(source, tmp_path)
    case = tmp_path / "case.toml"
    words = ["parameterise", str(tmp_path / source.name), "-o", str(case), *options]
    assert main(words) == 0, capsys.readouterr().err
    assert (tmp_path / "case.png").stat().st_size > 10_000
    return ml.load(case), capsys.readouterr().out


KINDS = {
    "lattice": (["--shape", "5x4x2"], 3 * 40, "5 x 4 x 2 control points: as asked for"),
    "wing-lattice": (["--shape", "5x4x2"], 40, "the wing's own box"),
    "cage": (["--faces", "80"], 3 * 42, "42 vertices and 80 triangles"),
    "wing-cage": (["--stations", "3"], 3 * 26, "26 vertices"),
    "wing-skeleton": (["--stations", "0,11,29"], 1 + 3 + 2 + 2 + 3, "11 numbers: 1 of span"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_writes_a_case_that_leaves_the_wing_as_it_is(kind, tmp_path, capsys):
    options, numbers, words = KINDS[kind]
    case, told = made(tmp_path, capsys, "--kind", kind, *options)
    assert sum(v.size for v in case.pipeline.variables.values()) == numbers
    assert words in told and str(tmp_path / "case.png") in told
    rest = np.asarray(case.pipeline.geometry.points)
    np.testing.assert_allclose(case.pipeline.points(), rest, rtol=0, atol=1e-9)
    text = (tmp_path / "case.toml").read_text()
    assert words.split(":")[0] in text  # a person reads why
    assert tomllib.loads(text)["geometry"]["transport_wing"]["file"] == "transport_wing.tri"


def test_a_body_gets_a_skeleton_or_rings(tmp_path, capsys):
    ml.write(tmp_path / "body.stl", fuselage(48, 81))
    (tmp_path / "in").mkdir()
    body = tmp_path / "in/body.stl"
    shutil.move(tmp_path / "body.stl", body)
    case, _ = made(tmp_path, capsys, "--kind", "body-skeleton", source=body)
    assert "radius" in case.pipeline.variables
    case, _ = made(tmp_path, capsys, "--kind", "body-cage", "--overwrite", source=body)
    assert "move_x" in case.pipeline.variables


def test_an_airfoil_gets_thickness_and_camber(tmp_path, capsys):
    x = (1 + np.cos(np.linspace(0, 2 * np.pi, 60))) / 2
    foil = np.stack([x, 0.1 * np.sin(np.linspace(0, 2 * np.pi, 60))], axis=1)
    (tmp_path / "in").mkdir()
    np.savetxt(tmp_path / "in/foil.dat", foil, header="foil", comments="")
    case, told = made(tmp_path, capsys, "--kind", "lattice", source=tmp_path / "in/foil.dat")
    assert set(case.pipeline.variables) == {"thickness", "camber"}
    assert "10 stations along the chord" in told


def test_what_is_there_is_not_written_over(tmp_path, capsys):
    (tmp_path / "case.toml").write_text("mine")
    words = ["parameterise", str(WING), "--kind", "lattice", "-o", str(tmp_path / "case.toml")]
    assert main(words) == 1
    assert "is there already; choose another name, or --overwrite" in capsys.readouterr().err
    assert (tmp_path / "case.toml").read_text() == "mine"
    assert main([*words, "--overwrite"]) == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--kind", "cage", "--shape", "3x3x3"], "cage takes no shape"),
        (["--kind", "lattice", "--shape", "3,3,3"], "expected three counts, such as 7x4x2"),
        (["--kind", "lattice", "--region", "1,2,3"], "expected six numbers, x,y,z,x,y,z"),
        (["--kind", "cage", "--faces", "3"], "20 faces or more"),
        (["--kind", "wing-skeleton", "--stations", "500,600"], "no section at y = 500"),
    ],
)
def test_a_mistake_is_told_and_writes_nothing(options, message, tmp_path, capsys):
    words = ["parameterise", str(WING), *options, "-o", str(tmp_path / "case.toml")]
    assert main(words) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
