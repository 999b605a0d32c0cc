"""The shape follows what a hand moves and what values say, and comes back with undo."""

import os
import signal
import time
from pathlib import Path

import bmesh
import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import convert, following, handles, project, session
from bl_ext.user_default.moldline.client.client import Client
from conftest import CASE, ball, write_tri
from mathutils import Vector

LINK = '[[stage.link]]\nvariable = "lift"\nlink = "camber"\nalong = "x"\naxis = "z"\n'


def opened(path, text):
    """The scene with a case of that text, up to date."""
    found = bpy.context.scene
    project.open_case(found, text, str(path.parent), str(path))
    assert project.is_open(found), found.moldline.status
    following.settle()
    assert not following.is_busy(found), found.moldline.status
    return found


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """One folder for all tests here, so that moldline loads each text once."""
    found = tmp_path_factory.mktemp("following")
    write_tri(found / "ball.tri", *ball())
    return found / "case.toml"


@pytest.fixture
def scene(place):
    """A scene with the ball's case, its handle free to move along z by two numbers."""
    return opened(place, CASE)


@pytest.fixture
def free(place):
    """The same with a number for each control point along z and along x, without bounds."""
    text = CASE.replace("bounds = [-1.0, 1.0]\n", "").replace("size = 2", "size = 12")
    links = "".join(
        f'[[stage.link]]\nvariable = "{name}"\nlink = "each"\naxis = "{axis}"\n\n'
        for name, axis in (("lift", "z"), ("push", "x"))
    )
    push = '[variable.push]\nsize = 12\nunit = "m"\n\n[[stage]]'
    return opened(place, text.replace(LINK, links).replace("[[stage]]", push, 1))


def shape(scene):
    """Points of the surface in the scene."""
    return convert.points(project.surface(scene).data)


def wanted(scene):
    """Points for the scene's values."""
    return project.case(scene).points(project.values(scene))


def edit(obj, index, motion):
    """Move one vertex in edit mode, and leave it."""
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    own = bmesh.from_edit_mesh(obj.data)
    own.verts.ensure_lookup_table()
    own.verts[index].co += Vector(motion)
    bmesh.update_edit_mesh(obj.data)


def test_a_slider_moves_the_shape_in_double_precision(scene):
    surface = project.surface(scene)
    surface["lift"][1] = 0.25
    following.settle()
    np.testing.assert_array_equal(shape(scene), wanted(scene))
    assert np.ptp(shape(scene)[:, 2]) > 2.001
    net = handles.of_stage(scene, 0)
    np.testing.assert_array_equal(
        handles.read(net), project.case(scene).handles({"lift": [0, 0.25]})[0].moved
    )


def test_a_control_point_moved_in_edit_mode_moves_the_shape(free):
    net = handles.of_stage(free, 0)
    edit(net, 3, (0.0, 0.0, 0.5))
    following.settle()
    values = project.values(free)
    assert values["lift"][3] == pytest.approx(0.5, abs=1e-6)
    assert np.abs(np.delete(values["lift"], 3)).max() < 1e-9
    np.testing.assert_array_equal(shape(free), wanted(free))
    bpy.ops.object.mode_set(mode="OBJECT")
    following.settle()
    assert project.values(free)["lift"][3] == values["lift"][3]


def test_what_bounds_refuse_is_told_and_the_handle_goes_back(scene):
    net = handles.of_stage(scene, 0)
    before = handles.read(net)
    edit(net, 0, (0.0, 0.0, 50.0))
    following.settle()
    assert "at its bounds: lift" in scene.moldline.status
    assert project.values(scene)["lift"].max() == 1.0
    now = handles.read(net)
    np.testing.assert_allclose((now - before)[:6, 2], 1.0, atol=1e-12)


