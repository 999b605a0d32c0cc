"""A scene holds its case: text, surface, values; and what shows it is made to fit."""

import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import convert, following, handles, project, results, session
from conftest import CASE, ball, write_tri


def opened(path, text=None):
    """The scene with a case."""
    scene = bpy.context.scene
    project.open_case(scene, text or path.read_text(), str(path.parent), str(path))
    assert project.is_open(scene), scene.moldline.status
    following.settle()
    return scene


def test_values_are_properties_with_bounds_and_a_unit(ball_case):
    scene = opened(ball_case)
    surface = project.surface(scene)
    assert list(project.values(scene)) == ["lift"]
    assert surface["lift"].typecode == "d" and len(surface["lift"]) == 2
    told = surface.id_properties_ui("lift").as_dict()
    assert (told["min"], told["max"]) == (-1.0, 1.0) and "[m]" in told["description"]
    project.set_values(scene, {"lift": 0.1})
    np.testing.assert_array_equal(project.values(scene)["lift"], [0.1, 0.1])
    assert surface.id_properties_ui("lift").as_dict()["max"] == 1.0


def test_a_scene_without_a_case_says_so():
    scene = bpy.context.scene
    assert not project.has_case(scene) and project.opened(scene) is None
    assert project.values(scene) == {} and project.surface(scene) is None
    with pytest.raises(session.Problem, match="has no case"):
        project.case(scene)
    following.settle()


def test_another_text_keeps_values_of_variables_that_stay(ball_case):
    scene = opened(ball_case)
    project.set_values(scene, {"lift": [0.5, 0.25]})
    text = ball_case.read_text().replace(
        "[measure",
        '[[stage.link]]\nvariable = "bulge"\nlink = "thickness"\nalong = "y"\naxis = "z"\n\n'
        '[variable.bulge]\nsize = 3\nunit = "m"\n\n[measure',
    )
    project.update_text(scene, text)
    assert project.text(scene) == text, scene.moldline.status
    np.testing.assert_array_equal(project.values(scene)["lift"], [0.5, 0.25])
    np.testing.assert_array_equal(project.values(scene)["bulge"], [0.0, 0.0, 0.0])
    project.update_text(scene, ball_case.read_text())
    assert "bulge" not in project.surface(scene)
    np.testing.assert_array_equal(project.values(scene)["lift"], [0.5, 0.25])


def test_a_text_that_is_wrong_leaves_all_as_it_was(ball_case):
    scene = opened(ball_case)
    told = []
    project.update_text(scene, "moldline = 7\n", failed=told.append)
    assert told and scene.moldline.is_alert and scene.moldline.status == told[0]
    assert project.text(scene) == ball_case.read_text() and project.is_open(scene)


def test_a_case_of_a_modeler_has_sliders_and_a_shape_but_no_handles(tmp_path):
    text = (
        "moldline = 1\n\n[variable.camber]\nvalue = 0.02\nbounds = [0.0, 0.06]\n\n[[stage]]\n"
        'modeler = "naca4"\nto = "section"\ndesignation = "2412"\n\n[[stage.link]]\n'
        'variable = "camber"\nlink = "named"\nparameter = "camber"\nabsolute = true\n'
    )
    scene = opened(tmp_path / "case.toml", text)
    mesh = project.surface(scene).data
    assert not handles.all_of(scene) and len(mesh.edges) == len(mesh.vertices) - 1
    before = convert.points(mesh)
    project.set_values(scene, {"camber": 0.05})
    following.settle()
    assert np.abs(convert.points(mesh) - before).max() > 0.02
    assert scene.moldline.status == ""


def test_a_union_that_is_made_anew_gives_the_surface_other_triangles(tmp_path):
    points, faces = ball()
    write_tri(tmp_path / "one.tri", points, faces)
    write_tri(tmp_path / "other.tri", 0.5 * points + [1.0, 0.03, 0.02], faces)
    text = """\
moldline = 1

[geometry.one]
file = "one.tri"

[geometry.other]
file = "other.tri"

[variable.shift]
bounds = [-0.6, 0.6]

[[stage]]
deformer = "lattice"
on = "other"
shape = [2, 2, 2]

[[stage.link]]
variable = "shift"
link = "group"
axis = "x"
inside = [[-9.0, -9.0, -9.0], [9.0, 9.0, 9.0]]

[[stage]]
modeler = "union"
of = ["one", "other"]
to = "both"
"""
    scene = opened(tmp_path / "case.toml", text)
    surface = project.surface(scene)
    assert len(handles.all_of(scene)) == 1 and convert.components(surface)
    counts = set()
    for shift in (0.0, -0.3, 0.3, 0.0):
        project.set_values(scene, {"shift": shift})
        following.settle()
        assert not following.is_busy(scene) and scene.moldline.status == ""
        counts.add(len(surface.data.vertices))
        found = project.case(scene).shape({"shift": [shift]})
        np.testing.assert_array_equal(convert.points(surface.data), found.points)
    assert len(counts) > 1


