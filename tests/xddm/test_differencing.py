"""Other people's programs, run at perturbed variables."""

import math
import os
import shutil
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.errors import FileError, GeometryError, MoldlineError
from moldline.mesh.io.sensitivities import read_sensitivities
from moldline.workers import Processes, Threads
from moldline.xddm.document import Document, read
from moldline.xddm.model import Design
from moldline.xddm.serving import answer, served

MODEL = """<?xml version="1.0" encoding="ISO-8859-1"?>
<Model ID="m" Wrapper="{python} program.py" Layout="{layout}">
  <Configure Sensitivity="Required"/>   <!-- all of them -->
  <Variable ID="w" Value="0.5" FDstep="1e-4"/>
  <Constant ID="w0" Value="0.5"/>
  <Constant ID="mode" Value="{mode}"/>
  <Lattice ID="top"><Variable ID="t[1,2]" Value="0.25" Max="0.25" TypicalSize="1"/></Lattice>
  <Analysis ID="size"/>
  <Analysis ID="drag"/>
  <Function ID="double" Expr="2*size"/>
</Model>
"""


@pytest.fixture
def ask(tmp_path):
    shutil.copy(Path(__file__).parent / "foreign_program.py", tmp_path / "program.py")

    def run(mode=0, layout="both", more=lambda text: text, **options):
        text = more(MODEL.format(python=sys.executable, mode=mode, layout=layout))
        (tmp_path / "m.xml").write_text(text)
        (tmp_path / "model.input.xml").write_text(text)
        return answer(tmp_path / "m.xml", tmp_path, **options)

    return run


def test_differences_are_those_of_the_program(ask, tmp_path):
    found = ask(executor=Threads(2))
    w, t = "Model__m__Variable__w", "Model__m__Lattice__top__Variable__t[1,2]"
    surface, columns = read_sensitivities(tmp_path / "Components.i.tri")
    x, y, z = np.array([(0.1, 0.2, 0.3), (1.1, 0.2, 0.3), (0.1, 1.2, 0.3), (0.1, 0.2, 1.3)]).T
    assert columns.keys() == {"w", "t[1,2]"}
    np.testing.assert_allclose(surface.points[:, 0], x * math.exp(0.5), rtol=1e-15)
    by_w = np.stack([x * math.exp(0.5), 0 * y, 0 * z], axis=1)
    np.testing.assert_allclose(columns["w"], by_w, atol=1e-8)  # h^2/6
    by_t = np.stack([0 * x, 0.5 * z, z], axis=1)
    np.testing.assert_allclose(columns["t[1,2]"], by_t, atol=1e-11)  # no third derivative
    root = tmp_path / "design/geometry_m/geometry"
    assert sorted(p.name for p in root.iterdir()) == [t.replace("[1,2]", "_1_2_"), w]
    each = read_sensitivities(root)[1]
    assert each.keys() == {w, t}
    np.testing.assert_array_equal(each[t], columns["t[1,2]"])
    answered = Design(read(tmp_path / "model.output.xml"))
    assert answered.find("double").value == 2 * answered.find("size").value
    slopes = found.results["Model__m__Function__double"].gradient
    assert slopes[w] == pytest.approx(2 * 1.25 * math.exp(0.5), rel=1e-8)
    assert slopes[t] == pytest.approx(2 * math.exp(0.5), rel=1e-8)
    assert found.notes[0].startswith("2 variables by differences: 4 runs in")
    assert found.notes[1] == "Model__m__Analysis__drag got no Value from its program"
    text = (tmp_path / "model.output.xml").read_text()
    assert "<!-- all of them -->" in text and '<Analysis ID="drag"/>' in text
    runs = [line.split()[1:] for line in (tmp_path / "runs.txt").read_text().splitlines()]
    assert len(runs) == 5
    assert max(float(t) for _, t in runs) == 0.25  # never beyond its bound
    logs = sorted((tmp_path / "differences").rglob("wrapper.log"))
    assert len(logs) == 5 and all("making it" in log.read_text() for log in logs)


def test_runs_in_other_processes_give_the_same(ask, tmp_path):
    executor = Processes(2)
    there = ask(executor=executor).surfaces["m"]
    executor.close()
    here = ask().surfaces["m"]
    np.testing.assert_array_equal(there.surface.points, here.surface.points)
    assert there.columns.keys() == here.columns.keys()
    for name, column in there.columns.items():
        np.testing.assert_array_equal(column, here.columns[name])


