"""What a hand takes hold of, and the values that follow it."""

import json

import numpy as np
import pytest
from servers import CASE
from test_operations import CUBE, JOINED, TRIANGLES, asked
from wings import body, wing

import moldline as ml
from moldline.server.held import opened
from moldline.server.protocol import ServerError

HEAD = CASE.split("[variable")[0]
BOX = 'deformer = "lattice"\nshape = [2, 3, 2]\nmargin = [0.1, 0.1, 0.1]\n'
"""Control points at x and z = -1.2 and 1.2, and y = -1.2, 0 and 1.2."""


def case(folder, variables, *stages):
    """A case of the ball: sizes of variables, or tables; and stages with their links."""
    text = HEAD
    for name, table in variables.items():
        text += f"[variable.{name}]\n{table if isinstance(table, str) else f'size = {table}'}\n"
    for stage, *links in stages:
        text += f"[[stage]]\n{stage}\n"
        for link in links:
            text += "[[stage.link]]\n" + "".join(
                f"{k} = {json.dumps(v)}\n" for k, v in link.items()
            )
    return opened({"text": text, "folder": str(folder)})


def each(name, axis="z", **where):
    """A link of every control point."""
    return {"variable": name, "link": "each", "axis": axis, **where}


def named(name, parameter, **where):
    """A link of a parameter."""
    return {"variable": name, "link": "named", "parameter": parameter, **where}


def places(held, number=0, **values):
    """Where the points of a handle are."""
    return asked(held, "handles", values=values).arrays[f"moved.{number}"]


def followed(held, moved, stage=0, touched=None, **values):
    """Values and what is missed."""
    arrays = {"moved": moved} if touched is None else {"moved": moved, "touched": touched}
    told = asked(held, "follow", arrays, stage=stage, values=values)
    found = {k.removeprefix("values."): v for k, v in told.arrays.items() if "values." in k}
    return found, told


@pytest.fixture
def folder(tmp_path, ball):
    """Where the ball is."""
    ml.write(tmp_path / "ball.tri", ball)
    return tmp_path


def test_a_control_point_that_a_hand_drags_goes_there_and_the_others_stay(folder):
    held = case(folder, {"x": 12, "z": 12}, (BOX, each("x", "x"), each("z", "z")))
    told = asked(held, "handles")
    (handle,) = told.header["handles"]
    assert handle["kind"] == "net" and handle["labels"][5] == "0,2,1" and handle["on"] == "ball"
    moved = told.arrays["rest.0"].copy()
    np.testing.assert_array_equal(moved, told.arrays["moved.0"])
    assert told.arrays["lines.0"].shape == (20, 2) and not told.arrays["frozen.0"].any()
    moved[5] += [0.1, 0.0, -0.2]
    found, answer = followed(held, moved)
    np.testing.assert_allclose(found["x"], 0.1 * np.eye(12)[5], atol=1e-15)
    np.testing.assert_allclose(found["z"], -0.2 * np.eye(12)[5], atol=1e-15)
    assert answer.header["miss"] == {"distance": pytest.approx(0, abs=1e-15), "at_bounds": []}
    want = held.case.pipeline.points(found)
    np.testing.assert_array_equal(answer.arrays["points"], want)


def test_what_no_number_moves_is_told_by_its_distance(folder):
    held = case(folder, {"z": 12}, (BOX, each("z")))
    moved = places(held)
    moved[3] += [0.3, 0.4, 0.1]
    found, answer = followed(held, moved)
    np.testing.assert_allclose(found["z"], 0.1 * np.eye(12)[3], atol=1e-15)
    np.testing.assert_allclose(answer.header["miss"]["distance"], 0.5, rtol=1e-12)