def test_a_value_beyond_its_bounds_is_told_and_the_shape_stays(scene):
    before = shape(scene)
    project.surface(scene)["lift"][0] = 7.0
    following.settle()
    assert "lift[0] = 7" in scene.moldline.status and scene.moldline.is_alert
    np.testing.assert_array_equal(shape(scene), before)
    project.set_values(scene, {"lift": [0.5, 0.0]})
    following.settle()
    assert scene.moldline.status == "" and not scene.moldline.is_alert
    np.testing.assert_array_equal(shape(scene), wanted(scene))


def test_a_handle_moved_as_an_object_counts(free):
    net = handles.of_stage(free, 0)
    net.location.z = 0.25
    following.settle()
    np.testing.assert_allclose(project.values(free)["lift"], 0.25, atol=1e-7)
    net.location.z = 0.0
    following.settle()
    np.testing.assert_allclose(project.values(free)["lift"], 0.0, atol=1e-7)


def test_a_surface_that_is_moved_takes_its_handles_along(free):
    project.surface(free).location.x = 5.0
    following.settle()
    assert not any(np.any(v) for v in project.values(free).values())


def test_undo_and_redo_bring_shape_values_and_handle_back(free):
    bpy.ops.ed.undo_push(message="begin")
    before = shape(free)
    edit(handles.of_stage(free, 0), 3, (0.0, 0.0, 0.5))
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.ed.undo_push(message="moved")  # before the shape has followed
    following.settle()
    after, values = shape(free), project.values(free)
    bpy.ops.ed.undo_push(message="later")
    bpy.ops.ed.undo()
    following.settle()
    np.testing.assert_array_equal(shape(bpy.context.scene), after)
    bpy.ops.ed.undo()
    following.settle()
    found = bpy.context.scene
    np.testing.assert_array_equal(shape(found), before)
    assert not any(np.any(v) for v in project.values(found).values())
    bpy.ops.ed.redo()
    following.settle()
    np.testing.assert_allclose(shape(bpy.context.scene), after, atol=1e-7)
    np.testing.assert_allclose(project.values(bpy.context.scene)["lift"], values["lift"], atol=1e-7)


def test_moving_back_gives_the_same_numbers_to_the_bit(free):
    project.set_values(free, {"lift": np.linspace(0.0, 0.1, 12)})
    following.settle()
    net, before = handles.of_stage(free, 0), shape(free)
    kept = net.data.vertices[3].co.copy()
    for _ in range(2):
        net.data.vertices[3].co.z += 0.5
        following.settle()
        net.data.vertices[3].co = kept
        following.settle()
        np.testing.assert_array_equal(project.values(free)["lift"], np.linspace(0.0, 0.1, 12))
        np.testing.assert_array_equal(shape(free), before)


def test_key_frames_and_drivers_move_the_shape(scene):
    surface = project.surface(scene)
    for frame, height in ((1, 0.0), (11, 0.5)):
        surface["lift"][0] = height
        surface.keyframe_insert('["lift"]', index=0, frame=frame)
    driver = surface.driver_add('["lift"]', 1).driver
    driver.expression = "frame / 100"
    scene.frame_set(6)
    np.testing.assert_allclose(project.values(scene)["lift"], [0.25, 0.06], atol=1e-6)
    np.testing.assert_array_equal(shape(scene), wanted(scene))


def test_two_handles_at_once_are_both_followed(scene):
    text = project.text(scene) + (
        '\n[variable.bow]\nsize = 12\nunit = "m"\n\n[[stage]]\nname = "outer"\n'
        'deformer = "lattice"\nshape = [2, 3, 2]\nmargin = [0.2, 0.2, 0.2]\n\n'
        '[[stage.link]]\nvariable = "bow"\nlink = "each"\naxis = "z"\n'
    )
    project.update_text(scene, text)
    assert len(handles.all_of(scene)) == 2, scene.moldline.status
    following.settle()
    first, second = handles.all_of(scene)
    for obj in (first, second):
        for vertex in obj.data.vertices:
            vertex.co.z += 0.25
    following.settle()
    np.testing.assert_allclose(project.values(scene)["lift"], 0.25, atol=1e-6)
    np.testing.assert_allclose(project.values(scene)["bow"], 0.25, atol=1e-6)
    np.testing.assert_array_equal(shape(scene), wanted(scene))


