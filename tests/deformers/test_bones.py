"""Bones: their axes, the tree, and the file they are kept in."""

import json
import math

import numpy as np
import pytest

from moldline.deformers.bones import Bone, Bones
from moldline.errors import FileError, MoldlineError, ParameterError

FILE = """
units = "cm"

[[bone]]
name = "tip"
parent = "root"
head = [0, 500, 0]
tail = [100, 900, 50]
reach = 300.0

[[bone]]
name = "root"
head = [0, 0, 0]
tail = [0, 500, 0]
up = [0, 0.1, 1]
radii = [30, 20]
distance = 70
strength = 2
"""


@pytest.fixture
def file(tmp_path):
    """Writes text to a file of bones and says where it is."""

    def written(text, name="bones.toml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return written


def chain(count):
    return [
        Bone(f"b{i}", (0, i, 0), (0, i + 1, 0), parent=f"b{i - 1}" if i else None)
        for i in range(count)
    ]


def test_a_bone_along_the_span_has_the_axes_of_space():
    assert np.array_equal(Bone("b", (1, 0, 0), (1, 2, 0)).axes, np.eye(3))


@pytest.mark.parametrize("tail", [(1, 2, 3), (0, 0, 1), (0.05, 0, -1), (1, 0, 0)])
def test_axes_are_right_handed_with_y_along_the_bone(tail):
    axes = Bone("b", (0, 0, 0), tail).axes
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), rtol=0, atol=1e-15)
    np.testing.assert_allclose(axes[:, 1], np.array(tail) / np.linalg.norm(tail), rtol=1e-15)
    assert np.linalg.det(axes) > 0


def test_up_turns_the_axes_about_the_bone():
    axes = Bone("b", (0, 0, 0), (0, 1, 0), up=(1, 5, 0)).axes
    np.testing.assert_allclose(axes, [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], rtol=0, atol=1e-15)


def test_parents_come_first_whatever_the_order_in_the_file():
    bones = Bones(tuple(chain(6)[::-1]))
    assert bones.order.tolist() == [5, 4, 3, 2, 1, 0]
    assert bones.parents.tolist() == [1, 2, 3, 4, 5, -1]


def test_a_long_chain_is_ordered_at_once():
    assert len(Bones(tuple(chain(5000)[::-1])).order) == 5000


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"tail": (0, 0, 0)}, "tail: the bone has no length: head and tail are"),
        ({"head": (0, 0)}, r"head: 3 numbers, got \(0, 0\)"),
        ({"head": "abc"}, "head: a number between -1e50 and 1e50, got 'a'"),
        ({"head": (0, math.nan, 0)}, "head: a number between"),
        ({"tail": (True, 1, 0)}, "tail: a number between -1e50 and 1e50, got True"),
        ({"up": (0, 3, 0)}, "up: .* has no part across the bone"),
        ({"up": (0, 0, 0)}, "up: .* has no part across the bone"),
        ({"radii": (0, 1)}, r"radii: above 0, got \(0.0, 1.0\)"),
        ({"reach": -math.inf}, "reach: a number between"),
        ({"distance": -1}, "distance: not below 0, got -1"),
        ({"name": ""}, "name: a name of printable characters, got ''"),
        ({"parent": "a\nb"}, "parent: a name of printable characters"),
    ],
)
def test_what_is_no_bone_is_refused(options, said):
    with pytest.raises(ParameterError, match=said):
        Bone(**({"name": "b", "head": (0, 0, 0), "tail": (0, 1, 0)} | options))


def test_trees_that_are_none_are_refused():
    one, two, three = chain(3)
    with pytest.raises(ParameterError, match="one bone at least"):
        Bones(())
    with pytest.raises(ParameterError, match="two bones are named 'b0'"):
        Bones((one, two, one))
    with pytest.raises(
        ParameterError, match=r"bone 'b2': no bone is named as its parent, 'b1'; there is: b0, b2"
    ):
        Bones((one, three))
    circle = Bone("b0", (0, 0, 0), (0, 1, 0), parent="b2")
    with pytest.raises(ParameterError, match=r"'b0' is its own ancestor \(b0 < b2 < b1"):
        Bones((circle, two, three))
    with pytest.raises(ParameterError, match="'b' is its own ancestor"):
        Bones((Bone("b", (0, 0, 0), (0, 1, 0), parent="b"),))


def test_bones_are_read_from_a_file_in_its_unit(file):
    tip, root = Bones.read(file(FILE))
    assert tip.head == (0, 5, 0)
    assert (tip.parent, root.parent) == ("root", None)
    assert (tip.reach, root.reach) == (3.0, math.inf)
    assert root.radii == (0.3, 0.2)
    assert root.distance == pytest.approx(0.7)
    assert (root.strength, root.up) == (2.0, (0, 0.1, 1))


