"""The add-on's own tests, in Blender's Python, against the extension as it is installed."""

import subprocess
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
PYTHON = TOP / ".venv-blender/bin/python"

pytestmark = pytest.mark.blender


@pytest.mark.skipif(not PYTHON.exists(), reason="no Blender environment: make blender")
@pytest.mark.parametrize("of", ["not slow", pytest.param("slow", marks=pytest.mark.slow)])
def test_the_installed_extension(of):
    ran = subprocess.run(
        [PYTHON, "-m", "pytest", "-q", "-m", of, "tests/addon"],
        cwd=TOP,
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0, ran.stdout[-8000:] + ran.stderr[-2000:]
