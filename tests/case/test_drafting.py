"""Cases begun and gone on with, a stage at a time, and put elsewhere."""

import tomllib

import numpy as np
import pytest

import moldline as ml
from moldline.case.case import of_text
from moldline.case.drafting import drafted, relocated
from moldline.errors import CaseError, FileError, ParameterError

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
SIDES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
TRIANGLES = [half for a, b, c, d in SIDES for half in ((a, b, c), (a, c, d))]


@pytest.fixture
def folder(tmp_path, ball):
    """A folder with a ball, in inches."""
    ml.write(tmp_path / "ball.tri", ball)
    return tmp_path


def begun(folder, kind="lattice", **options):
    """A new case of the ball."""
    options = options or {"shape": [3, 3, 2]}
    return drafted("", folder, kind, geometry="ball.tri", units="in", options=options)


def test_a_case_is_begun_with_a_stage(folder, ball):
    found = begun(folder)
    assert found.stage == 0 and found.variables == ["move_x", "move_y", "move_z"]
    assert found.text.startswith("# made for ball.tri by moldline; edit it\n# 3 x 3 x 2 control")
    case = of_text(found.text, folder)
    np.testing.assert_allclose(case.pipeline.points(), 0.0254 * np.asarray(ball.points), rtol=1e-12)
    assert case.pipeline.variables["move_x"].upper[0] < 0.0254
    assert sorted(path.name for path in folder.iterdir()) == ["ball.tri"]


def test_each_further_stage_has_variables_and_files_of_its_own(folder):
    text, hand = begun(folder).text, "# by hand\n"
    text = text.replace("[variable.move_x]", f"{hand}[variable.move_x]")
    cage = drafted(text, folder, "cage", options={"faces": 60})
    assert cage.stage == 1 and cage.variables == ["move_x_2", "move_y_2", "move_z_2"]
    again = drafted(cage.text, folder, "cage", options={"faces": 60})
    assert again.stage == 2 and again.variables == ["move_x_3", "move_y_3", "move_z_3"]
    assert {"ball_cage.obj", "ball_cage_2.obj"} < {path.name for path in folder.iterdir()}
    assert hand in again.text
    case = of_text(again.text, folder)
    assert [len(stage.links) for stage in case.pipeline.stages] == [3, 3, 3]
    files = [table.model_extra.get("file") for table in case.tables.stage]
    assert files == [None, "ball_cage.obj", "ball_cage_2.obj"]
    assert [stage.carried for stage in case.pipeline.stages] == [False, True, True]


def test_a_count_of_none_is_by_proportion(folder):
    shapes = []
    for asked in ({}, {"shape": [0, 0, 0]}, {"shape": [5, 0, 2]}):
        text = drafted("", folder, "lattice", geometry="ball.tri", options=asked).text
        shapes.append(tomllib.loads(text)["stage"][0]["shape"])
    assert shapes[0] == shapes[1] and shapes[2] == [5, shapes[0][1], 2]


def test_control_points_added_later_come_along_with_what_moved_before(folder):
    text = drafted("", folder, "lattice", geometry="ball.tri", options={"shape": [2, 2, 2]}).text
    text = drafted(text, folder, "lattice", options={"shape": [3, 3, 3]}).text
    pipeline = of_text(text, folder).pipeline
    lift = {"move_z": np.full(8, 0.2)}
    lower = {"move_z_2": np.full(27, -0.2)}
    at_rest = np.asarray(pipeline.points())
    np.testing.assert_allclose(pipeline.points({**lift, **lower}), at_rest, atol=1e-12)


def test_a_hand_is_given_variables_without_bounds(folder):
    found = drafted(
        "", folder, "lattice", geometry="ball.tri", is_bounded=False, options={"shape": [2, 2, 2]}
    )
    move = of_text(found.text, folder).pipeline.variables["move_x"]
    assert np.isinf(move.upper).all() and 0 < move.typical < 0.2


def test_pilots_hold_the_places_that_are_named(folder, ball):
    text = begun(folder).text
    top = 0.0254 * np.array([[0, 0, 1.0], [0, 1.0, 0]])
    found = drafted(
        text,
        folder,
        "pilots",
        options={"spots": top.tolist(), "names": ["top", "side"], "along": "xz"},
    )
    assert found.variables == ["move_top", "move_side"] and found.why.startswith(
        "4 numbers: 2 places"
    )
    pipeline = of_text(found.text, folder).pipeline
    moved = np.asarray(pipeline.points({"move_top": [0.0, 0.003]}))
    spot = np.argmax(np.asarray(ball.points)[:, 2])
    np.testing.assert_allclose(moved[spot], top[0] + [0, 0, 0.003], atol=1e-12)


