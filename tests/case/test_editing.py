"""Edits of a case's text: what they change, what they leave, what they refuse."""

import math
import tomllib
from pathlib import Path

import pytest

from moldline.case.editing import amended
from moldline.errors import CaseError, ParameterError

EXAMPLES = sorted(
    path
    for path in (Path(__file__).parents[2] / "examples").glob("*.toml")
    if "moldline" in tomllib.loads(path.read_text())
)
TEXT = next(path for path in EXAMPLES if path.stem == "transport_wing").read_text()


def test_a_value_is_set_where_it_stands_and_all_else_stays():
    found = amended(TEXT, [{"set": ["variable", "bend", "bounds"], "to": [-1.0, math.inf]}])
    before, after = TEXT.splitlines(), found.splitlines()
    changed = [(old, new) for old, new in zip(before, after, strict=True) if old != new]
    assert changed == [("bounds = [-3.0, 3.0]", "bounds = [-1.0, inf]")]


def test_a_stage_and_its_variables_are_added_and_removed_to_the_letter():
    link = {"variable": "top", "link": "named", "parameter": "p"}
    stage = {
        "deformer": "pilots",
        "pilot": {"p": {"measure": "position", "spot": {"near": [33.0, 8.0, 5.0]}}},
        "link": [link],
    }
    found = amended(
        TEXT,
        [
            {"set": ["variable", "top"], "to": {"size": 3, "unit": "m"}},
            {"append": ["stage"], "value": stage},
            {"append": ["stage", 0, "link"], "value": {**link, "link": "group", "axis": "z"}},
            {"set": ["measure", "volume"], "to": {"measure": "volume", "bounds": [1.0, math.inf]}},
        ],
    )
    tables = tomllib.loads(found)
    assert tables["stage"][2] == stage and len(tables["stage"][0]["link"]) == 2
    assert all(line in found.splitlines() for line in TEXT.splitlines())
    assert "[variable.top]\nsize = 3" in found and "\n\n[[stage]]\ndeformer = " in found
    back = [["measure", "volume"], ["stage", 2], ["stage", 0, "link", 1], ["variable", "top"]]
    assert amended(found, [{"remove": path} for path in back]) == TEXT


def test_a_stage_is_put_before_another():
    stage = {"deformer": "lattice", "shape": [2, 2, 2]}
    found = amended(TEXT, [{"insert": ["stage", 1], "value": stage}])
    old, new = (tomllib.loads(text)["stage"] for text in (TEXT, found))
    assert new == [old[0], stage, old[1]]
    assert all(line in found for line in TEXT.splitlines() if "#" in line)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_takes_a_stage_and_gives_it_back(path):
    text = path.read_text()
    count = len(tomllib.loads(text)["stage"])
    stage = {"deformer": "lattice", "shape": [2, 2, 2], "link": []}
    found = amended(text, [{"append": ["stage"], "value": stage}])
    assert tomllib.loads(found)["stage"][-1]["shape"] == [2, 2, 2]
    assert all(line in found for line in text.splitlines() if line.startswith("#"))
    assert tomllib.loads(amended(found, [{"remove": ["stage", count]}])) == tomllib.loads(text)


def test_tables_in_an_odd_order_are_edited_too():
    text = """\
moldline = 1
[variable.a]
value = 1.0  # first
[[stage]]
deformer = "lattice"
shape = [2, 2, 2]
[variable.b]
value = 2.0  # second
[[stage]]
deformer = "lattice"
shape = [3, 2, 2]
link = [{variable = "a", link = "controls"}]
"""
    wanted = tomllib.loads(text)
    wanted["variable"]["b"]["value"], wanted["variable"]["c"] = 3.0, {"size": 2}
    wanted["stage"][1]["link"].append({"variable": "b", "link": "controls"})
    del wanted["stage"][0]
    edits = [
        {"set": ["variable", "b", "value"], "to": 3.0},
        {"set": ["variable", "c"], "to": {"size": 2}},
        {"append": ["stage", 1, "link"], "value": {"variable": "b", "link": "controls"}},
        {"remove": ["stage", 0]},
    ]
    assert tomllib.loads(amended(text, edits)) == wanted


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        ({"set": ["variable"], "to": 3}, "variable: input should be a valid dictionary, got 3"),
        ({"set": ["varable", "x"], "to": {}}, "varable: there is no such key"),
        ({"set": ["stage", 0, "link", 0, "link"], "to": "each2"}, r"stage.0.link.0.link: input"),
    ],
)
def test_what_is_no_case_any_more_is_refused_with_the_key(edit, told):
    with pytest.raises(CaseError, match=f"^the case's text: {told}"):
        amended(TEXT, [edit])


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        ({"remove": ["stage", 7]}, "edit 0: stage.7: 7 is no index of 2, counted from 0"),
        ({"remove": ["variable", "twist"]}, "'twist' is not there; there is: thickness, bend"),
        ({"set": ["moldline", "x"], "to": 1}, "moldline.x: there is no table to set it in"),
        ({"set": ["stage", -1], "to": {}}, "-1 is no index of 2"),
        ({"set": ["variable", 0], "to": 1}, "variable.0: 0 is no key of it"),
        ({"append": ["stage", 0, "deformer"], "value": 1}, "stage.0.deformer: is no list"),
        ({"append": ["moldline", "x"], "value": 1}, "'x' is no key of it"),
        ({"insert": ["stage", 3], "value": {}}, "it takes a place from 0 to 2"),
        ({"insert": ["variable", 0], "value": {}}, "variable.0: is no list"),
        ({"set": ["variable", "bend", "value"], "to": math.nan}, "nan is no value"),
        ({"set": ["variable", "bend", "value"], "to": [1.0, None]}, "value.1: None is no value"),
        ({"set": ["variable", "bend", "value"]}, "set needs 'to'; to take a key out, remove it"),
        ({"set": [], "to": 1}, "a path is a list of keys and indices, got"),
        ({"set": [True], "to": 1}, "a path is a list of keys and indices, got"),
        ({"set": "stage", "to": 1}, "a path is a list of keys and indices, got 'stage'"),
        ({"put": ["stage"], "to": 1}, "one of set, remove, append, insert, got"),
        ({"set": ["a"], "remove": ["b"], "to": 1}, "one of set, remove, append, insert, got"),
        ("stage", "one of set, remove, append, insert, got 'stage'"),
    ],
)
def test_an_edit_that_cannot_be_made_says_which_and_why(edit, told):
    with pytest.raises(ParameterError, match=told):
        amended(TEXT, [edit])


def test_too_many_edits_and_too_deep_ones_are_refused():
    with pytest.raises(ParameterError, match="1001 edits; at most 1000"):
        amended(TEXT, [{"remove": ["x"]}] * 1001)
    deep = 1.0
    for _ in range(30):
        deep = [deep]
    with pytest.raises(ParameterError, match="nested too deep"):
        amended(TEXT, [{"set": ["variable", "bend", "value"], "to": deep}])