def test_a_hand_stops_at_bounds_and_the_numbers_there_are_told(folder):
    bounded = "size = 12\nbounds = [-0.1, 0.2]"
    held = case(folder, {"z": bounded}, (BOX, each("z")))
    moved = places(held)
    moved[[3, 7]] += [[0, 0, 1.0], [0, 0, -1.0]]
    found, answer = followed(held, moved)
    np.testing.assert_array_equal(found["z"], np.eye(12)[3] * 0.2 - np.eye(12)[7] * 0.1)
    assert answer.header["miss"]["at_bounds"] == ["z[3]", "z[7]"]
    np.testing.assert_allclose(answer.header["miss"]["distance"], 0.9, rtol=1e-12)


def test_a_mirrored_partner_follows_the_point_that_is_dragged(folder):
    held = case(folder, {"z": 12}, (BOX, each("z", mirrored="y")))
    moved = places(held)
    moved[4] += [0, 0, 0.3]  # at y = 1.2; its partner is number 0
    found, answer = followed(held, moved)
    np.testing.assert_allclose(answer.header["miss"]["distance"], 0, atol=1e-8)
    after = places(held, **{k: v.tolist() for k, v in found.items()})
    np.testing.assert_allclose(after[[0, 4], 2] - moved[0, 2], 0.3, rtol=1e-7)
    touched = np.arange(12) == 4
    moved[4] += [0, 0, 0.1]  # it was not told where its partner went
    found, answer = followed(held, moved, touched=touched, **found)
    np.testing.assert_allclose(found["z"][4], 0.4, rtol=1e-7)


def test_camber_and_thickness_leave_the_other_side_where_it_is(folder):
    links = [
        {"variable": name, "link": name, "along": "x", "axis": "z"}
        for name in ("camber", "thickness")
    ]
    held = case(folder, {"camber": 2, "thickness": 2}, (BOX, *links))
    moved = places(held)
    moved[1::2][:3] += [0, 0, 0.2]  # the upper ones of the first station
    found, answer = followed(held, moved)
    np.testing.assert_allclose(found["camber"], [0.1, 0], atol=1e-9)
    np.testing.assert_allclose(found["thickness"], [0.2, 0], atol=1e-9)
    one = places(held)
    one[1] += [0, 0, 0.2]  # of a station a single point: the least motion that takes it there
    found, answer = followed(held, one)
    np.testing.assert_allclose(answer.header["miss"]["distance"], 0, atol=1e-6)
    after = places(held, **{k: v.tolist() for k, v in found.items()})
    np.testing.assert_allclose(after[1], one[1], atol=1e-6)


def test_numbers_that_share_points_keep_their_bounds_too(folder):
    links = [
        {"variable": name, "link": name, "along": "x", "axis": "z"}
        for name in ("camber", "thickness")
    ]
    tables = {"camber": "size = 2\nbounds = [-0.05, 0.05]", "thickness": 2}
    held = case(folder, tables, (BOX, *links))
    moved = places(held)
    moved[1] += [0, 0, 0.2]
    found, answer = followed(held, moved)
    assert found["camber"][0] == 0.05 and answer.header["miss"]["at_bounds"] == ["camber[0]"]
    np.testing.assert_allclose(found["thickness"][0], 0.3, rtol=1e-6)


def test_a_hand_turns_the_numbers_of_single_points_before_those_of_groups(folder):
    links = [each("z"), {"variable": "all", "link": "group", "axis": "z"}]
    held = case(folder, {"z": 12, "all": 1}, (BOX, *links))
    moved = places(held, all=0.1)
    moved[2] += [0, 0, 0.2]
    found, _ = followed(held, moved, all=0.1)
    assert [*found] == ["z"]
    np.testing.assert_allclose(found["z"], 0.2 * np.eye(12)[2], atol=1e-15)


def test_frozen_points_stay(folder):
    link = each("z", index=[[1, 0, 0], [1, 1, 0]])
    held = case(folder, {"z": 2}, (BOX.replace("[2, 3, 2]", "[4, 3, 2]") + 'freeze = ["x+"]', link))
    told = asked(held, "handles")
    frozen = told.arrays["frozen.0"]
    assert frozen.any() and not frozen.all()
    moved = told.arrays["moved.0"] + [0, 0, 0.1]
    found, answer = followed(held, moved)
    np.testing.assert_allclose(answer.header["miss"]["distance"], 0.1, rtol=1e-9)
    after = places(held, **{k: v.tolist() for k, v in found.items()})
    np.testing.assert_array_equal(after[frozen], told.arrays["moved.0"][frozen])


