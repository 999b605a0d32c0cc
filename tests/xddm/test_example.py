"""The example of a framework, two modelers and a wetted surface, as a user runs it."""

import os
import runpy
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.mesh.health import health
from moldline.xddm.document import read
from moldline.xddm.model import Design
from moldline.xddm.problems import problems
from moldline.xddm.serving import answer

EXAMPLE = Path(__file__).parent.parent.parent / "examples/xddm"


@pytest.fixture
def programs(monkeypatch):
    """Python and moldline as the user has them."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")


def test_the_documents_are_sound():
    for path in EXAMPLE.glob("*.xml"):
        assert problems(read(path)) == []


def test_the_design_answers(programs, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(EXAMPLE, folder)
    shutil.copy(folder / "design.xml", folder / "model.input.xml")
    found = answer(folder / "design.xml", folder)
    assert found.notes[0].startswith("wing: 3 variables by differences: 6 runs in")
    assert found.notes[1] == "body: 2 derivatives are the program's own"
    surface = ml.read(folder / "Components.i.tri")
    assert surface.components == ("wing", "body")
    assert health(surface).is_closed and health(surface).is_manifold
    said = Design(read(folder / "model.output.xml"))
    assert said.find("buried").value == pytest.approx(0.49852204, rel=1e-6)
    gradient = found.results["Optimize__Objective__compactness"].gradient
    assert len(gradient) == 10
    assert gradient["Optimize__Model__body__Variable__height"] == pytest.approx(-1069.88657)
    (surfaces,) = found.surfaces.values()
    assert len(surfaces.columns) == 10


@pytest.mark.slow
def test_a_framework_finds_the_target_by_files_alone(programs, monkeypatch, tmp_path):
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    driver = runpy.run_path(str(EXAMPLE / "driver.py"))
    numbers = driver["main"]()
    assert numbers["miss"] < 1e-9
    assert numbers["answers"] < 9
    np.testing.assert_allclose(numbers["values"], driver["TARGET"], atol=1e-6)
