"""Variables are defined from what is selected, edited, bounded, renamed and removed."""

import tomllib

import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import amending, edits, project, session, view
from conftest import ball, write_tri

NET = """\
moldline = 1

[geometry.ball]
file = "ball.tri"
units = "m"

# A comment of a person.
[variable.lift]
size = 2
bounds = [-1.0, 1.0]
unit = "m"

[[stage]]
name = "box"
deformer = "lattice"
low = [-1.2, -1.2, -1.2]
high = [1.2, 1.2, 1.2]
shape = [2, 3, 2]
{more}

[[stage.link]]
variable = "lift"
link = "camber"
along = "x"
axis = "z"
"""


@pytest.fixture
def scene(tmp_path):
    """A scene with a ball in a lattice; the lattice's handle is active."""
    return opened(tmp_path)


def opened(folder, more=""):
    write_tri(folder / "ball.tri", *ball())
    scene = bpy.context.scene
    project.open_case(scene, NET.format(more=more), str(folder))
    view.sync(scene)
    activate(scene)
    return scene


def activate(scene):
    """Make the only handle the active object."""
    (handle,) = [one for one in scene.objects if one.moldline.role]
    bpy.context.view_layer.objects.active = handle
    return handle


def select(scene, chosen):
    """Select control points in edit mode, as a mouse does."""
    handle = activate(scene)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    for number in chosen:
        handle.data.vertices[number].select = True
    bpy.context.tool_settings.mesh_select_mode = (True, False, False)
    bpy.ops.object.mode_set(mode="EDIT")
    return handle


def tables(scene):
    return tomllib.loads(scene.moldline.text.as_string())


def shape(scene):
    """The shape at the values as they are."""
    return project.case(scene).points(project.values(scene))


def test_selected_control_points_move_together_along_an_axis(scene):
    select(scene, [9, 11])  # (1, 1, 1) and (1, 2, 1)
    assert bpy.ops.moldline.add_variable(name="bump", axis="z", lower=-0.5, upper=0.5) == {
        "FINISHED"
    }
    told = tables(scene)
    assert told["variable"]["bump"] == {
        "size": 1, "value": 0.0, "bounds": [-0.5, 0.5], "unit": "m"
    }  # fmt: skip
    assert told["stage"][0]["link"][-1] == {
        "variable": "bump", "link": "group", "axis": "z", "index": [[1, 1, 1], [1, 2, 1]]
    }  # fmt: skip
    assert "# A comment of a person." in scene.moldline.text.as_string()
    assert view.active_variable(scene) == "bump"
    rest = shape(scene)
    project.set_values(scene, {"bump": [0.25]})
    motion = shape(scene) - rest
    assert np.abs(motion[:, :2]).max() < 1e-12 and motion[:, 2].max() > 0.02


def test_one_number_each_belongs_to_one_side_where_the_other_is_its_mirror_image(scene):
    select(scene, [1, 3, 5])  # y = -1.2, 0, 1.2
    bpy.ops.moldline.add_variable(name="bump", axis="x", moves="EACH")
    told = tables(scene)
    assert told["variable"]["bump"]["size"] == 3
    assert told["stage"][0]["link"][-1]["index"] == [[0, 0, 1], [0, 1, 1], [0, 2, 1]]
    assert project.values(scene)["bump"].shape == (3,)

    select(scene, [1, 3, 5])
    bpy.ops.moldline.add_variable(name="span", axis="y", moves="EACH", mirrored="y")
    assert tables(scene)["stage"][0]["link"][-1] == {
        "variable": "span", "link": "each", "axis": "y", "index": [[0, 2, 1]], "mirrored": "y"
    }  # fmt: skip
    project.set_values(scene, {"span": [0.3]})
    points, rest = shape(scene), project.case(scene).points_at_rest
    assert np.isclose(points[:, 1].max() - rest[:, 1].max(), rest[:, 1].min() - points[:, 1].min())


@pytest.mark.slow
def test_the_normal_is_that_of_the_surface_next_to_them(scene):
    select(scene, [1, 3, 5, 7, 9, 11])  # all on top
    bpy.ops.moldline.add_variable(name="swell", axis="NORMAL")
    link = tables(scene)["stage"][0]["link"][-1]
    assert link["link"] == "groups" and len(link["index"]) == 1 and len(link["index"][0]) == 6
    np.testing.assert_allclose(link["direction"], [0, 0, 1], atol=0.05)
    select(scene, range(12))
    with pytest.raises(RuntimeError, match="cancel out"):
        bpy.ops.moldline.add_variable(name="swell_2", axis="NORMAL")


@pytest.mark.slow
def test_frozen_control_points_get_no_number(tmp_path):
    scene = opened(tmp_path, 'freeze = ["y-"]')
    select(scene, [0, 1, 4])
    bpy.ops.moldline.add_variable(name="bump", moves="EACH")
    assert tables(scene)["stage"][0]["link"][-1]["index"] == [[0, 2, 0]]
    bpy.ops.moldline.edit_variable(name="hump")
    told = tables(scene)["variable"]
    assert "bump" not in told and told["hump"]["unit"] == "m" and told["hump"]["bounds"] == [-1, 1]


def test_stations_of_a_lattice_have_a_number_each(scene):
    for kind, along, size in (("thickness", "y", 3), ("camber", "x", 2), ("radius", "x", 2)):
        activate(scene)
        bpy.ops.moldline.add_variable(by="STATIONS", kind=kind, along=along, axis="z")
        told = tables(scene)
        assert told["variable"][kind]["size"] == size
        assert told["stage"][0]["link"][-1]["link"] == kind
    assert np.abs(shape(scene) - project.case(scene).points_at_rest).max() < 1e-12


