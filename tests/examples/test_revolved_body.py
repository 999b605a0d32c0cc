"""The example with somebody else's program, through its case file."""

import runpy
import shutil
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.case import load
from moldline.cli import main

FOLDER = Path(__file__).parent.parent.parent / "examples/programs"
PROGRAM = runpy.run_path(str(FOLDER / "revolve.py"))
OWN = {"length": 12.0, "radius": 1.0, "nose": 0.5, "tail": 0.8, "flatness": 0.9}
VALUES = {"length": [12.5], "nose": [0.6], "bend": [0.0, 0.3, 0.2, -0.4]}


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    place = tmp_path_factory.mktemp("program") / "programs"
    shutil.copytree(FOLDER, place, ignore=shutil.ignore_patterns(".moldline"))
    return place / "body.toml"


def test_the_case_makes_the_programs_closed_body(case, tmp_path):
    assert main(["build", str(case), "--set", "length=13", "-o", str(tmp_path / "body.tri")]) == 0
    body = ml.read(tmp_path / "body.tri")
    points, _ = PROGRAM["surface"](OWN | {"length": 13.0})
    np.testing.assert_allclose(body.points, points, rtol=0, atol=1e-13)
    t = np.linspace(0, 1, 200_001)
    radius = PROGRAM["radii"](t, OWN)
    expected = 13.0 * 0.9 * np.pi * np.trapezoid(radius**2, t)
    volume = ml.measures.Volume(body.faces)(body.points)[0]
    assert volume == pytest.approx(expected, rel=0.02)  # of 24 flat sides, which lose 1.1 %


def test_the_gradient_through_program_and_lattice_is_right(case):
    """Against the program's own formulas by complex step, through our exact derivatives."""
    loaded = load(case)
    measured = loaded.measurements.jacobian(VALUES)["volume"]
    box = loaded.pipeline.own_stages[0]
    full = loaded.pipeline.values(VALUES)
    present = OWN | {"length": 12.5, "nose": 0.6}
    rest = PROGRAM["surface"](present)[0]
    measure = loaded.measurements.constraints["volume"].measure

    def volume(points):
        return measure(box.deformer(points, box.controls(full)))[0]

    import jax

    slope = jax.grad(volume)(rest)
    for name in ("length", "radius", "nose"):
        moved = PROGRAM["surface"](present | {name: present[name] + 1e-30j})[0].imag / 1e-30
        assert measured[name][0, 0] == pytest.approx(float(np.sum(slope * moved)), rel=1e-7)
    accuracy = loaded.pipeline.branches["body"].making.accuracy
    assert set(accuracy) == {
        "length",
        "radius",
        "nose",
    }  # what no variable turns is not differenced
    assert max(one.error for one in accuracy.values()) < 1e-7


def test_what_the_program_refuses_is_told(case, capsys):
    text = case.read_text().replace("length = 12.0\n", "length = -12.0\n")
    (case.parent / "wrong.toml").write_text(text)
    assert main(["build", str(case.parent / "wrong.toml"), "-o", "body.tri"]) == 1
    told = capsys.readouterr().err
    assert "ended with status 1" in told
    assert "length and radius must be above 0" in told
