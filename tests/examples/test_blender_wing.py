"""The example with Blender's modifiers behind a lattice of ours, through its case file."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.case import load
from moldline.cli import main
from moldline.errors import ParameterError
from moldline.modelers.blender_found import found_interpreter

FOLDER = Path(__file__).parent.parent.parent / "examples/blender"

pytestmark = pytest.mark.blender


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    place = tmp_path_factory.mktemp("blender") / "blender"
    shutil.copytree(FOLDER, place, ignore=shutil.ignore_patterns("*.blend", ".moldline"))
    (place.parent / "data").symlink_to(FOLDER.parent / "data")
    script = place / "make_scene.py"
    try:
        blender = found_interpreter()
    except ParameterError as problem:
        pytest.skip(str(problem))
    words = [blender, script, place]
    if blender.name.startswith("blender"):
        words = [blender, "--background", "--python", script, "--", place]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    if not (place / "wing.blend").exists():
        pytest.skip(f"{blender} makes no scene: {(done.stderr.strip() or '?').splitlines()[-1]}")
    return place / "wing.toml"


def test_the_case_deforms_and_its_derivatives_are_proved(case, tmp_path, capsys):
    values = ["--set", "rise=1", "--set", "washout=-3"]
    assert main(["deform", str(case), *values, "-o", str(tmp_path / "wing.tri")]) == 0
    assert main(["check", str(case), *values]) == 0
    told = capsys.readouterr().out
    assert "derivatives  differences of programs: order 2.0" in told and "\nsound" in told


def test_the_twist_is_blenders_and_points_at_the_root_stay_to_the_last_digit(case):
    loaded = load(case)
    rest = np.asarray(ml.read(FOLDER.parent / "data/transport_wing.tri", units="m").points)
    moved = np.asarray(loaded.pipeline.points({"washout": [-3.0]}))
    part = rest[:, 1] / np.ptp(rest[:, 1])
    turn = np.deg2rad(-3.0) * part
    x, z = rest[:, 0] - 38.0, rest[:, 2] - 4.0
    expected = rest.copy()
    expected[:, 0] = 38.0 + x * np.cos(turn) + z * np.sin(turn)
    expected[:, 2] = 4.0 - x * np.sin(turn) + z * np.cos(turn)
    np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-5)  # single precision of 48 m
    np.testing.assert_array_equal(
        loaded.pipeline.points({"washout": [0.0], "thickness": [0.0, 0.0, 0.0]}),
        rest,
    )
