"""The extension as a user has it: built, installed into a throw-away folder, switched on.

The tests run inside Blender's Python. moldline runs in its own environment, .venv or the one whose
interpreter MOLDLINE_PYTHON names, as a server that the add-on starts.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
MODULE = "bl_ext.user_default.moldline"
"""What Blender calls the installed extension; tests import from it."""

_HAS_BLENDER = importlib.util.find_spec("bpy") is not None
_FOLDER = Path(tempfile.gettempdir()) / f"moldline-addon-{os.getpid()}"

CASE = """\
moldline = 1

[geometry.ball]
file = "ball.tri"
units = "m"

# Comments of a hand-written case stay.
[variable.lift]
size = 2
bounds = [-1.0, 1.0]
unit = "m"

[[stage]]
name = "box"
deformer = "lattice"
shape = [2, 3, 2]
margin = [0.1, 0.1, 0.1]

[[stage.link]]
variable = "lift"
link = "camber"
along = "x"
axis = "z"

[measure.volume]
measure = "volume"
bounds = [1.0, inf]
"""


def pytest_ignore_collect(collection_path):
    """Elsewhere than in Blender's Python there is nothing to collect: tests/blender starts it."""
    return True if not _HAS_BLENDER and collection_path.name.startswith("test_") else None


def pytest_configure():
    """Build, install and switch on, before any test module is imported."""
    if not _HAS_BLENDER:
        return
    if "bpy" not in sys.modules:  # else we are inside a Blender that was told its folder
        os.environ["BLENDER_USER_RESOURCES"] = str(_FOLDER / "blender")
    if "BLENDER_USER_RESOURCES" not in os.environ:
        pytest.exit("set BLENDER_USER_RESOURCES to a folder that may be thrown away", 1)
    import bpy

    made = subprocess.run(
        [sys.executable, TOP / "tools/build_addon.py", "--output", _FOLDER / "dist"]
        + ["--staged", str(_FOLDER / "staged")]
        + (["--wheel", os.environ["MOLDLINE_WHEEL"]] if "MOLDLINE_WHEEL" in os.environ else []),
        capture_output=True,
        text=True,
    )
    if made.returncode:
        pytest.exit(f"the extension could not be built:\n{made.stdout}{made.stderr}", 1)
    bpy.ops.extensions.package_install_files(
        filepath=str(next((_FOLDER / "dist").glob("*.zip"))),
        repo="user_default",
        enable_on_install=True,
        overwrite=True,
    )
    if MODULE not in bpy.context.preferences.addons:
        pytest.exit("the extension was built but could not be switched on: see above", 1)
    preferences = bpy.context.preferences.addons[MODULE].preferences
    given = os.environ.get("MOLDLINE_PYTHON", str(TOP / ".venv/bin/python"))
    preferences.python = given
    preferences.socket = str(_FOLDER / "moldline.sock")


def pytest_unconfigure():
    """Stop moldline and switch off: Blender as a module never ends while an add-on is on."""
    if "bpy" not in sys.modules:
        return
    import bpy

    if MODULE in bpy.context.preferences.addons:
        sys.modules[f"{MODULE}.session"].stop()
        bpy.ops.preferences.addon_disable(module=MODULE)
    shutil.rmtree(_FOLDER, ignore_errors=True)


@pytest.fixture(autouse=True)
def _empty_file():
    """Each test begins with an empty file."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)


@pytest.fixture
def preferences():
    """The add-on's preferences; as they were, afterwards."""
    import bpy

    held = bpy.context.preferences.addons[MODULE].preferences
    names = ("python", "socket", "starts_at_once")
    before = {name: getattr(held, name) for name in names}
    yield held
    for name, value in before.items():
        setattr(held, name, value)


@pytest.fixture
def ball_case(tmp_path_factory):
    """A folder with case.toml: a ball, 258 points, in a lattice with two numbers; the file.

    It is the same folder for all tests, as it was at first: moldline then has the case loaded.
    """
    folder = tmp_path_factory.getbasetemp() / "ball"
    folder.mkdir(exist_ok=True)
    for file in folder.iterdir():
        if file.name not in ("ball.tri", "case.toml"):
            shutil.rmtree(file) if file.is_dir() else file.unlink()
    write_tri(folder / "fresh.tri", *ball())
    for name, text in (("ball.tri", (folder / "fresh.tri").read_text()), ("case.toml", CASE)):
        if not (folder / name).exists() or (folder / name).read_text() != text:
            (folder / name).write_text(text)
    (folder / "fresh.tri").unlink()
    return folder / "case.toml"


def ball():
    """A closed unit sphere, its points (258, 3) and triangles."""
    import numpy as np

    points = np.vstack([np.eye(3), -np.eye(3)])
    faces = np.array(
        [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    )
    for _ in range(3):
        pairs = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        unique, inverse = np.unique(pairs, axis=0, return_inverse=True)
        middle = inverse.reshape(-1, 3) + len(points)
        points = np.vstack([points, points[unique].sum(axis=1)])
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        a, b, c = faces.T
        ab, bc, ca = middle.T
        quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        faces = np.concatenate([np.stack(q, axis=1) for q in quarters])
    return points, faces


def write_tri(path, points, faces, tags=None):
    """A Cart3D file in text, numbers to the last digit."""
    rows = [f"{len(points)} {len(faces)}"]
    rows += [" ".join(repr(float(x)) for x in row) for row in points]
    rows += [" ".join(str(i + 1) for i in row) for row in faces]
    rows += [str(tag + 1) for tag in (tags if tags is not None else [0] * len(faces))]
    path.write_text("\n".join(rows) + "\n")