def test_a_server_that_dies_in_a_drag_loses_nothing(free):
    surface = project.surface(free)
    project.set_values(free, {"lift": [0.1] * 12})
    following.step(free)
    for case in session.client().cases():
        if case["pid"]:
            os.kill(case["pid"], signal.SIGKILL)
    project.set_values(free, {"lift": [0.2] * 12})
    following.settle()
    np.testing.assert_array_equal(shape(free), wanted(free))
    assert list(surface["lift"]) == [0.2] * 12


def test_moldline_that_was_stopped_is_started_again(free):
    address = session.client().address
    Client(address, shared=False).shutdown()
    while Path(address.socket).exists():
        time.sleep(0.05)
    handles.of_stage(free, 0).data.vertices[3].co.z += 0.5
    following.settle()
    assert project.values(free)["lift"][3] == pytest.approx(0.5, abs=1e-6)
    np.testing.assert_array_equal(shape(free), wanted(free))


def test_a_surface_that_is_edited_is_not_overwritten(scene):
    surface = project.surface(scene)
    project.set_values(scene, {"lift": [0.1, 0.1]})
    edit(surface, 0, (0.0, 0.0, 3.0))
    following.settle()
    bpy.ops.object.mode_set(mode="OBJECT")
    following.settle()
    assert surface.data.vertices[0].co.z > 2.0
    assert "edited by hand" in scene.moldline.status


def test_a_surface_that_was_deleted_is_no_trouble(scene):
    surface = project.surface(scene)
    scene.collection.objects.unlink(surface)
    project.set_values(scene, {"lift": [0.1, 0.1]})
    following.settle()
    assert project.surface(scene) is None
    scene.collection.objects.link(surface)
    following.settle()
    np.testing.assert_array_equal(shape(scene), wanted(scene))


def test_a_file_that_is_opened_again_goes_on(free, tmp_path):
    project.set_values(free, {"lift": [0.1] * 12})
    following.settle()
    before = shape(free)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    found = bpy.context.scene
    assert not project.is_open(found) and project.variables(found)
    np.testing.assert_array_equal(shape(found), before)
    handles.of_stage(found, 0).data.vertices[3].co.z += 0.5
    following.settle()
    assert project.values(found)["lift"][3] == pytest.approx(0.6, abs=1e-6)
    assert len(handles.all_of(found)) == 1
    np.testing.assert_array_equal(shape(found), wanted(found))


