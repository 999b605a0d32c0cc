"""Requests to cases, and to cases behind other Models."""

import numpy as np
import pytest
from test_conversion import BOX

import moldline as ml
from moldline.case import load
from moldline.errors import CaseError, FileError, MoldlineError
from moldline.mesh.io.sensitivities import read_sensitivities
from moldline.xddm.case_answer import of_case
from moldline.xddm.chain import Quantity
from moldline.xddm.document import Document, read
from moldline.xddm.exchange import Answer, Linearised
from moldline.xddm.model import Design
from moldline.xddm.serving import answer, served
from moldline.xddm.upstream import behind

CASE = """
moldline = 1
[geometry.box]
file = "box.tri"
units = "mm"
[variable.sections_dz]
size = 4
bounds = [-0.1, 0.2]
unit = "mm"
[variable.lift]
value = 0.1
bounds = [-1.0, 1.0]
unit = "mm"
[[stage]]
deformer = "lattice"
shape = [3, 2, 2]
outside = "extend"
[[stage.link]]
variable = "sections_dz"
link = "each"
axis = "z"
index = [[0, 0, 1], [1, 0, 1], [2, 0, 1], [1, 1, 1]]
[[stage.link]]
variable = "lift"
link = "group"
axis = "x"
index = [[2, 1, 1]]
[measure.volume]
measure = "volume"
[measure.middle]
measure = "centroid"
"""
REQUEST = """<?xml version="1.0" encoding="ISO-8859-1"?>
<!-- kept --><Model ID="wing" Modeler="deform" Wrapper="deform.sh" Case="case.toml">
  <Variable ID="lift" Value="0.3" Min="-0.5" Max="0.5" Sensitivity="Required" Unit="mm"/>
  <Lattice ID="sections">
    <Variable ID="dz[3,1]" Value="0.1"/>
    <Constant ID="dz[1,1]" Value="0.05"/>
  </Lattice>
  <Analysis ID="volume" Sensitivity="Required"/>
  <Analysis ID="middle[2]" Sensitivity="None"/>
  <Analysis ID="area" Measure="{measure = 'projected_area', along = [1.0, 0.0, 0.0]}"/>
  <Analysis ID="CL"><AeroFun>optForce CL 2 0 0 1 0. 1. 0 entire</AeroFun></Analysis>
  <Function ID="cubed" Expr="volume^3" Sensitivity="Required"/>
  <Function ID="polar" Expr="CL^2"/>
  <Tessellate MaxEdge="0.02"/>
</Model>
"""
LIFT, DZ = "Model__wing__Variable__lift", "Model__wing__Lattice__sections__Variable__dz[3,1]"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "box.tri").write_text(BOX)
    (tmp_path / "case.toml").write_text(CASE)
    (tmp_path / "wing.xml").write_text(REQUEST)
    (tmp_path / "run").mkdir()
    (tmp_path / "run/model.input.xml").write_text(REQUEST)
    return tmp_path


def test_a_case_answers_with_its_surface_measures_and_derivatives(folder):
    run = folder / "run"
    found = answer(folder / "wing.xml", run)
    case = load(folder / "case.toml")
    values = {"lift": 0.3, "sections_dz": [0.05, 0.0, 0.1, 0.0]}
    surface, columns = read_sensitivities(run / "Components.i.tri")
    np.testing.assert_allclose(surface.points, 1e3 * case.pipeline.points(values), rtol=1e-15)
    assert columns.keys() == {"lift", "dz[3,1]"}
    exact = case.pipeline.sensitivity(values, "sections_dz")[..., 2]
    np.testing.assert_allclose(columns["dz[3,1]"], 1e3 * exact, rtol=1e-15)
    each = read_sensitivities(run / "design/geometry_wing/geometry")[1]
    assert each.keys() == {LIFT, DZ}
    np.testing.assert_array_equal(each[DZ], columns["dz[3,1]"])
    slopes = case.measurements.jacobian(values)["volume"]
    said = Design(read(run / "model.output.xml"))
    volume = found.results["Model__wing__Analysis__volume"]
    assert said.find("volume").value == volume.value == case.measurements(values)["volume"][0]
    assert volume.gradient == {LIFT: slopes["lift"][0, 0], DZ: slopes["sections_dz"][0, 2]}
    assert said.find("middle[2]").value == case.measurements(values)["middle"][2]
    assert said.find("cubed").value == volume.value**3
    assert said.find("area").value == pytest.approx(1e-6, rel=0.2)
    with_arrays = [v.id for v in said.values if v.element.first("SensitivityArray")]
    assert with_arrays == ["volume", "cubed"]
    assert (run / "model.output.xml").read_text().startswith(REQUEST[: REQUEST.index("  <Ana")])
    assert found.notes == (
        "Tessellate is not obeyed: the case's own triangles move",
        "Model__wing__Analysis__CL is for a flow solver",
        "Model__wing__Function__polar waits for a Value of Model__wing__Analysis__CL",
    )