@pytest.mark.parametrize("name", ["again.toml", "again.json"])
def test_bones_read_back_as_they_were_written(file, tmp_path, name):
    bones = Bones.read(file(FILE))
    bones.write(tmp_path / name)
    assert Bones.read(tmp_path / name) == bones


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[0, 500, 0]\nup", '[0, "500", 0]\nup', r"bone\.1\.tail: a number between .* got '500'"),
        ("head = [0, 0, 0]\n", "", r"bone\.1\.head: must be there; a bone has name, head, tail"),
        ("up =", "roll =", r"bone\.1\.roll: there is no such key; a bone has"),
        ('units = "cm"', 'units = "yd"', "units: one of m, .* got 'yd'"),
        ('units = "cm"', "unit = 1", "'unit': there is no such key, only bone and units"),
        ('parent = "root"', 'parent = "rot"', "bone 'tip': no bone is named as its parent, 'rot'"),
        ("distance = 70", "distance = 1e999", r"bone\.1\.distance: a number between"),
        ("distance = 70", "distance = 2026-01-01", r"bone\.1\.distance: a number between"),
        ("[[bone]]", "[[bones]]", "bone: a list of bones must be there"),
        ("strength", "strength ", None),
        ("[[bone]]", "[[bone", "not TOML: "),
    ],
)
def test_a_wrong_file_is_refused_with_its_name_and_key(file, old, new, said):
    path = file(FILE.replace(old, new))
    if said is None:
        assert len(Bones.read(path)) == 2
        return
    with pytest.raises(FileError, match=rf"bones\.toml: {said}"):
        Bones.read(path)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("b.json", '{"bone": [1]}', r"bone\.0: a table with name, head and tail, got 1"),
        ("b.json", '{"bone": {}}', "a list of bones must be there"),
        ("b.json", "[" * 100000, "nested too deep"),
        ("b.json", '{"bone": ' + "9" * 5000 + "}", "not JSON"),
        ("b.json", '{"bone": []}', "one bone at least, got none"),
        ("b.xyz", FILE, r"files that end in \.toml or \.json"),
        ("b.toml", "a = " + "[" * 100000, "nested too deep|not TOML"),
    ],
)
def test_other_content_is_refused_too(file, name, text, said):
    with pytest.raises(FileError, match=said):
        Bones.read(file(text, name))


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(FileError, match=r"nowhere\.toml"):
        Bones.read(tmp_path / "nowhere.toml")


def test_damaged_files_give_only_our_errors(file):
    """Cut anywhere, with characters replaced, or with values of any kind for each key."""
    rng = np.random.default_rng(0)
    texts = [FILE[:n] for n in range(0, len(FILE), 9)]
    for _ in range(150):
        letters = list(FILE)
        for place in rng.integers(0, len(letters), 3):
            letters[place] = chr(rng.integers(9, 127))
        texts.append("".join(letters))
    read = 0
    for text in texts:
        try:
            Bones.read(file(text))
            read += 1
        except MoldlineError as error:
            assert "bones.toml: " in str(error)
    assert 0 < read < len(texts)


def test_values_of_any_kind_give_only_our_errors(file):
    odd = [
        None,
        True,
        -1,
        0,
        1e308,
        10**400,
        "",
        "b",
        [],
        [1],
        [1, 2],
        [[1, 2, 3]] * 3,
        {},
        {"a": 1},
    ]
    odd += [
        [0, 0, 1e-320],
        [1e300] * 3,
        [10**400] * 3,
        [math.nan] * 3,
        [None] * 3,
        math.inf,
        -math.inf,
    ]
    bone = {"name": "b", "head": [0, 0, 0], "tail": [0, 1, 0]}
    keys = ["name", "parent", "head", "tail", "up", "radii", "reach", "distance", "strength"]
    for key in keys:
        for value in odd:
            path = file(json.dumps({"bone": [bone | {key: value}]}), "bones.json")
            try:
                assert np.isfinite(Bones.read(path).axes).all()
            except MoldlineError as error:
                assert "bones.json: " in str(error)


def test_random_trees_are_ordered_or_refused():
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(200):
        count = int(rng.integers(1, 9))
        parents = [f"b{i}" if i < count else None for i in rng.integers(0, count + 12, count)]
        made = [Bone(f"b{i}", (0, 0, i), (0, 1, i), parent=p) for i, p in enumerate(parents)]
        try:
            bones = Bones(tuple(made))
        except ParameterError:
            refused += 1
            continue
        places = np.argsort(bones.order)
        assert sorted(bones.order) == list(range(count))
        for child, parent in enumerate(bones.parents):
            assert parent < 0 or places[parent] < places[child]
    assert 0 < refused < 200