def test_a_child_box_is_held_where_its_parent_has_carried_it(folder):
    parent = {"variable": "up", "link": "group", "axis": "z"}
    child = 'deformer = "lattice"\ncarried = true\nshape = [2, 2, 2]\n'
    child += "low = [-0.5, -0.5, -0.5]\nhigh = [0.5, 0.5, 0.5]\n"
    held = case(folder, {"up": 1, "x": 8}, (BOX, parent), (child, each("x", "x")))
    rest = asked(held, "handles").arrays["rest.1"]
    np.testing.assert_allclose(places(held, 1, up=0.3), rest + [0, 0, 0.3], atol=1e-12)
    moved = rest + [0, 0, 0.3]
    moved[6] += [0.2, 0, 0]
    found, answer = followed(held, moved, 1, up=0.3)
    np.testing.assert_allclose(found["x"], 0.2 * np.eye(8)[6], atol=1e-9)
    np.testing.assert_allclose(answer.header["miss"]["distance"], 0, atol=1e-12)


def test_a_part_of_a_union_is_held_by_its_own_box(tmp_path):
    ml.write(tmp_path / "body.tri", ml.Surface(CUBE * [4, 1, 1], TRIANGLES))
    part = CUBE * [0.5, 3, 0.2] + [0.3, 0.4, 0.3]
    ml.write(tmp_path / "wing.tri", ml.Surface(part, TRIANGLES))
    held = opened({"text": JOINED, "folder": str(tmp_path)})
    (handle,) = asked(held, "handles").header["handles"]
    assert handle["stage"] == 0 and handle["on"] == "wing"
    found, answer = followed(held, places(held) + [3.0, 0, 0])
    np.testing.assert_allclose(found["shift"], 3.0, rtol=1e-12)
    assert answer.header["made_anew"]
    np.testing.assert_array_equal(answer.arrays["points"], held.case.pipeline(found).points)
    _, answer = followed(held, places(held))
    assert not answer.header["made_anew"]


def wings(tmp_path):
    """A wing with its skeleton."""
    ml.write(tmp_path / "ball.tri", wing([0.0, 1.0, 2.0], [1.0, 0.8, 0.5], [0.02, 0.0, -0.03]))
    names = ("span", "chord", "sweep", "dihedral", "twist")
    sizes = dict(zip(names, (1, 3, 2, 2, 3), strict=True))
    links = [named(name, name) for name in names]
    return case(tmp_path, sizes, ('deformer = "wing_skeleton"\nstations = 3', *links))


def bodies(tmp_path):
    """A body with its skeleton."""
    ml.write(tmp_path / "ball.tri", body())
    names = {"nose": 1, "cabin": 1, "tail": 1, "radius": 5, "height": 5}
    links = [named(name, name) for name in names]
    return case(tmp_path, names, ('deformer = "body_skeleton"\nstations = 5', *links))


def boned(tmp_path, ball):
    """Two bones in a lattice."""
    ml.write(tmp_path / "ball.tri", ball)
    rows = [{"name": "inner", "head": [0, 0, 0], "tail": [0, 0.5, 0]}]
    rows += [{"name": "outer", "head": [0, 0.5, 0], "tail": [0.1, 1, 0], "parent": "inner"}]
    (tmp_path / "bones.json").write_text(json.dumps({"bone": rows}))
    parts = ("rotation", "translation", "stretch")
    names = {
        f"{bone}.{part}": n
        for bone in ("inner", "outer")
        for part, n in zip(parts, (3, 3, 1), strict=True)
    }
    links = [named(name.replace(".", "_"), name) for name in names]
    sizes = {name.replace(".", "_"): size for name, size in names.items()}
    stage = 'deformer = "skeleton"\nbones = "bones.json"\nshape = [2, 3, 2]'
    return case(tmp_path, sizes, (stage, *links))


