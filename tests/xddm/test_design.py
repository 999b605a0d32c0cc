"""Design documents drive Models and their wetted surfaces."""

import numpy as np
import pytest

import moldline as ml
from moldline.errors import GeometryError, MoldlineError, ParameterError
from moldline.mesh import quality
from moldline.mesh.io.sensitivities import read_sensitivities
from moldline.xddm.chain import Quantity
from moldline.xddm.design import driven
from moldline.xddm.document import Document, read
from moldline.xddm.exchange import Answer, Linearised, deliver
from moldline.xddm.model import Design

PART = """<Model ID="{name}" Wrapper="balls">
  <Variable ID="radius" Value="{radius}" Min="0.1" Max="9"/>
  <Variable ID="place[1]" Value="{place}"/>
  <Analysis ID="girth"/>
</Model>
"""
DESIGN = """<?xml version="1.0" encoding="ISO-8859-1"?>
<Optimize>
  <Configure Sensitivity="Required"/>
  <Intersect ID="all" Parts="one.xml, two.xml,pin.tri"/>
  <Intersect ID="alone" Parts="two.xml"/>
  <Model ID="one">
    <Variable ID="radius" Value="1.1"/>
    <Analysis ID="girth"/>
  </Model>
  <DesignPoint ID="A" Geometry="all">
    <Variable ID="alpha" Value="2"/>
    <Analysis ID="area" Measure="area"/>
    <Analysis ID="CL" Value="0.5"><AeroFun>optForce CL 2 0 0 1 0. 1. 0 entire</AeroFun>
      <SensitivityArray>
        <Sensitivity P="Optimize__DesignPoint__A__Variable__alpha" Value="0.1"/>
        <Sensitivity P="Model__two__Variable__radius" Value="0.02"/>
      </SensitivityArray>
    </Analysis>
    <Analysis ID="CD"/>
    <Function ID="polar" Expr="CD/CL"/>
    <Function ID="lift" Expr="CL*area"/>
  </DesignPoint>
  <Analysis ID="bulk" Geometry="alone" Measure="volume"/>
  <Objective ID="total"
    Expr="area^2/bulk + Model__two__Variable__radius*Model__two__Analysis__girth"/>
  <Constraint ID="room" Expr="bulk" Min="1" Bound="Lower"/>
</Optimize>
"""
ONE, TWO = "Optimize__Model__one__Variable__radius", "Model__two__Variable__radius"
PLACES = {1: "Model__one__Variable__place[1]", 2: "Model__two__Variable__place[1]"}


@pytest.fixture
def folder(tmp_path, ball):
    for name, radius, place in (("one", 1.0, 0.0), ("two", 0.8, 0.9)):
        text = PART.format(name=name, radius=radius, place=place)
        (tmp_path / f"{name}.xml").write_text(text)
    turned = np.asarray(ball.points)[:, [1, 2, 0]] @ np.array(
        [[1, 0.2, 0.1], [0, 1, 0.3], [0, 0, 1]]
    )
    pin = 0.3 * turned + [0.123, 1.01, 0.077]
    ml.write(tmp_path / "pin.tri", ml.Surface(pin, ball.faces))
    return tmp_path


@pytest.fixture
def balls(ball):
    """A modeler: balls that are no balls, curved in their variables, derivatives exact."""
    shear = np.array([[1, 0.13, 0.07], [0, 1, 0.11], [0, 0, 1]])
    points = np.asarray(ball.points) @ shear.T

    def serve(asked, source, folder):
        radius, place = (asked.find(name).value for name in ("radius", "place[1]"))
        moved = points * [radius, radius, radius**2] + [place, 0.1 * place**2, 0.03]
        columns = {
            asked.find("radius").name: points * [1, 1, 2 * radius],
            asked.find("place[1]").name: np.zeros_like(points) + [1, 0.2 * place, 0],
        }
        girth = {asked.find("girth").name: Quantity(3 * radius**2, {
            asked.find("radius").name: 6 * radius, asked.find("place[1]").name: 0.0})}  # fmt: skip
        if not asked.switch:
            columns, girth = {}, {k: Quantity(v.value) for k, v in girth.items()}
        surface = ml.Surface(moved, ball.faces)
        return Answer(asked, {asked.target.id: Linearised(surface, columns)}, girth)

    return serve


def run(folder, balls, text=DESIGN):
    design = Design(Document(text.encode(), folder / "design.xml"))
    return driven(design, design, folder, balls)


def test_a_design_has_values_and_gradients_of_all_that_is_geometry(folder, balls):
    found = run(folder, balls)
    results = found.results
    wetted, alone = found.surfaces["all"], found.surfaces["alone"]
    assert wetted.surface.components == ("one", "two", "pin")
    assert wetted.columns.keys() == {ONE, PLACES[1], TWO, PLACES[2]}
    area = results["Optimize__DesignPoint__A__Analysis__area"]
    assert area.value == pytest.approx(float(quality.area(wetted.surface)), rel=1e-13)
    bulk = results["Optimize__Analysis__bulk"].value
    assert bulk == pytest.approx(float(quality.signed_volume(alone.surface)), rel=1e-13)
    assert results["Optimize__Model__one__Analysis__girth"].value == pytest.approx(3 * 1.1**2)
    assert results["Optimize__Constraint__room"].gradient[TWO] == pytest.approx(4 * bulk / 0.8)
    lift = results["Optimize__DesignPoint__A__Function__lift"]
    assert lift.gradient["Optimize__DesignPoint__A__Variable__alpha"] == 0.1 * area.value
    assert lift.gradient[TWO] == pytest.approx(0.02 * area.value + 0.5 * area.gradient[TWO])
    assert found.notes == (
        "Optimize__DesignPoint__A__Function__polar waits for a Value of "
        "Optimize__DesignPoint__A__Analysis__CD",
    )


