"""Pilots and measures in case files."""

import tomllib

import jsonschema
import numpy as np
import pytest

import moldline as ml
from moldline.case import case, json_schema
from moldline.errors import CaseError

TEXT = """
moldline = 1
[geometry.ball]
file = "ball.tri"
[variable.up]
value = 0.1
[variable.tank]
[[stage]]
deformer = "pilots"
name = "held"
[stage.hidden]
deformer = "lattice"
shape = [4, 3, 3]
margin = 0.2
[stage.pilot.top]
measure = "position"
spot = { vertex = 2 }
along = "z"
[stage.pilot.width]
measure = "distance"
start = { vertex = 1 }
end = { near = [0.0, -2.0, 0.0] }
[stage.constraint.volume]
measure = "volume"
[stage.constraint.bottom]
measure = "position"
spot = { vertex = 5 }
along = "z"
bounds = [-1.01, inf]
[[stage.link]]
variable = "up"
link = "named"
parameter = "top"
[[stage.link]]
variable = "tank"
link = "named"
parameter = "width"
[measure.volume]
measure = "volume"
bounds = [4, 5]
[measure.high]
measure = "position"
spot = { vertex = 2 }
"""


@pytest.fixture
def folder(tmp_path, ball):
    """A folder with a geometry to write case files beside."""
    ml.write(tmp_path / "ball.tri", ball)
    return tmp_path


def loaded(folder, text=TEXT):
    path = folder / "case.toml"
    path.write_text(text)
    return ml.load(path)


def test_a_case_of_pilots_says_what_python_says(folder):
    made = loaded(folder)
    ball = made.pipeline.geometry
    m, spot = ml.measures, ml.Spot.vertex
    pilots = ml.Pilots(
        ball,
        {"top": m.Position(spot(2), "z"), "width": m.Distance(spot(1), spot(4))},
        {
            "volume": m.Volume(ball.faces),
            "bottom": ml.Constraint(m.Position(spot(5), "z"), -1.01),
        },
        ml.Lattice.around(ball, (4, 3, 3), margin=0.2),
    )
    ours = pilots.bind(ball.points)(np.array([0.1, 0.0]))
    np.testing.assert_allclose(made.pipeline().points, ours, rtol=0, atol=1e-12)
    measured = made.measurements()
    assert list(measured) == ["volume", "high"]
    volume = float(np.asarray(m.Volume(ball.faces)(ball.points))[0])
    assert measured["volume"] == pytest.approx([volume], abs=1e-10)
    assert measured["high"] == pytest.approx([0, 0, 1.1], abs=1e-10)
    assert made.measurements.beyond(measured) == {}


def test_without_a_hidden_deformer_there_is_a_lattice_and_several_are_a_chain(folder):
    start, end = TEXT.index("[stage.hidden]"), TEXT.index("[stage.pilot.top]")
    made = loaded(folder, TEXT[:start] + TEXT[end:])
    assert isinstance(made.pipeline.stages[0].deformer.net, ml.Lattice)
    hidden = TEXT[start:end].replace("[stage.hidden]", "[[stage.hidden]]")
    made = loaded(folder, TEXT[:start] + hidden + hidden + TEXT[end:])
    assert len(made.pipeline.stages[0].deformer.net.parts) == 2


def test_a_saved_case_reads_the_same_elsewhere(folder):
    text = (
        TEXT
        + """
[measure.gap]
measure = "clearance"
other = "other.tri"
"""
    )
    ball = ml.read(folder / "ball.tri")
    ml.write(folder / "other.tri", ball.moved(np.asarray(ball.points) + [4.0, 0, 0]))
    made = loaded(folder, text)
    (folder / "there").mkdir()
    made.save(folder / "there/case.toml", {"up": 0.05})
    again = ml.load(folder / "there/case.toml")
    np.testing.assert_array_equal(again.pipeline().points, made.pipeline({"up": 0.05}).points)
    assert again.measurements()["gap"] == pytest.approx(made.measurements()["gap"], rel=1e-2)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('measure = "position"', 'measure = "positon"', r"stage.0.pilot.top: no measures named"),
        ("{ vertex = 2 }", "{ vertx = 2 }", r"stage.0.pilot.top.spot.vertx: there is no such key"),
        ("{ vertex = 2 }", "{ vertex = 9999 }", r"stage.0.pilot.top: .*9999"),
        (
            "{ vertex = 2 }",
            "{ chord = 0.3 }",
            r"stage.0.pilot.top: a place by chord needs its side",
        ),
        ("[-1.01, inf]", "[1, -1]", r"stage.0.constraint.bottom: bounds .* leave no choice"),
        ('"lattice"', '"latice"', r"stage.0.hidden: no deformers named 'latice'"),
        ("[4, 3, 3]", "[4, 3]", r"stage.0.hidden.shape: too few entries"),
        ('parameter = "top"', 'parameter = "tip"', r"no parameter 'tip'; there is: top, width"),
        ("margin = 0.2", "margn = 0.2", r"stage.0.hidden.margn: there is no such key"),
        ("bounds = [4, 5]", "bounds = [4]", r"measure.volume.bounds: too few entries"),
    ],
)
def test_a_wrong_key_is_told_with_its_place(folder, old, new, message):
    with pytest.raises(CaseError, match=message):
        loaded(folder, TEXT.replace(old, new, 1))


def test_a_pilot_has_no_bounds(folder):
    wrong = TEXT.replace('along = "z"', 'along = "z"\nbounds = [0, 1]', 1)
    with pytest.raises(CaseError, match=r"stage.0: a pilot is prescribed, so it has no bounds"):
        loaded(folder, wrong)


def test_the_schema_knows_pilots_and_their_measures(folder):
    schema = json_schema()
    jsonschema.validate(tomllib.loads(TEXT), schema)
    for old, new in (("{ vertex = 2 }", "{ vertx = 2 }"), ('"distance"', '"distnce"')):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(tomllib.loads(TEXT.replace(old, new, 1)), schema)


def test_pilots_are_not_streamed(folder, tmp_path):
    ml.write(folder / "ball.stl", ml.read(folder / "ball.tri"), binary=True)
    path = folder / "case.toml"
    path.write_text(TEXT.replace("ball.tri", "ball.stl"))
    with pytest.raises(CaseError, match="must see the whole geometry"):
        case.load(path, sampled=True)