def hinged(tmp_path, ball):
    """A hinge across the ball."""
    ml.write(tmp_path / "ball.tri", ball)
    stage = 'deformer = "hinge"\nstart = [0.2, -1, 0]\nend = [0.4, 1, 0]\nblend_width = 0.2'
    return case(tmp_path, {"angle": 1}, (stage, named("angle", "angle")))


def held_by_pilots(tmp_path, ball):
    """Two pilots, behind a lattice whose motion they see."""
    ml.write(tmp_path / "ball.tri", ball)
    stage = (
        'deformer = "pilots"\n[stage.pilot.top]\nmeasure = "position"\nspot = {near = [0, 0, 1]}\n'
    )
    stage += '[stage.pilot.side]\nmeasure = "position"\nspot = {near = [0, 1, 0]}\nalong = "y"'
    return case(
        tmp_path,
        {"up": 1, "top": 3, "side": 1},
        (BOX, {"variable": "up", "link": "group", "axis": "z"}),
        (stage, named("top", "top"), named("side", "side")),
    )


POSED = {
    "wing": (lambda p, b: wings(p), 0, "bones", ["station 0", "station 1", "station 2"]),
    "body": (lambda p, b: bodies(p), 0, "bones", None),
    "skeleton": (boned, 0, "bones", ["inner", "outer"]),
    "hinge": (hinged, 0, "bones", ["hinge"]),
    "pilots": (held_by_pilots, 1, "marks", ["top", "side"]),
}


@pytest.mark.parametrize("kind", POSED)
def test_bones_and_pilots_are_put_where_a_hand_wants_them(tmp_path, ball, kind):
    make, stage, shown, labels = POSED[kind]
    held = make(tmp_path, ball)
    told = asked(held, "handles", values={"up": 0.1} if kind == "pilots" else {})
    handle = told.header["handles"][stage]
    assert handle["kind"] == shown and handle["stage"] == stage
    assert labels is None or handle["labels"] == labels
    hand, start = held.hands[stage], held.case.values({"up": 0.1} if kind == "pilots" else {})
    rng = np.random.default_rng(1)
    numbers = hand.reach.numbers(start) + 0.1 * rng.uniform(-1, 1, len(hand.reach.typical))
    base = {k: np.asarray(v).tolist() for k, v in start.items()}
    wanted = {k: v.tolist() for k, v in hand.reach.named(numbers).items()}
    goal = places(held, stage, **{**base, **wanted})
    found, answer = followed(held, goal, stage, **base)
    assert answer.header["miss"]["distance"] < 1e-10
    for name, value in wanted.items():
        np.testing.assert_allclose(found[name], value, atol=1e-8)


@pytest.mark.parametrize("kind", POSED)
def test_slopes_of_what_a_hand_holds_are_exact(tmp_path, ball, kind):
    make, stage, *_ = POSED[kind]
    held = make(tmp_path, ball)
    hand, full = held.hands[stage], held.case.values({"up": 0.1} if kind == "pilots" else {})
    rng = np.random.default_rng(0)
    start = hand.reach.numbers(full) + 0.1 * rng.normal(size=len(hand.reach.typical))
    along = 0.3 * rng.normal(size=len(start))

    def at(numbers):
        return hand.places({**full, **hand.reach.named(numbers)}).ravel()

    slope = hand.slopes({**full, **hand.reach.named(start)}) @ along
    left = [np.linalg.norm(at(start + h * along) - at(start) - h * slope) for h in (1 / 8, 1 / 16)]
    if kind in ("pilots", "body"):  # which are linear
        assert max(left) < 1e-12
    else:
        np.testing.assert_allclose(np.log2(left[0] / left[1]), 2.0, atol=0.15)