def test_gradients_are_right_to_the_second_order(folder, balls):
    name = "Optimize__Objective__total"
    texts = {n: (folder / f"{n}.xml").read_text() for n in ("one", "two")}

    def at(step):
        for model, old, way in (("one", 0.0, 0.02), ("two", 0.9, -0.03)):
            new = texts[model].replace(f'"{old}"', f'"{old + step * way!r}"')
            new = new.replace('"0.8"', f'"{0.8 + 0.02 * step!r}"')
            (folder / f"{model}.xml").write_text(new)
        text = DESIGN.replace('"1.1"', f'"{1.1 + 0.05 * step!r}"')
        return run(folder, balls, text).results[name]

    here = at(0.0)
    g = here.gradient
    slope = 0.05 * g[ONE] + 0.02 * g[TWO] + 0.02 * g[PLACES[1]] - 0.03 * g[PLACES[2]]
    misses = [abs(at(h).value - here.value - h * slope) for h in (0.2, 0.1)]
    assert misses[1] > 1e-9 * here.value
    assert np.log2(misses[0] / misses[1]) == pytest.approx(2.0, abs=0.1)


def test_the_answer_is_in_the_document_and_beside_it(folder, balls):
    deliver(run(folder, balls), folder)
    said = Design(read(folder / "model.output.xml"))
    assert [v.id for v in said.values if v.value is None] == ["CD", "polar"]
    arrays = [v.id for v in said.values if v.element.first("SensitivityArray")]
    assert arrays == ["girth", "area", "CL", "lift", "bulk", "total", "room"]
    _, columns = read_sensitivities(folder / "design/geometry_all/Components.i.tri")
    assert columns.keys() == {ONE, TWO, *PLACES.values()}  # twins go by their full names
    each = read_sensitivities(folder / "design/geometry_alone/geometry")[1]
    assert each.keys() == {TWO, PLACES[2]}
    _, own = read_sensitivities(folder / "models/one/Components.i.tri")
    assert own.keys() == {"radius", "place[1]"}
    assert Design(read(folder / "models/one/model.output.xml")).find("girth").value > 3.6


def test_without_derivatives_there_are_none(folder, balls):
    found = run(folder, balls, DESIGN.replace('"Required"', '"None"'))
    assert not found.surfaces["all"].columns
    assert found.results["Optimize__Objective__total"].value > 0
    deliver(found, folder)
    assert "Optimize__Objective" not in (folder / "model.output.xml").read_text()


@pytest.mark.parametrize(
    ("old", "new", "error", "message"),
    [
        ("pin.tri", "pan.tri", MoldlineError, "Parts: no file 'pan.tri'; looked at"),
        ('ID="radius" Value="1.1"', 'ID="width" Value="1"', MoldlineError,
         "line 7: Variable 'width': .*one.xml has no Model__one__Variable__width; it has: Model"),
        ('ID="alone" Parts', "Parts", MoldlineError, "each of several Intersects needs an ID of"),
        ('Geometry="alone" ', "", MoldlineError, "Analysis 'bulk': say of which Intersect"),
        ('Geometry="alone" ', 'Geometry="lone" ', MoldlineError, "'lone' is the ID of no Inter"),
        ('"volume"', '"bulk"', MoldlineError, "Analysis 'bulk': no measures? named 'bulk'"),
        ('ID="all" Parts', 'ID="all" Symmetry="w" Parts', GeometryError,
         "line 4: Intersect 'all': a union's symmetry is one of"),
        ("one.xml, two.xml,pin.tri", "pin.tri, two.xml", GeometryError, "Intersect 'all': .*apart"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_design_is_told(folder, balls, old, new, error, message):
    assert old in DESIGN
    with pytest.raises(error, match=message):
        run(folder, balls, DESIGN.replace(old, new))


def test_a_model_that_fails_is_named(folder):
    def fail(*_):
        raise ParameterError("out of steel")

    with pytest.raises(ParameterError, match=r"design.xml: Model 'one': out of steel"):
        run(folder, fail)


def test_no_name_leads_out_of_the_folder(folder, balls):
    evil = DESIGN.replace('"alone"', '"../../out"')
    with pytest.raises(ParameterError, match=r"the ID '../../out' cannot name a folder"):
        deliver(run(folder, balls, evil), folder)
    (folder / "two.xml").write_text(PART.format(name="../two", radius=0.8, place=0.9))
    with pytest.raises(ParameterError, match=r"the ID '../two' cannot name a folder"):
        run(folder, balls)
