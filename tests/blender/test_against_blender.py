"""A live Blender's lattice modifier and ours, on the same points."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

import moldline as ml

ROOT = Path(__file__).parent.parent.parent
PYTHON = ROOT / ".venv-blender/bin/python"
SCRIPT = ROOT / "benchmarks/blender_lattice.py"

pytestmark = pytest.mark.blender


@pytest.fixture(scope="session")
def blender():
    """Blender's Python, or a skip that says why."""
    if not PYTHON.exists():
        pytest.skip("no .venv-blender here; `make blender` makes it")
    trial = subprocess.run([PYTHON, "-c", "import bpy"], capture_output=True, text=True)
    if trial.returncode:
        pytest.skip(f"bpy does not import: {trial.stderr.strip().splitlines()[-1]}")
    return PYTHON


@pytest.mark.parametrize("shape", [(3, 3, 3), (7, 4, 2), (1, 1, 5), (10, 2, 1)], ids=str)
def test_our_lattice_with_blenders_rule_gives_blenders_points(blender, tmp_path, shape):
    rng = np.random.default_rng(1)
    points = rng.uniform(-1.5, 1.5, (2000, 3))  # also outside the box
    lattice = ml.Lattice.box(
        (-1, -1.1, -0.9), (1, 0.8, 1.2), shape, ends="blender", outside="extend"
    )
    controls = 0.2 * rng.normal(size=lattice.size)
    order = (2, 1, 0, 3)  # Blender's first index runs fastest
    rest = lattice.rest.transpose(order).reshape(-1, 3)
    moved = np.asarray(lattice.moved(controls)).transpose(order).reshape(-1, 3)
    given, result = tmp_path / "in.npz", tmp_path / "out.npz"
    np.savez(given, points=points, shape=shape, rest=rest, moved=moved)
    subprocess.run([blender, SCRIPT, given, result, "1"], check=True, capture_output=True)
    theirs = np.load(result)["deformed"]
    ours = np.asarray(lattice.bind(points)(controls))
    assert np.abs(ours - points).max() > 0.1
    # Blender computes in single precision: a few roundings of numbers around 1
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=2e-6)