def test_a_stage_on_a_part_comes_before_what_takes_the_part(tmp_path):
    ml.write(tmp_path / "body.tri", ml.Surface(CUBE * [4, 1, 1], TRIANGLES))
    ml.write(tmp_path / "wing.tri", ml.Surface(CUBE * [0.5, 3, 0.2] + [0.3, 0.4, 0.3], TRIANGLES))
    text = "moldline = 1\n"
    for name in ("body", "wing"):
        text += f'[geometry.{name}]\nfile = "{name}.tri"\n'
    text += '[[stage]]\nmodeler = "union"\nof = ["body", "wing"]\nto = "all"\n'
    shape = {"shape": [2, 2, 2]}
    part = drafted(text, tmp_path, "lattice", on="wing", options=shape)
    whole = drafted(part.text, tmp_path, "lattice", on="all", options=shape)
    assert (part.stage, whole.stage) == (0, 2)
    assert [s.on for s in of_text(whole.text, tmp_path).pipeline.own_stages] == ["all"]
    with pytest.raises(ParameterError, match="on: got '', expected one of body, wing, all"):
        drafted(text, tmp_path, "lattice", options=shape)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"kind": "lettice"}, "no kind 'lettice'; there is: lattice, wing-lattice"),
        ({"options": {"shpe": [2, 2, 2]}}, "lattice takes no shpe"),
        ({"options": {"shape": [2, 2]}}, "lattice"),
        ({"options": {"shape": "wide"}}, "lattice cannot be made with shape = 'wide'"),
        ({"options": {"shape": [2, 2, 1e9]}}, "lattice"),
        ({"options": {"component": "tail"}}, "no component named 'tail'"),
        ({"geometry": None}, "a new case needs a geometry"),
        ({"kind": "pilots", "options": {}}, "missing a? ?1? ?required .*spots"),
        ({"kind": "pilots", "options": {"spots": [[0, 0]]}}, "spots are places in space"),
        ({"kind": "pilots", "options": {"spots": [[9, 9, 9]]}}, "nothing is near"),
        ({"kind": "pilots", "options": {"spots": [[0, 0, 1]], "names": ["a b"]}}, "a word"),
        ({"kind": "pilots", "options": {"spots": [[0, 0, 1]], "names": []}, "on": "x"}, None),
        ({"kind": "pilots", "options": {"spots": [[0, 0, 1]], "along": "q"}}, "of x, y and z"),
    ],
)
def test_what_cannot_be_drafted_is_refused(folder, given, told):
    own = {"kind": "lattice", "geometry": "ball.tri", "options": {"shape": [2, 2, 2]}, **given}
    kind = own.pop("kind")
    if told is None:
        assert drafted("", folder, kind, **own).variables == ["move_p1"]
        return
    with pytest.raises(ml.errors.MoldlineError, match=told):
        drafted("", folder, kind, **own)
    assert sorted(path.name for path in folder.iterdir()) == ["ball.tri"]


def test_what_is_no_case_or_no_folder_is_refused(folder):
    for text, told in (("moldline = 9", "format version 9"), ("[[", "not TOML")):
        with pytest.raises(CaseError, match=f"the case's text: .*{told}"):
            drafted(text, folder, "lattice", options={})
    with pytest.raises(FileError, match="is no folder"):
        drafted("", folder / "none", "lattice", geometry="ball.tri", options={})
    with pytest.raises(ParameterError, match="says what its geometries are"):
        drafted(begun(folder).text, folder, "lattice", geometry="ball.tri", options={})
    gone = begun(folder).text.replace("ball.tri", "bell.tri")
    with pytest.raises(CaseError, match=r"the case's text: geometry.ball.file: .*no such file"):
        drafted(gone, folder, "cage", options={})


def test_a_case_is_put_elsewhere_with_its_files_found(folder, tmp_path_factory):
    text = drafted(begun(folder).text, folder, "cage", options={"faces": 60}).text
    text = text.replace("moldline = 1", "moldline = 1  # ours")
    want = of_text(text, folder).pipeline.points({"move_x": np.full(18, 0.001)})
    place = tmp_path_factory.mktemp("other") / "case.toml"
    found = relocated(text, folder, place)
    assert found == place.read_text() and "# ours" in found
    assert tomllib.loads(found)["geometry"]["ball"]["file"] == str(folder / "ball.tri")
    points = ml.load(place).pipeline.points({"move_x": np.full(18, 0.001)})
    np.testing.assert_array_equal(points, want)
    above = relocated(found, place.parent, folder.parent / "case.toml")
    assert tomllib.loads(above)["geometry"]["ball"]["file"] == f"{folder.name}/ball.tri"
    assert relocated(text, folder, folder / "case.toml") == text


def test_files_beside_a_case_come_with_it_where_that_is_asked_for(folder, tmp_path_factory):
    text = drafted(begun(folder).text, folder, "cage", options={"faces": 60}).text
    other = tmp_path_factory.mktemp("other")
    (other / "ball.tri").write_text("somebody else's")
    tables = tomllib.loads(relocated(text, folder, other / "case.toml", gather=True))
    assert tables["geometry"]["ball"]["file"] == "ball_2.tri"
    assert tables["stage"][1]["file"] == "ball_cage.obj"
    assert (other / "ball.tri").read_text() == "somebody else's"
    for path in folder.iterdir():
        path.unlink()
    assert len(ml.load(other / "case.toml").pipeline.stages) == 2
    with pytest.raises(FileError, match="there is no folder"):
        relocated(text, folder, other / "none" / "case.toml")


def test_a_lattice_over_a_region_turns_what_is_not_frozen_at_its_sides(folder):
    region = [[-9.0, -0.01, 0.0], [9.0, 0.01, 9.0]]
    found = begun(folder, shape=[3, 7, 6], region=region)
    pipeline = of_text(found.text, folder).pipeline
    frozen = pipeline.stages[0].deformer.frozen
    assert frozen.any() and pipeline.variables["move_z"].size == np.count_nonzero(~frozen)
