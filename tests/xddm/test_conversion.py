"""Cases become Models and Models become cases."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from moldline.case import load
from moldline.cli import main
from moldline.errors import ParameterError
from moldline.xddm.document import Document, read
from moldline.xddm.measure_table import attribute, measure_table
from moldline.xddm.model import Design
from moldline.xddm.problems import findings
from moldline.xddm.to_case import to_case
from moldline.xddm.to_model import to_model

CASE = """
moldline = 1
[geometry.box]
file = "box.tri"
units = "mm"
[variable.shift]
value = 0.1
bounds = [-0.30000000000000004, 0.7]
typical = 0.123456789012
unit = "cm"
[variable.growth]
size = 3
value = [0.0, 0.25, 0.5]
bounds = [[-1.0, 1.0], [0.25, 0.25], [-inf, 2.0]]
[[stage]]
deformer = "lattice"
shape = [3, 2, 2]
[[stage.link]]
variable = "shift"
link = "group"
axis = "z"
index = [[2, 1, 1]]
[[stage.link]]
variable = "growth"
link = "thickness"
along = "x"
axis = "z"
[measure.volume]
measure = "volume"
bounds = [1e-9, inf]
weight = 2.0
[measure.middle]
measure = "centroid"
bounds = [[-0.1, 0.1], [0.0, 0.0], [-inf, inf]]
[measure.free]
measure = "projected_area"
along = [0.0, 0.0, 1.0]
[output]
surface = "out.tri"
"""
BOX = """8 12
0 0 0  1 0 0  0 1 0  1 1 0  0 0 1  1 0 1  0 1 1  1 1 1
1 3 2  2 3 4  5 6 7  6 8 7  1 2 5  2 6 5  3 7 4  4 7 8  1 5 3  3 5 7  2 4 6  4 8 6
"""


@pytest.fixture
def case(tmp_path):
    (tmp_path / "box.tri").write_text(BOX)
    (tmp_path / "case.toml").write_text(CASE)
    return load(tmp_path / "case.toml")


def said(case):
    """What both sides can say of a case."""
    measures = {
        name: (*np.stack(one.bounds).ravel(), case.tables.measure[name].measure)
        for name, one in case.measurements.constraints.items()
    }
    return [dataclasses.astuple(one) for one in case.pipeline.variables.values()], measures


def test_there_and_back_is_the_identity(case, tmp_path):
    target = tmp_path / "deeper/model.xml"
    target.parent.mkdir()
    made = to_model(case, target)
    assert findings(made.document).problems == findings(made.document).notes == []
    made.document.save(target)
    back = to_case(read(target))
    assert back.notes == ()
    assert back.tables == case.tables
    back.save(tmp_path / "deeper/back.toml")
    assert said(load(tmp_path / "deeper/back.toml")) == said(case)
    assert to_model(load(tmp_path / "deeper/back.toml"), target).document.root.children != ()


def test_a_model_says_what_the_case_does(case, tmp_path):
    made = to_model(case, tmp_path / "model.xml")
    design = Design(made.document)
    assert design.target.get("Case") == "case.toml"
    assert design.target.get("Wrapper") == "moldline serve model.xml"
    shift, fixed, last = (design.find(n) for n in ("shift", "growth[1]", "growth[2]"))
    assert (shift.lower, shift.upper, shift.typical) == (-0.30000000000000004, 0.7, 0.123456789012)
    assert shift.element.get("Unit") == "cm"
    assert (fixed.element.tag, fixed.value) == ("Constant", 0.25)
    assert (last.element.tag, last.lower, last.upper) == ("Variable", None, 2.0)
    assert [v.id for v in design.analyses] == [
        "volume", "middle[0]", "middle[1]", "middle[2]", "free"
    ]  # fmt: skip
    bounds = {v.id: (v.lower, v.upper) for v in design.expressions}
    assert bounds == {"volume_bounds": (1e-9, None), "middle_bounds[0]": (-0.1, 0.1),
                      "middle_bounds[1]": (0.0, 0.0)}  # fmt: skip
    assert "1 geometry file, 1 stage, 1 output: these stay in" in made.notes[0]


def test_what_was_changed_in_the_model_changes_the_case(case, tmp_path):
    text = to_model(case, tmp_path / "m.xml").document.data.decode()
    for old, new in (
        ('ID="shift" Value="1.00000000000000006e-01"', 'ID="shift" FDstep="1e-3" Value="0.4"'),
        ('Min="-0.1" Max="0.1"', 'Min="-0.2" Max="0.1"'),
        ("</Model>", '<Function ID="f" Expr="shift^2"/></Model>'),
    ):
        assert old in text
        text = text.replace(old, new)
    stated = to_case(Document(text.encode(), tmp_path / "m.xml"))
    assert stated.notes == (
        "1 FDstep of Variables: a case has no word for them",
        "1 Functions: a case has no word for them",
    )
    stated.save(tmp_path / "new.toml")
    new = load(tmp_path / "new.toml")
    assert new.pipeline.variables["shift"].value == (0.4,)
    assert new.pipeline.variables["growth"] == case.pipeline.variables["growth"]
    assert new.measurements.constraints["middle"].bounds[0].tolist() == [-0.2, 0.0, -np.inf]
    assert new.tables.measure["volume"].weight == 2.0


def test_a_model_without_a_case_gives_its_variables_and_measures(tmp_path):
    text = """<Model ID="w">
      <Variable ID="span" Value="6" Min="5" Max="8" TypicalSize="1"/>
      <Lattice ID="top">
        <Variable ID="dz[1,1]" Value="1"/><Variable ID="dz[1,2]" Value="2"/>
        <Variable ID="dz[2,1]" Value="3"/><Constant ID="dz[2,2]" Value="4"/>
      </Lattice>
      <Analysis ID="chord" Measure="{measure = 'chord', at = 2.0}"/>
      <Analysis ID="unknown"/>
      <Constraint ID="c" Expr="chord" Max="3" Bound="Upper"/>
      <Constraint ID="d" Expr="2*chord" Max="3"/>
    </Model>"""
    tables, notes, _ = to_case(Document(text.encode(), tmp_path / "w.xml"))
    assert tables.variable["span"].bounds == (5.0, 8.0)
    assert tables.variable["top_dz"].value == [1, 2, 3, 4]
    assert tables.variable["top_dz"].bounds[3] == (4.0, 4.0)
    assert tables.measure["chord"].bounds == (-np.inf, 3.0)
    assert tables.measure["chord"].model_extra == {"at": 2.0}
    assert [note.split(":")[0] for note in notes] == [
        "dz[1,1] becomes top_dz[0]", "Model__w__Constraint__d",
        "Model__w__Analysis__unknown",
        "the Model names no Case, so there is no geometry and no stage",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ('<Variable ID="u[0]" Value="1"/><Variable ID="u[2]" Value="1"/>', "2 of 3 numbers are"),
        ('<Variable ID="u[0]" Value="1" Unit="m"/><Variable ID="u[1]" Value="1" Unit="cm"/>',
         "u has the units cm, m; give one"),
        ('<Variable ID="u" Value="1" Unit="mile"/>', "unit 'mile' is none of"),
        ('<Variable ID="u[0]" Value="1"/><Constant ID="u[0]" Value="1"/>', "2 of 1 numbers"),
        ('<Analysis ID="u" Measure="{measure = "/>', "no table of TOML in one line"),
    ],
)  # fmt: skip
def test_what_makes_no_case_is_told(inside, message):
    with pytest.raises(ParameterError, match=f"^w.xml: .*{message}"):
        to_case(Document(f"<Model ID='w'>{inside}</Model>".encode(), "w.xml"))


def test_measures_are_tables_in_one_line():
    for text in (
        "volume",
        "{measure = 'chord', at = 2.0}",
        "{measure = 'fixed', region = {inside = [[0, 1.5, inf], [1, 2, 3]]}, on = true}",
        "{measure = 'a', 'odd key' = \"it's \\\\ \\\"so\\\" \\u0007\"}",
    ):
        assert attribute(measure_table(text)) == text


def test_the_command_converts_both_ways(case, tmp_path, capsys):
    source, model, back = (str(tmp_path / name) for name in ("case.toml", "m.xml", "back.toml"))
    assert main(["convert", source, model]) == 0
    assert "12 variables, measures and bounds\n  1 geometry file" in capsys.readouterr().out
    assert main(["convert", model, back]) == 0
    assert load(back).tables == case.tables
    assert main(["convert", model, str(tmp_path / "x.tri")]) == 1
    assert "a .toml file is made; name it so" in capsys.readouterr().err
    assert not Path(tmp_path / "x.tri").exists()