@pytest.mark.slow
def test_a_variable_that_is_there_may_move_more(scene):
    select(scene, [1, 5])
    with pytest.raises(RuntimeError, match="there is a variable 'lift' already"):
        bpy.ops.moldline.add_variable(name="lift", moves="EACH")
    bpy.ops.moldline.add_variable(name="lift", moves="EACH", join=True)
    told = tables(scene)
    assert len(edits.links_of(told, "lift")) == 2 and told["variable"]["lift"]["size"] == 2


def test_what_is_wrong_is_a_sentence_and_nothing_changes(scene):
    before = scene.moldline.text.as_string()
    select(scene, [0, 1])
    for given, sentence in (
        ({"name": "two words"}, "one word"),
        ({"name": "lift"}, "there is a variable 'lift' already"),
        ({"lower": 1.0, "upper": -1.0}, "below the upper one, got 1 and -1"),
        ({"by": "NAMED", "parameter": "sweep"}, "no parameter 'sweep' of a lattice"),
        ({"by": "STATIONS", "along": "z", "axis": "z"}, "cannot move along z too"),
        ({"by": "STATIONS", "axis": "NORMAL"}, "along x, y or z"),
        ({"mirrored": "y"}, "none of those selected is at y > 0"),
        ({"name": "lift", "join": True}, "'lift' has 2 numbers, what is chosen takes 1"),
    ):
        with pytest.raises(RuntimeError, match=sentence):
            bpy.ops.moldline.add_variable(**given)
    select(scene, [])
    with pytest.raises(RuntimeError, match="no control point is selected"):
        bpy.ops.moldline.add_variable()
    for operator, given, sentence in (
        (bpy.ops.moldline.edit_variable, {"name": "a b"}, "one word"),
        (bpy.ops.moldline.edit_variable, {"lower": 2.0, "upper": 1.0}, "got 2 and 1"),
        (bpy.ops.moldline.bound_variable, {"reach": 0.0}, "by more than 0"),
    ):
        with pytest.raises(RuntimeError, match=sentence):
            operator(**given)
    assert scene.moldline.text.as_string() == before


def test_without_a_handle_there_is_nothing_to_define():
    assert not bpy.ops.moldline.add_variable.poll()
    assert not bpy.ops.moldline.remove_variable.poll()


def test_a_variable_is_renamed_in_another_unit_with_its_links_and_the_shape_stays(scene):
    project.set_values(scene, {"lift": [0.25, -0.5]})
    before = shape(scene)
    bpy.ops.moldline.edit_variable(name="bend", lower=-200, upper=200, unit="cm", typical=5.0)
    told = tables(scene)
    assert told["variable"] == {
        "bend": {"size": 2, "bounds": [-200.0, 200.0], "unit": "cm", "typical": 5.0}
    }
    assert told["stage"][0]["link"][0]["variable"] == "bend"
    np.testing.assert_allclose(project.values(scene)["bend"], [25.0, -50.0])
    np.testing.assert_allclose(shape(scene), before, atol=1e-12)
    assert view.active_variable(scene) == "bend"


def test_bounds_are_set_around_the_values_and_values_go_back(scene):
    project.set_values(scene, {"lift": [0.25, -0.5]})
    bpy.ops.moldline.reset_values()
    assert project.values(scene)["lift"].tolist() == [0.0, 0.0]
    project.set_values(scene, {"lift": [0.25, -0.5]})
    bpy.ops.moldline.bound_variable(how="DISTANCE", reach=0.1)
    assert tables(scene)["variable"]["lift"]["bounds"] == [[0.15, 0.35], [-0.6, -0.4]]
    np.testing.assert_allclose(project.values(scene)["lift"], [0.25, -0.5])
    bpy.ops.moldline.bound_variable(how="FREE")
    assert "bounds" not in tables(scene)["variable"]["lift"]


def test_removing_takes_the_links_along(scene):
    bpy.ops.moldline.remove_variable()
    told = tables(scene)
    assert "lift" not in told.get("variable", {}) and not told["stage"][0].get("link")
    assert "lift" not in scene.moldline.surface
    assert view.active_variable(scene) == ""
    select(scene, [9])
    bpy.ops.moldline.add_variable(name="again")
    assert len(tables(scene)["stage"][0]["link"]) == 1


def test_lists_follow_the_text(scene):
    assert [row.name for row in scene.moldline_view.variables] == ["lift"]
    scene.moldline.text.from_string(scene.moldline.text.as_string().replace("lift", "bend"))
    assert view.is_stale(scene)
    view.sync(scene)
    assert view.active_variable(scene) == "bend"


def test_without_moldline_the_operator_says_so_and_nothing_changes(scene, preferences):
    before = scene.moldline.text.as_string()
    session.stop()
    preferences.python = "/nowhere/python"
    with pytest.raises(RuntimeError, match="/nowhere/python"):
        bpy.ops.moldline.remove_variable()
    assert scene.moldline.text.as_string() == before


def test_one_change_waits_for_the_other(scene, monkeypatch):
    before = scene.moldline.text.as_string()
    monkeypatch.setattr(amending, "_under_way", {scene.name})
    monkeypatch.setattr(session, "busy", lambda: "opening the case")
    assert bpy.ops.moldline.remove_variable() == {"CANCELLED"}
    assert scene.moldline.text.as_string() == before
