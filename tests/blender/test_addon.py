"""The add-on's own tests, in Blender's Python, against the extension as it is installed."""

import subprocess
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
PYTHON = TOP / ".venv-blender/bin/python"
FILES = sorted((TOP / "tests/addon").glob("test_*.py"))

pytestmark = [
    pytest.mark.blender,
    pytest.mark.skipif(not PYTHON.exists(), reason="no Blender environment: make blender"),
]


@pytest.mark.parametrize("files", [FILES[::2], FILES[1::2]], ids=["even", "odd"])
def test_the_installed_extension(files):
    _run("not slow", files)


@pytest.mark.slow
def test_the_installed_extension_at_full_length():
    _run("slow", FILES)


def _run(which, files):
    command = [PYTHON, "-m", "pytest", "-q", "-c", TOP / "tests/addon/pytest.ini", "-m", which]
    ran = subprocess.run([*command, *files], cwd=TOP, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout[-8000:] + ran.stderr[-2000:]