def test_a_run_that_fails_ends_the_others(ask, tmp_path):
    with pytest.raises(FileError, match="no such width"):
        ask(mode=7, executor=Threads(4))
    (process,) = (tmp_path / "waiting.txt").read_text().split()
    with pytest.raises(ProcessLookupError):
        os.kill(int(process), 0)


def test_derivatives_of_the_program_s_own_stay(ask):
    slopes = ask(mode=6).results["Model__m__Analysis__size"].gradient
    assert slopes["Model__m__Variable__w"] == 7.5
    forced = ask(mode=6, more=lambda text: text.replace('FDstep="1e-4"', 'Comment="FD"'))
    slopes = forced.results["Model__m__Analysis__size"].gradient
    assert slopes["Model__m__Variable__w"] == pytest.approx(1.25 * math.exp(0.5), rel=1e-6)


def test_nothing_is_differenced_that_nobody_asks_for(ask, tmp_path):
    found = ask(more=lambda text: text.replace("Required", "None"))
    assert found.results["Model__m__Analysis__size"].gradient is None
    assert len((tmp_path / "runs.txt").read_text().splitlines()) == 1
    assert "SensitivityArray" not in (tmp_path / "model.output.xml").read_text()
    assert ml.read(tmp_path / "Components.i.tri").point_data == {}


def test_one_result_may_ask_and_one_variable_may_decline(ask, tmp_path):
    def local(text):
        text = text.replace('<Configure Sensitivity="Required"/>', "")
        text = text.replace('ID="size"', 'ID="size" Sensitivity="required"')
        return text.replace('ID="t[1,2]"', 'ID="t[1,2]" sensitivity="None"')

    found = ask(more=local)
    assert [*found.results["Model__m__Analysis__size"].gradient] == ["Model__m__Variable__w"]
    assert len((tmp_path / "runs.txt").read_text().splitlines()) == 3
    assert (tmp_path / "model.output.xml").read_text().count("<SensitivityArray>") == 1


@pytest.mark.parametrize(
    ("mode", "error", "message"),
    [
        (1, FileError, r"w = 0.5 [+-]0.0001: .*(plus|minus)_0.0001: .*status 3; "
            r"its log wrapper.log ends:\n  \| making it\n  \| \?\[31mred\n  \| no such width"),
        (2, FileError, r"base: .*took longer than its limit of 0.3 s; give it more; its log"),
        (3, GeometryError, r"w = 0.5 .*4 points and 3 triangles, at the base there are 4 and 4"),
        (4, GeometryError, r"w = 0.5 .*joins 2 of its 4 triangles otherwise than at the base"),
        (5, FileError, r"left no Components.i.tri"),
    ],
)  # fmt: skip
def test_a_run_that_fails_is_told_and_leaves_nothing(ask, tmp_path, mode, error, message):
    ask()
    before = {p: p.read_bytes() for p in tmp_path.glob("*.*") if p.suffix in (".tri", ".xml")}
    start = time.monotonic()
    with pytest.raises(error, match=f"(?s){message}"):
        ask(mode=mode, limit=0.3 if mode == 2 else 60)
    assert time.monotonic() - start < 30
    for name in ("Components.i.tri", "model.output.xml"):
        assert (tmp_path / name).read_bytes() == before[tmp_path / name]
    assert not list(tmp_path.glob(".moldline*"))


@pytest.mark.parametrize(
    ("wrapper", "message"),
    [
        ("no_such_program x", "line 2: Model 'm': .*no program 'no_such_program'; put it beside"),
        ("'open", "Wrapper=.*no closing quotation"),
        ("moldline serve m.xml", "serves this same document"),
        (" ", "has no Wrapper"),
    ],
)
def test_a_wrapper_that_is_none_is_told(ask, wrapper, message):
    with pytest.raises(MoldlineError, match=message):
        ask(more=lambda text: text.replace(f"{sys.executable} program.py", wrapper))


def test_a_model_that_names_nobody_is_told(tmp_path):
    model = Design(Document(b"<Model ID='m'/>", tmp_path / "m.xml"))
    with pytest.raises(FileError, match="expected an attribute Case"):
        served(model, model, tmp_path)