def wait(scene, seconds=20.0):
    """What Blender's timer does, until all rests."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        pause = following._tick()
        if not following.is_busy(scene):
            return
        time.sleep(pause)
    raise AssertionError(f"not at rest after {seconds} s: {scene.moldline.status}")


def test_the_timer_follows_a_drag_and_brings_it_to_rest(free):
    shown = []
    following.on_shape(lambda scene, shape: shown.append(shape.points.dtype.str))
    net = handles.of_stage(free, 0)
    edit(net, 3, (0.0, 0.0, 0.1))
    for _ in range(20):
        edit_more(net, 3, (0.0, 0.0, 0.02))
        bpy.context.view_layer.update()
        following._tick()
        time.sleep(0.01)
    assert "<f4" in shown
    wait(free)
    assert shown[-1] == "<f8"
    assert project.values(free)["lift"][3] == pytest.approx(0.5, abs=1e-6)
    np.testing.assert_array_equal(shape(free), wanted(free))


def edit_more(obj, index, motion):
    """Move one vertex of a handle that is in edit mode."""
    own = bmesh.from_edit_mesh(obj.data)
    own.verts.ensure_lookup_table()
    own.verts[index].co += Vector(motion)
    bmesh.update_edit_mesh(obj.data)


def test_undo_within_edit_mode_takes_the_shape_back_to_the_bit(free):
    project.set_values(free, {"lift": np.linspace(0.0, 0.1, 12)})
    following.settle()
    before = shape(free)
    edit(handles.of_stage(free, 0), 3, (0.0, 0.0, 0.0))
    bpy.ops.ed.undo_push(message="in edit mode")
    edit_more(handles.of_stage(free, 0), 3, (0.0, 0.0, 0.5))
    bpy.ops.ed.undo_push(message="moved")
    for rests in (False, True):
        following.settle() if rests else following.step(free)
        time.sleep(0.2)
        following.step(free)
        bpy.ops.ed.undo()
        assert bpy.context.mode == "EDIT_MESH"
        following.settle()
        scene = bpy.context.scene
        np.testing.assert_array_equal(project.values(scene)["lift"], np.linspace(0.0, 0.1, 12))
        np.testing.assert_array_equal(shape(scene), before)
        bpy.ops.ed.redo()
    following.settle()
    assert project.values(bpy.context.scene)["lift"][3] == pytest.approx(0.5 + 0.3 / 11, abs=1e-6)


def test_a_text_that_is_edited_by_hand_is_opened_when_it_is_written(scene, monkeypatch):
    monkeypatch.setattr(following, "WRITTEN", 0.0)
    text = project.text(scene).replace("bounds = [-1.0, 1.0]", "bounds = [-3.0, 3.0]")
    scene.moldline.text.clear()
    scene.moldline.text.write(text)
    wait(scene)
    assert project.is_open(scene) and project.variables(scene)["lift"]["upper"] == [3.0, 3.0]


def test_a_handle_that_has_lost_a_point_says_that_it_moves_nothing(free):
    net = handles.of_stage(free, 0)
    bpy.context.view_layer.objects.active = net
    bpy.ops.object.mode_set(mode="EDIT")
    own = bmesh.from_edit_mesh(net.data)
    own.verts.ensure_lookup_table()
    own.verts.remove(own.verts[0])
    bmesh.update_edit_mesh(net.data)
    bpy.ops.object.mode_set(mode="OBJECT")
    following.settle()
    assert "other points than its stage" in free.moldline.status
    assert bpy.ops.moldline.show_handles() == {"FINISHED"}
    handles.of_stage(free, 0).data.vertices[3].co.z += 0.5
    following.settle()
    assert project.values(free)["lift"][3] == pytest.approx(0.5) and free.moldline.status == ""


@pytest.mark.parametrize("tool", ["modifier", "join"])
def test_a_surface_that_a_tool_has_changed_counts_as_edited(free, tool):
    surface = project.surface(free)
    bpy.ops.mesh.primitive_cube_add()
    surface.select_set(True)
    bpy.context.view_layer.objects.active = surface
    if tool == "join":
        bpy.ops.object.join()
    else:
        surface.modifiers.new("displace", "DISPLACE").strength = 0.2
        bpy.ops.object.modifier_apply(modifier="displace")
    bpy.context.view_layer.update()
    before = shape(free)
    project.set_values(free, {"lift": [0.25] * 12})
    following.settle()
    np.testing.assert_array_equal(shape(free), before)
    assert "edited by hand" in free.moldline.status
    assert bpy.ops.moldline.restore_surface() == {"FINISHED"}
    following.settle()
    np.testing.assert_array_equal(shape(free), wanted(free))


def test_what_a_place_meant_in_one_case_means_nothing_in_another(place):
    turned = CASE.replace("bounds = [-1.0, 1.0]\n", "").replace('"z"\n', '"z"\nscale = -1.0\n')
    for text, sign in ((CASE, 1.0), (turned, -1.0)):
        scene = opened(place, text)
        net = handles.of_stage(scene, 0)
        for height in (0.5, 0.0, 0.5):
            project.set_values(scene, {"lift": 0.0})
            following.settle()
            for vertex in net.data.vertices:
                vertex.co.z += height
            following.settle()
        np.testing.assert_allclose(project.values(scene)["lift"], 0.5 * sign, atol=1e-7)
        np.testing.assert_array_equal(shape(scene), wanted(scene))