def test_a_wing_bone_is_a_section_at_rest(tmp_path):
    held = wings(tmp_path)
    bones = asked(held, "handles").arrays["rest.0"]
    skeleton = held.case.pipeline.stages[0].deformer
    chords = np.linalg.norm(bones[:, 1] - bones[:, 0], axis=1)
    np.testing.assert_allclose(chords, skeleton.net.scales, rtol=1e-12)
    np.testing.assert_allclose(bones[:, 0, 1], skeleton.net.stations, atol=1e-12)
    turned = places(held, twist=[0, 0, np.radians(3)])
    along = turned[2, 1] - turned[2, 0]
    angle = np.arctan2(-along[2], along[0])
    np.testing.assert_allclose(angle, skeleton.twist[2] + np.radians(3), atol=1e-12)


def test_a_bone_that_is_drawn_aft_sweeps_the_panels_beside_it_and_no_other_section_moves(tmp_path):
    held = wings(tmp_path)
    rest = places(held)
    moved = rest.copy()
    moved[1] += [0.1, 0, 0]
    found, answer = followed(held, moved)
    assert answer.header["miss"]["distance"] < 1e-7
    assert found["sweep"][0] > 0 > found["sweep"][1]
    after = places(held, **{k: v.tolist() for k, v in found.items()})
    np.testing.assert_allclose(after, moved, atol=1e-6)


def test_what_cannot_follow_is_refused(folder):
    held = case(folder, {"z": 12}, (BOX, each("z")))
    moved = places(held)
    for fields, arrays, told in (
        ({}, {"moved": moved}, "no stage has nothing that a hand can move; stages that do: 0"),
        ({"stage": 1}, {"moved": moved}, "stage 1 has nothing"),
        ({"stage": "0"}, {"moved": moved}, "stage '0' has nothing"),
        ({"stage": True}, {"moved": moved}, "stage True has nothing"),
        ({"stage": 0}, {}, "this needs an array 'moved'"),
        ({"stage": 0}, {"moved": moved[:5]}, r"must have the shape \(12, 3\), got \(5, 3\)"),
        ({"stage": 0}, {"moved": moved * np.nan}, "must be finite"),
        ({"stage": 0}, {"moved": moved, "touched": np.ones(3)}, r"shape \(12\), got \(3,\)"),
    ):
        with pytest.raises(ServerError, match=told):
            asked(held, "follow", arrays, **fields)


def test_colours_are_motion_along_the_outward_normal_or_its_size(folder, ball):
    held = case(folder, {"all": 1}, (BOX, {"variable": "all", "link": "group", "axis": "z"}))
    out = asked(held, "colour", variable="all").arrays["colour"]
    np.testing.assert_allclose(out, np.asarray(ball.points)[:, 2], atol=2e-2)
    size = asked(held, "colour", variable="all", how="size").arrays["colour"]
    np.testing.assert_allclose(size, 1.0, rtol=1e-12)
    for fields, told in (
        ({"variable": "al"}, "no variable 'al'; there is: all"),
        ({"variable": "all", "number": 1}, "has 1 numbers, counted from 0, got 1"),
        ({"variable": "all", "how": "red"}, "'how' is 'normal' or 'size', got 'red'"),
    ):
        with pytest.raises(ServerError, match=told):
            asked(held, "colour", **fields)


def test_faces_that_are_not_sound_are_told_by_number(tmp_path, ball):
    faces = np.asarray(ball.faces)
    ml.write(tmp_path / "ball.tri", ml.Surface(ball.points, np.concatenate([faces, faces[7:8]])))
    told = asked(opened({"text": CASE, "folder": str(tmp_path)}), "check")
    assert not told.header["is_sound"]
    assert {7, len(faces)} & {*told.arrays["bad_faces"].tolist()}
    ml.write(tmp_path / "ball.tri", ball)
    assert not len(
        asked(opened({"text": CASE, "folder": str(tmp_path)}), "check").arrays["bad_faces"]
    )
