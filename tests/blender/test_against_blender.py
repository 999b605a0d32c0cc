"""A live Blender's lattice modifier and ours, on the same points."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

import moldline as ml

ROOT = Path(__file__).parent.parent.parent
PYTHON = ROOT / ".venv-blender/bin/python"
SCRIPT = ROOT / "benchmarks/blender_lattice.py"

LOW, HIGH = (-1, -1.1, -0.9), (1, 0.8, 1.2)

pytestmark = pytest.mark.blender


@pytest.fixture(scope="session")
def imports_bpy():
    """Skips, and says why, where there is no Blender to run."""
    if not PYTHON.exists():
        pytest.skip("no .venv-blender here; `make blender` makes it")
    trial = subprocess.run([PYTHON, "-c", "import bpy"], capture_output=True, text=True)
    if trial.returncode:
        reason = (trial.stderr.strip() or f"exit status {trial.returncode}").splitlines()[-1]
        pytest.skip(f"bpy does not import: {reason}; `make blender` says what is missing")


@pytest.fixture
def blender(imports_bpy, tmp_path):
    """Runs Blender's lattice on points, by one of ours and its controls; returns what it says."""

    def run(points, lattice, controls, repeats=1):
        order = (2, 1, 0, 3)  # Blender's first index runs fastest
        rest = lattice.rest.transpose(order).reshape(-1, 3)
        moved = np.asarray(lattice.moved(controls)).transpose(order).reshape(-1, 3)
        given, result = tmp_path / "in.npz", tmp_path / "out.npz"
        np.savez(given, points=points, shape=lattice.shape, rest=rest, moved=moved)
        command = [PYTHON, SCRIPT, given, result, "--repeat", str(repeats)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        return np.load(result)

    return run


@pytest.mark.parametrize("shape", [(3, 3, 3), (7, 4, 2), (1, 1, 5), (10, 2, 1)], ids=str)
def test_our_lattice_with_blenders_rule_gives_blenders_points(blender, shape):
    rng = np.random.default_rng(1)
    points = rng.uniform(-1.5, 1.5, (2000, 3))  # also outside the box
    points[:4] *= 10  # also far outside, where points follow the end
    lattice = ml.Lattice.box(LOW, HIGH, shape, ends="blender", outside="extend")
    controls = 0.2 * rng.normal(size=lattice.size)
    theirs = blender(points, lattice, controls)["deformed"]
    ours = np.asarray(lattice.bind(points)(controls))
    assert np.abs(ours - points).max() > 0.1
    # In single precision Blender adds the shares of up to 64 control points to a coordinate one by
    # one; each addition rounds by at most 2**-24 of it.
    coarse = 64 * 2.0**-24 * np.maximum(1, np.abs(points).max(axis=1, keepdims=True))
    assert np.all(np.abs(ours - theirs) < coarse)


def test_blender_refuses_control_points_that_are_not_evenly_spaced(blender):
    lattice = ml.Lattice.box(LOW, HIGH, (7, 4, 2), ends="clamped")
    with pytest.raises(AssertionError, match="must rest evenly spaced in a box"):
        blender(np.zeros((1, 3)), lattice, np.zeros(lattice.size))


def test_blender_is_timed_as_often_as_asked(blender):
    lattice = ml.Lattice.box(LOW, HIGH, (3, 3, 3), ends="blender")
    said = blender(np.zeros((10, 3)), lattice, np.zeros(lattice.size), repeats=5)
    assert said["seconds"].shape == said["processor_seconds"].shape == (5,)
    assert np.all(said["seconds"] > 0)