def test_the_layout_is_the_user_s(folder):
    run = folder / "run"
    answer(folder / "case.toml", run, "one")
    assert not (run / "design").exists()
    answer(folder / "case.toml", run, "each")
    assert read_sensitivities(run / "Components.i.tri")[1] == {}
    root = run / "design/geometry_wing/geometry"
    assert len(list(root.iterdir())) == 2
    fewer = REQUEST.replace('ID="dz[3,1]"', 'ID="dz[3,1]" Sensitivity="None"')
    (run / "model.input.xml").write_text(fewer)
    (folder / "wing.xml").write_text(fewer.replace("<Model", '<Model Layout="each"'))
    answer(folder / "wing.xml", run)
    assert [p.parent.name for p in root.glob("*/Components.i.tri")] == [LIFT]
    with pytest.raises(MoldlineError, match="Layout='all', expected one of both, one, each"):
        answer(folder / "case.toml", run, "all")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('Value="0.1"', 'Value="0.3"', r"sections_dz\[2\] = 0.3 is outside \[-0.1, 0.2\] mm"),
        ('Value="0.3"', 'Value="0.7"', r"line 3: Variable 'lift': Value=0.7 is above Max=0.5"),
        ('Unit="mm"', 'Unit="m"', r"Unit='m', the case has 'lift' in 'mm'"),
        ("dz[3,1]", "dz[5,1]", r"dz\[5,1\]: the case's variable has 4 numbers: dz\[0\] to dz\[3\]"),
        ("dz[3,1]", "dz[2,2]", r"of 2 numbers in 2 columns nobody knows which of the 4"),
        ("dz[3,1]", "dz[0]", r"both number 0 of the case's variable 'sections_dz'"),
        ('"lift"', '"lift[1]"', r"the case's variable has 1 numbers: lift$"),
        ('"lift"', '"raise"', r"the case has no variable 'raise'; it has: sections_dz, lift"),
        (
            '"middle[2]"',
            '"bulk[2]"',
            r"the case has no measure 'bulk'; it has: volume, middle, area",
        ),
        ("'projected_area'", "'shade'", r"no measures? named 'shade'"),
        ('ID="wing"', 'ID="tail"', r"asks Model 'tail', but .*wing.xml is Model 'wing'; is it the"),
        ("</Model>", "", r"no element found|mismatched tag"),
        ('ID="lift" Value="0.3"', 'ID="lift"', r"line 3: Variable 'lift': has no Value"),
    ],
)
def test_a_wrong_request_is_told_and_leaves_nothing(folder, old, new, message):
    run = folder / "run"
    assert old in REQUEST
    (run / "model.input.xml").write_text(REQUEST.replace(old, new))
    (run / "model.output.xml").write_text("of before")
    with pytest.raises(MoldlineError, match=message):
        answer(folder / "wing.xml", run)
    assert sorted(p.name for p in run.iterdir()) == ["model.input.xml", "model.output.xml"]
    assert (run / "model.output.xml").read_text() == "of before"


def test_what_is_not_there_is_told(folder):
    with pytest.raises(FileError, match=r"model.input.xml: no such file"):
        answer(folder / "wing.xml", folder)
    with pytest.raises(FileError, match="no such folder, expected the one with"):
        answer(folder / "wing.xml", folder / "nowhere")
    (folder / "case.toml").unlink()
    with pytest.raises(FileError, match=r"Case='case.toml': there is no such file beside"):
        answer(folder / "wing.xml", folder / "run")
    with pytest.raises(CaseError):
        answer(folder / "case.toml", folder / "run")


