"""A live Blender for those tests that have one."""

import subprocess
from pathlib import Path

import pytest

SCENES = Path(__file__).parent / "blender_scenes.py"


@pytest.fixture(scope="session")
def blender():
    """The Blender that tests run; skips, and says why, where there is none."""
    # not above: jaxtyping instruments what is imported after the files of fixtures
    from moldline.errors import ParameterError
    from moldline.modelers.blender_found import found_interpreter

    try:
        found = found_interpreter()
    except ParameterError as problem:
        pytest.skip(str(problem))
    words = ["--version"] if found.name.startswith("blender") else ["-c", "import bpy"]
    trial = subprocess.run([found, *words], capture_output=True, text=True)
    if trial.returncode:
        reason = (trial.stderr.strip() or f"exit status {trial.returncode}").splitlines()[-1]
        pytest.skip(f"{found} has no bpy that imports: {reason}")
    return found


@pytest.fixture(scope="session")
def scenes(blender, tmp_path_factory):
    """A folder of small .blend files."""
    folder = tmp_path_factory.mktemp("scenes")
    words = [blender, SCENES, folder]
    if blender.name.startswith("blender"):
        words = [blender, "--background", "--python", SCENES, "--", folder]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return folder
