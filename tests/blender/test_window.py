"""A session in a Blender with a window, mouse and keys simulated."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import moldline as ml

TOP = Path(__file__).parents[2]
SURFACE = TOP / "examples/data/transport_wing.tri"
PICTURES = os.environ.get("MOLDLINE_PICTURES")
"""Where pictures of the window are to be kept."""

pytestmark = pytest.mark.blender


@pytest.fixture
def blender():
    """A whole Blender that knows extensions; skips, and says why, where there is none."""
    program = os.environ.get("BLENDER") or shutil.which("blender")
    if program is None:
        pytest.skip("no Blender with a window on PATH, or as BLENDER")
    told = subprocess.run([program, "--version"], capture_output=True, text=True).stdout
    version = re.search(r"Blender (\d+)\.(\d+)", told)
    if version is None or (int(version[1]), int(version[2])) < (4, 2):
        pytest.skip(f"{program} is {told.splitlines()[0]}; extensions need 4.2")
    return program


@pytest.fixture
def display():
    """A display: the one that there is, else a virtual one."""
    if "DISPLAY" in os.environ:
        yield os.environ["DISPLAY"]
        return
    for needed in ("Xvfb", "import"):
        if shutil.which(needed) is None:
            pytest.skip(f"no display, and no {needed} for a virtual one (xvfb, imagemagick)")
    ours, theirs = os.pipe()
    screen = ["-screen", "0", "1400x900x24", "+extension", "GLX", "-displayfd", str(theirs)]
    server = subprocess.Popen(["Xvfb", *screen], pass_fds=[theirs], stderr=subprocess.DEVNULL)
    os.close(theirs)
    with os.fdopen(ours) as told:
        number = told.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait()


def test_a_wing_is_shaped_in_the_window_and_the_case_runs_by_itself(blender, display, tmp_path):
    environment = {
        **os.environ,
        "DISPLAY": display,
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "BLENDER_USER_RESOURCES": str(tmp_path / "blender"),
    }
    build = [sys.executable, TOP / "tools/build_addon.py", "--output", tmp_path / "dist"]
    _run([*build, "--staged", tmp_path / "staged"], environment)
    extension = next((tmp_path / "dist").glob("*.zip"))
    install = ["--command", "extension", "install-file", "--repo", "user_default", "--enable"]
    _run([blender, *install, extension], environment)
    window = [blender, "--enable-event-simulate", "--window-geometry", "0", "0", "1400", "900"]
    session = TOP / "tests/addon/window/session.py"
    window += ["--python", session, "--", sys.executable, SURFACE, tmp_path]
    said = _run(window, environment)
    if PICTURES:
        for picture in tmp_path.glob("*.png"):
            shutil.copy(picture, PICTURES)
    assert (tmp_path / "status").read_text() == "0", said
    deform = ["deform", tmp_path / "case.toml", "-o", tmp_path / "new.tri"]
    _run([sys.executable, "-m", "moldline", *deform], environment)
    ours, shown = ml.read(tmp_path / "new.tri").points, np.load(tmp_path / "shown.npy")
    assert np.abs(ours - ml.read(SURFACE).points).max() > 1
    np.testing.assert_allclose(shown, ours, rtol=1e-6, atol=1e-6)  # shown in floats


def _run(command: list, environment: dict) -> str:
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout[-5000:] + done.stderr[-5000:]