def test_a_disk_that_fails_leaves_no_half_answer(folder, monkeypatch):
    run = folder / "run"
    answer(folder / "wing.xml", run)
    before = {p: p.read_bytes() for p in run.rglob("*") if p.is_file()}

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("moldline.xddm.exchange.write_sensitivities", full)
    with pytest.raises(FileError, match="cannot write the answer: no space left on device"):
        answer(folder / "wing.xml", run)
    assert {p: p.read_bytes() for p in run.rglob("*") if p.is_file()} == before


INNER = REQUEST.replace(
    "  <Lattice",
    """  <Model ID="box" Wrapper="somebody">
    <Variable ID="width" Value="0.2"/><Variable ID="skew" Value="0.1"/><Analysis ID="mass"/>
  </Model>
  <Lattice""",
)


def somebody(asked, source, folder):
    """A modeler of skewed boxes, curved in its variables, with exact derivatives."""
    assert source.target.get("Wrapper") == "somebody"
    rest = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)], float)
    faces = np.array(BOX.split()[26:62], int).reshape(-1, 3) - 1
    w, s = (asked.find(name).value for name in ("width", "skew"))
    x, y, z = rest.T
    points = np.stack([x * np.exp(w), y + s**2 * z, z * (1 + w * s)], axis=1)
    columns = {
        asked.find("width").name: np.stack([x * np.exp(w), 0 * y, z * s], axis=1),
        asked.find("skew").name: np.stack([0 * x, 2 * s * z, z * w], axis=1),
    }
    gradient = dict.fromkeys(columns, 1.0)
    results = {"Model__box__Analysis__mass": Quantity(w + s, gradient)}
    return Answer(asked, {"box": Linearised(ml.Surface(points, faces), columns)}, results)


def test_derivatives_go_through_a_model_within(folder):
    case = load(folder / "case.toml")
    source = Design(Document(INNER.encode(), folder / "wing.xml"))
    names = {"width": 0.2, "skew": 0.1, "lift": 0.3, "dz[3,1]": 0.1}
    way = dict(zip(names, (0.3, -0.4, 0.1, 0.05), strict=True))

    def at(step):
        design = source
        for name, value in names.items():
            element = design.find(name).element
            text = f"{value + step * way[name]:.17e}"
            design = Design(design.document.with_attribute(element, "Value", text))
        found = of_case(case, design, behind(case, design, source, folder, somebody))
        return found, np.asarray(found.surfaces["wing"].surface.points)

    found, points = at(0.0)
    inner = "Model__wing__Model__box__"
    assert found.results[inner + "Analysis__mass"].value == pytest.approx(0.3)
    columns = found.surfaces["wing"].columns
    assert columns.keys() == {inner + "Variable__width", inner + "Variable__skew", LIFT, DZ}
    by = {source.find(name).name: way[name] for name in names}
    for value, slope in (
        (lambda a: a[1], sum(columns[name] * by[name] for name in by)),
        (
            lambda a: a[0].results["Model__wing__Function__cubed"].value * 1e27,
            1e27 * sum(
                slope * by[name]
                for name, slope in found.results["Model__wing__Function__cubed"].gradient.items()
            ),
        ),
    ):  # fmt: skip
        here = value((found, points))
        misses = [np.linalg.norm(value(at(h)) - here - h * slope) for h in (0.02, 0.01)]
        assert misses[1] > 1e-6 * np.linalg.norm(slope)
        assert np.log2(misses[0] / misses[1]) == pytest.approx(2.0, abs=0.1)


def test_a_model_within_takes_the_place_of_a_geometry(folder):
    wrong = INNER.replace('<Model ID="box"', '<Model ID="ball"')
    source = Design(Document(wrong.encode(), folder / "wing.xml"))
    with pytest.raises(MoldlineError, match=r"line 4: Model 'ball': its ID must be .*: box"):
        served(source, source, folder)
    other = Design(Document(INNER.encode(), folder / "x.xml"))
    with pytest.raises(MoldlineError, match="Model 'box': is not within Model 'wing' of"):
        served(other, Design(read(folder / "wing.xml")), folder)