def test_a_scene_that_was_copied_has_a_case_of_its_own(ball_case):
    first = opened(ball_case)
    bpy.ops.scene.new(type="FULL_COPY")
    second = bpy.context.scene
    assert second != first and project.surface(second) != project.surface(first)
    project.set_values(second, {"lift": [0.5, 0.5]})
    following.settle(second)
    assert not project.values(first)["lift"].any()
    text = project.text(second).replace("bounds = [-1.0, 1.0]", "bounds = [-2.0, 2.0]")
    project.update_text(second, text)
    assert project.text(first) == ball_case.read_text() and project.text(second) == text
    assert len(handles.all_of(first)) == len(handles.all_of(second)) == 1


def test_undo_of_an_amendment_brings_the_old_case_back(ball_case):
    scene = opened(ball_case)
    bpy.ops.ed.undo_push(message="begin")
    old = project.text(scene)
    project.update_text(scene, old.replace("bounds = [-1.0, 1.0]", "bounds = [-2.0, 2.0]"))
    bpy.ops.ed.undo_push(message="amended")
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert project.text(scene) == old
    following.settle()
    assert project.is_open(scene) and project.variables(scene)["lift"]["upper"] == [1.0, 1.0]


def test_a_case_whose_files_are_gone_is_shown_and_told(tmp_path):
    write_tri(tmp_path / "ball.tri", *ball())
    opened(tmp_path / "case.toml", CASE)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    session.stop()
    (tmp_path / "ball.tri").unlink()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    scene = bpy.context.scene
    following.settle()
    assert not project.is_open(scene) and "ball.tri" in scene.moldline.status
    assert len(project.surface(scene).data.vertices) == 258 and project.variables(scene)


def test_a_value_that_is_written_into_the_text_by_hand_counts(ball_case):
    scene = opened(ball_case)
    project.set_values(scene, {"lift": [0.5, 0.25]})
    following.settle()
    text = ball_case.read_text()
    for line, wanted in (("", [0.5, 0.25]), ("value = [0.125, 0.0]\n", [0.125, 0.0])):
        scene.moldline.text.clear()
        scene.moldline.text.write("# by hand\n" + text.replace("bounds", f"{line}bounds", 1))
        following.settle()
        np.testing.assert_array_equal(project.values(scene)["lift"], wanted)
    np.testing.assert_array_equal(
        convert.points(project.surface(scene).data),
        project.case(scene).points({"lift": [0.125, 0.0]}),
    )


def test_a_property_of_another_type_is_as_good_as_none(ball_case):
    scene = opened(ball_case)
    for given in ("text", {"a": 1.0}, [1.0, 2.0, 3.0]):
        project.surface(scene)["lift"] = given
        np.testing.assert_array_equal(project.values(scene)["lift"], [0.0, 0.0])


def test_a_surface_edited_by_hand_outlives_the_opening_of_its_file(ball_case, tmp_path):
    scene = opened(ball_case)
    surface = project.surface(scene)
    surface.data.vertices[0].co.z += 3.0
    surface[results.EDITED] = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edited.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "edited.blend"))
    scene = bpy.context.scene
    following.settle()
    assert project.surface(scene).data.vertices[0].co.z > 2.0
    assert project.is_open(scene) and scene.moldline.status == results.BY_HAND
    assert bpy.ops.moldline.restore_surface() == {"FINISHED"}
    following.settle()
    assert project.surface(scene).data.vertices[0].co.z < 2.0 and not scene.moldline.is_alert


@pytest.mark.parametrize("name", ["v" * 64, "moldline_edited"])
def test_a_name_that_blender_cannot_hold_is_refused(ball_case, name):
    scene = bpy.context.scene
    text = ball_case.read_text().replace("variable.lift", f"variable.{name}")
    text = text.replace('"lift"', f'"{name}"')
    project.open_case(scene, text, str(ball_case.parent))
    assert not project.has_case(scene) and "choose another name" in scene.moldline.status


def test_a_place_that_was_applied_changes_no_values(ball_case):
    scene = opened(ball_case)
    surface = project.surface(scene)
    surface.location.z, surface.scale.x = 0.5, 2.0
    surface.select_set(True)
    bpy.context.view_layer.objects.active = surface
    bpy.ops.object.transform_apply()
    following.settle()
    assert bpy.ops.moldline.restore_surface() == {"FINISHED"}
    following.settle()
    assert not project.values(scene)["lift"].any()
    np.testing.assert_array_equal(convert.points(surface.data), project.case(scene).points())
    np.testing.assert_array_equal(
        handles.read(handles.of_stage(scene, 0)), project.case(scene).handles()[0].moved
    )
