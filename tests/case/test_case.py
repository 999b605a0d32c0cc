"""Case files: what they say, what they refuse, and their schema."""

import json
import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import moldline as ml
from moldline.case import json_schema
from moldline.errors import CaseError, ParameterError

EXAMPLE = Path(__file__).parent.parent.parent / "examples/transport_wing.toml"

TEXT = """
moldline = 1
[geometry.ball]
file = "ball.tri"
[variable.t]
size = 3
bounds = [-1, 1]
[[stage]]
deformer = "lattice"
shape = [3, 2, 2]
[[stage.link]]
variable = "t"
link = "thickness"
along = "x"
axis = "z"
"""


@pytest.fixture
def folder(tmp_path, ball):
    """A folder with a geometry to write case files beside."""
    ml.write(tmp_path / "ball.tri", ball)
    return tmp_path


def written(folder, text):
    path = folder / "case.toml"
    path.write_text(text)
    return path


def test_a_case_file_says_what_python_says(folder):
    case = ml.load(written(folder, TEXT))
    ball = ml.read(folder / "ball.tri")
    box = ml.Lattice.around(ball, shape=(3, 2, 2))
    t = ml.variable("t", size=3, bounds=(-1, 1))
    ours = ml.Pipeline(ball, [ml.Stage(box, {t: ml.links.thickness(box, along="x", axis="z")})])
    values = {"t": [0.1, -0.2, 0.3]}
    np.testing.assert_array_equal(case.pipeline(values).points, ours(values).points)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("moldline = 1", "moldline = 2", "format version 2 found, expected 1"),
        ("size = 3", "size = 0", "variable.t.size.*greater than or equal to 1, got 0"),
        ("size = 3", "sise = 3", "variable.t.sise: there is no such key, got 3"),
        ("bounds = [-1, 1]", "bounds = [2, 1]", "variable.t: .*leave no choice"),
        ('file = "ball.tri"', 'file = "bell.tri"', "geometry.ball.file: .*bell.tri: no such file"),
        ('"lattice"', '"lattce"', "no deformers named 'lattce'; installed: .*lattice"),
        ("shape = [3, 2, 2]", "shape = [3, 2]", r"stage.0.shape: too few entries, got \[3, 2\]"),
        (
            "shape = [3, 2, 2]",
            "shape = [3, 2, 2]\nmargins = 1",
            "stage.0.margins: there is no such key, got 1",
        ),
        ("shape = [3, 2, 2]", "shape = [3, 2, 0]", "stage.0: .*three counts of at least 1"),
        ('variable = "t"', 'variable = "u"', "link.0.variable: got 'u', expected one of t"),
        ('link = "thickness"', 'link = "thick"', "stage.0.link.0.link: .*got 'thick'"),
        (
            'along = "x"',
            'along = "q"',
            "stage.0.link.0.along: input should be 'x', 'y' or 'z'.*got 'q'",
        ),
        ("size = 3", "size = 4", "takes 3 numbers, the variable has 4; make its size 3"),
        ("moldline = 1", "moldline = ", "not TOML: .*line 2"),
        ("size = 3", "size = 3\n[variable.idle]", "variable.idle: no stage has a link to it"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(folder, old, new, message):
    path = written(folder, TEXT.replace(old, new))
    with pytest.raises(CaseError, match=f"(?s)case.toml.*{message}"):
        ml.load(path)


def test_a_missing_case_file_is_told(tmp_path):
    with pytest.raises(CaseError, match=r"none.toml: cannot be read"):
        ml.load(tmp_path / "none.toml")


def test_values_outside_their_bounds_are_refused(folder):
    case = ml.load(written(folder, TEXT))
    with pytest.raises(ParameterError, match=r"t\[1\] = 3 is outside \[-1, 1\]"):
        case.values({"t": [0, 3, 0]})


def test_a_saved_case_reads_back_with_its_new_values(folder):
    case = ml.load(written(folder, TEXT))
    case.save(folder / "again.toml", {"t": [0.1, 0.2, 0.3]})
    again = ml.load(folder / "again.toml")
    assert again.pipeline.variables["t"].value == (0.1, 0.2, 0.3)
    np.testing.assert_array_equal(
        again.pipeline().points, case.pipeline({"t": [0.1, 0.2, 0.3]}).points
    )


def test_a_rider_moves_with_its_geometry(folder):
    text = TEXT + '[rider.flow]\nfile = "ball.tri"\n'
    case = ml.load(written(folder, text))
    values = {"t": [0.1, -0.2, 0.3]}
    flow = case.rider("flow")
    np.testing.assert_array_equal(flow(values).points, case.pipeline(values).points)
    with pytest.raises(ParameterError, match=r"no rider named 'structure'; it has: flow"):
        case.rider("structure")


def test_lengths_in_inches_are_metres_inside(folder):
    text = TEXT.replace('file = "ball.tri"', 'file = "ball.tri"\nunits = "in"')
    case = ml.load(written(folder, text))
    inches = ml.read(folder / "ball.tri").points
    np.testing.assert_allclose(case.pipeline.geometry.points, inches * 0.0254, rtol=1e-15)


def test_the_schema_accepts_the_example_and_refuses_what_it_must():
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    example = tomllib.loads(EXAMPLE.read_text())
    jsonschema.validate(example, schema)
    example["stage"][0]["margins"] = 1
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(example, schema)


def test_the_schema_is_the_one_in_the_docs():
    path = EXAMPLE.parent.parent / "docs/case.schema.json"
    assert json.loads(path.read_text()) == json.loads(json.dumps(json_schema())), (
        "run: moldline schema -o docs/case.schema.json"
    )


def test_a_case_that_is_saved_keeps_its_comments(folder):
    text = TEXT.replace("size = 3", "size = 3  # stations").replace(
        "[[stage]]", "# a box\n[[stage]]"
    )
    case = ml.load(written(folder, text))
    case.save(folder / "same.toml")
    assert (folder / "same.toml").read_text() == text
    case.save(folder / "other.toml", {"t": [0.1, 0.2, 0.3]})
    found = (folder / "other.toml").read_text()
    assert found.replace("value = [0.1, 0.2, 0.3]\n", "") == text
    case.save(folder / "rest.toml", {"t": [0.0, 0.0, 0.0]})
    assert (folder / "rest.toml").read_text() == text
