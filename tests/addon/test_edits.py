"""What is written into a case: tables and edits, names and units."""

import importlib
import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
edits = importlib.import_module("bl_ext.user_default.moldline.edits")
kinds = importlib.import_module("bl_ext.user_default.moldline.measure_kinds")
legend = importlib.import_module("bl_ext.user_default.moldline.legend")

CASE = {
    "variable": {
        "lift": {"size": 2, "bounds": [-1.0, 1.0], "unit": "m"},
        "sweep": {"value": [20.0, 30.0], "bounds": [[10, 30], [20, 40]], "unit": "deg"},
        "free": {},
    },
    "stage": [
        {"link": [{"variable": "lift"}, {"variable": "sweep"}, {"variable": "lift"}]},
        {},
        {"link": [{"variable": "lift"}]},
    ],
}


def test_sizes_values_and_bounds_are_those_of_a_case_file():
    told = edits.variables(CASE)
    assert [edits.size_of(one) for one in told.values()] == [2, 2, 1]
    assert edits.values_of(told["lift"]) == [0.0, 0.0]
    assert edits.bounds_of(told["lift"]) == [(-1.0, 1.0)] * 2
    assert edits.bounds_of(told["sweep"]) == [(10.0, 30.0), (20.0, 40.0)]
    assert edits.bounds_of(told["free"]) == [(-math.inf, math.inf)]
    assert edits.labels_of("sweep", told["sweep"]) == ["sweep[0]", "sweep[1]"]


def test_a_variable_goes_with_its_links_the_last_first():
    assert edits.removed_variable(CASE, "lift") == [
        {"remove": ["stage", 2, "link", 0]},
        {"remove": ["stage", 0, "link", 2]},
        {"remove": ["stage", 0, "link", 0]},
        {"remove": ["variable", "lift"]},
    ]


def test_links_follow_a_new_name():
    found = edits.changed_variable(CASE, "lift", "bend", CASE["variable"]["lift"])
    assert found[0] == {"set": ["variable", "bend"], "to": CASE["variable"]["lift"]}
    assert [one["set"] for one in found[1:4]] == [
        ["stage", 0, "link", 0, "variable"],
        ["stage", 0, "link", 2, "variable"],
        ["stage", 2, "link", 0, "variable"],
    ]
    assert found[4] == {"remove": ["variable", "lift"]}


def test_only_what_changes_is_written():
    table = {"size": 2, "bounds": [-2.0, 1.0], "typical": 0.1}
    found = edits.changed_variable(CASE, "lift", "lift", table)
    assert found == [
        {"remove": ["variable", "lift", "unit"]},
        {"set": ["variable", "lift", "bounds"], "to": [-2.0, 1.0]},
        {"set": ["variable", "lift", "typical"], "to": 0.1},
    ]


def test_another_unit_says_the_same_in_other_numbers():
    found = edits.in_unit(CASE["variable"]["sweep"], "rad")
    assert found["value"] == pytest.approx(np.radians([20.0, 30.0]))
    np.testing.assert_allclose(found["bounds"], np.radians([[10, 30], [20, 40]]))
    assert edits.in_unit({"value": 1.0, "unit": "ft"}, "in") == pytest.approx(
        {"value": 12.0, "unit": "in"}
    )


@pytest.mark.parametrize("name", ["", "two words", "2nd", "a-b"])
def test_a_name_is_one_word(name):
    with pytest.raises(edits.Wrong, match="one word"):
        edits.check_name(name, (), "variable")


def test_names_are_not_taken_twice():
    with pytest.raises(edits.Wrong, match="there is a variable 'lift' already"):
        edits.check_name("lift", CASE["variable"], "variable")
    assert edits.unique("volume", ["volume", "volume_2"]) == "volume_3"


