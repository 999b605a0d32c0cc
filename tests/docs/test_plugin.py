"""The plug-in of the docs, installed and used."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import moldline as ml

PLUGIN = Path(__file__).parent.parent.parent / "examples/plugin"

CASE = """
moldline = 1
[geometry.ball]
file = "ball.tri"
[variable.{name}]
value = 0.1
size = {size}
[[stage]]
deformer = "{deformer}"
{options}
[[stage.link]]
variable = "{name}"
link = "controls"
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The package where an installer puts it: the module, and beside it its entry points."""
    folder = tmp_path_factory.mktemp("site")
    project = tomllib.loads((PLUGIN / "pyproject.toml").read_text())["project"]
    (folder / "sine_bumps.py").write_text((PLUGIN / "src/sine_bumps.py").read_text())
    about = folder / "moldline_sine_bumps-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: 1.0\n"
    )
    rows = project["entry-points"]["moldline.deformers"].items()
    lines = "".join(f"{name} = {place}\n" for name, place in rows)
    (about / "entry_points.txt").write_text(f"[moldline.deformers]\n{lines}")
    return {**os.environ, "PYTHONPATH": str(folder)}


def run(environment, *arguments, folder):
    command = [sys.executable, "-m", "moldline", *arguments]
    return subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder)


@pytest.mark.parametrize(
    ("deformer", "size", "options", "method"),
    [
        ("sine_bumps", 3, "crests = [0.2, 0.5, 0.8]\nnose = -1.0\nchord = 2.0", "exact"),
        ("shear", 1, "", "complex step"),
    ],
)
def test_an_installed_plug_in_is_used_as_ours_are(
    installed, tmp_path, ball, deformer, size, options, method
):
    ml.write(tmp_path / "ball.tri", ball)
    text = CASE.format(name="b", size=size, deformer=deformer, options=options)
    (tmp_path / "case.toml").write_text(text)
    done = run(installed, "check", "case.toml", "--json", folder=tmp_path)
    assert done.returncode == 0, done.stderr + done.stdout
    derivatives = json.loads(done.stdout)["derivatives"]
    assert derivatives["is_right"] and derivatives["method"] == method
    done = run(installed, "deform", "case.toml", "-o", "new.tri", folder=tmp_path)
    assert done.returncode == 0 and "moved by up to" in done.stdout


def test_wrong_options_of_a_plug_in_are_told(installed, tmp_path, ball):
    ml.write(tmp_path / "ball.tri", ball)
    text = CASE.format(name="b", size=1, deformer="sine_bumps", options="crests = [1.5]\nnos = 1")
    (tmp_path / "case.toml").write_text(text)
    done = run(installed, "check", "case.toml", folder=tmp_path)
    assert done.returncode == 1
    assert "stage.0.nos: there is no such key" in done.stderr
    (tmp_path / "case.toml").write_text(text.replace("nos = 1", ""))
    done = run(installed, "check", "case.toml", folder=tmp_path)
    assert "crests must lie inside (0, 1) of chord" in done.stderr


def test_the_schema_knows_the_plug_in(installed, tmp_path):
    done = run(installed, "schema", folder=tmp_path)
    assert '"const": "sine_bumps"' in done.stdout


def test_the_plug_in_keeps_the_contract(installed):
    code = (
        "import numpy as np; from sine_bumps import SineBumps, Shear;"
        "from moldline.deformers.contract import check;"
        "x = np.random.default_rng(0).uniform(0.1, 0.9, (40, 3));"
        "check(SineBumps(crests=np.array([0.3, 0.6])), x); check(Shear(), x)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=installed
    )
    assert done.returncode == 0, done.stderr