def test_bounds_leave_a_choice():
    assert edits.check_bounds(np.float32(-0.1), np.float32(0.1)) == [-0.1, 0.1]
    with pytest.raises(edits.Wrong, match="below the upper one, got 1 and 1"):
        edits.check_bounds(1.0, 1.0)
    assert edits.bounds_around([2.0, 2.0], 0.5, False) == [1.5, 2.5]
    assert edits.bounds_around([2.0, -4.0], 0.5, True) == [[1.0, 3.0], [-6.0, -2.0]]
    with pytest.raises(edits.Wrong, match="by more than 0"):
        edits.bounds_around([2.0], 0.0, False)


def test_measures_are_held_as_they_are():
    assert edits.kept("FREE", [2.0], 0.1) is None
    assert edits.kept("EQUAL", [2.0], 0.1) == [2.0, 2.0]
    assert edits.kept("LEAST", [2.0, 3.0], 0.1) == [[2.0, math.inf], [3.0, math.inf]]
    assert edits.kept("MOST", [2.0], 0.1) == [-math.inf, 2.0]
    assert edits.kept("BETWEEN", [-2.0], 0.1) == [-2.2, -1.8]
    assert edits.kept("NUMBERS", [2.0], 0.1, -math.inf, 3.0) == [-math.inf, 3.0]
    with pytest.raises(edits.Wrong, match="no number is at least 2 and at most 1"):
        edits.kept("NUMBERS", [2.0], 0.1, 2.0, 1.0)


def test_stations_that_are_wholly_frozen_are_none():
    assert edits.stations((3, 2, 2), "x") == 3
    frozen = [n < 4 or n == 5 for n in range(12)]  # all of the first, one of the second
    assert edits.stations((3, 2, 2), "x", frozen) == 2


@pytest.mark.parametrize(
    ("kind", "asked", "sentence"),
    [
        ("position", {}, "needs 1 selected vertex"),
        ("distance", {"vertices": [1]}, "needs 2 selected vertices"),
        ("rigid", {"vertices": [1, 2]}, "at least 3"),
        ("cross_section", {"along": "y"}, "at which stations"),
        ("cross_section", {"at": "1, two", "along": "y"}, "got '1, two'"),
        ("cross_section", {"at": "1"}, "along which axis"),
        ("chord", {"at": "1, 2"}, "at one station"),
        ("thickness", {}, "at which part of the chord"),
        ("thickness", {"chord": "1.5"}, "from 0 to 1"),
        ("enclosed", {}, "select an object"),
        ("beauty", {}, "no measure 'beauty'"),
    ],
)
def test_a_measure_says_what_it_needs(kind, asked, sentence):
    with pytest.raises(edits.Wrong, match=sentence):
        kinds.table(kind, kinds.Asked(**asked))


def test_measures_are_tables_of_a_case():
    asked = kinds.Asked("wing", "3, 5", "0.3", "", "y", True, [4, 7])
    assert kinds.table("thickness", asked) == {
        "measure": "thickness",
        "chord": 0.3,
        "at": [3.0, 5.0],
        "relative": True,
        "component": "wing",
    }
    assert kinds.table("distance", asked) == {
        "measure": "distance",
        "start": {"vertex": 4},
        "end": {"vertex": 7},
    }


def test_colours_of_signed_numbers_are_grey_at_zero_and_even_about_it():
    scale = legend.Scale("lift", "m", 2.0, True)
    low, middle, high = scale.shades(np.array([-2.0, 0.0, 2.0]))
    assert np.ptp(middle) == 0.0
    assert low[2] > low[0] and high[0] > high[2]
    assert [said for _, said in scale.ticks] == ["-2", "-1", "0", "1", "2"]


def test_colours_reach_blender_as_linear_light():
    scale = legend.Scale("lift", "m", 1.0, False)
    rgba = scale.rgba(np.linspace(0.0, 1.0, 5))
    assert rgba.shape == (5, 4) and np.all(rgba[:, 3] == 1.0)
    shade = scale.shades(np.array([1.0]))[0, 0]
    assert rgba[-1, 0] == pytest.approx(((shade + 0.055) / 1.055) ** 2.4)
    brightness = scale.rgba(np.linspace(0.0, 1.0, 50))[:, :3] @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(brightness) > 0)
