"""Handles are read back to the bit where nobody moved them, whatever happens to the rest."""

import sys

import bmesh
import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import handles
from bl_ext.user_default.moldline.client.remote import Handle
from mathutils import Matrix, Quaternion

REST = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) / 3.0
LINES = np.array([[0, 1], [2, 3], [4, 5], [6, 7]])


@pytest.fixture
def scene():
    """The scene."""
    return bpy.context.scene


def net(scene, frozen=()):
    """A net of eight points, thirds that no float holds."""
    mask = np.isin(np.arange(8), frozen)
    names = [str(i) for i in range(8)]
    told = Handle(0, "box", "lattice", "ball", "net", LINES, REST, REST.copy(), mask, names)
    return handles.create(scene, surface(scene), told)


def surface(scene):
    """Some object that stands for the surface."""
    found = bpy.data.objects.new("surface", bpy.data.meshes.new("surface"))
    scene.collection.objects.link(found)
    return found


def marks():
    """Marks of three bones in any position."""
    rng = np.random.default_rng(1)
    head, along, aside = rng.normal(size=(3, 3, 3))
    return np.stack([head, head + along, head + aside], axis=1)


def skeleton(scene, frozen=(False, False, False)):
    """An armature of three bones."""
    names = ["root", "mid", "tip"]
    told = Handle(
        1, "", "skeleton", "ball", "bones", np.zeros((0, 2), int), marks(), marks(),
        np.array(frozen), names,
    )  # fmt: skip
    return handles.create(scene, surface(scene), told)


def test_a_net_is_read_back_to_the_bit(scene):
    obj = net(scene)
    moved, touched = handles.state(obj)
    np.testing.assert_array_equal(moved, REST)
    assert not touched.any() and handles.all_of(scene) == [obj]
    assert obj.users_collection[0].name == "Moldline"


def test_a_vertex_that_is_moved_leaves_the_others_their_doubles(scene):
    obj = net(scene)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    own = bmesh.from_edit_mesh(obj.data)
    own.verts.ensure_lookup_table()
    own.verts[5].co.z += 1.0
    bmesh.update_edit_mesh(obj.data)
    for mode in ("EDIT", "OBJECT"):
        bpy.ops.object.mode_set(mode=mode)
        moved, touched = handles.state(obj)
        assert list(np.flatnonzero(touched)) == [5]
        np.testing.assert_array_equal(np.delete(moved, 5, 0), np.delete(REST, 5, 0))
        np.testing.assert_allclose(moved[5], REST[5] + [0, 0, 1], atol=1e-7)
        np.testing.assert_array_equal(moved[5][:2], REST[5][:2])


def test_writing_in_edit_mode_moves_the_vertices(scene):
    obj = net(scene)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    handles.write(obj, REST * 2)
    moved, touched = handles.state(obj)
    np.testing.assert_array_equal(moved, REST * 2)
    assert not touched.any()
    bpy.ops.object.mode_set(mode="OBJECT")
    np.testing.assert_allclose([v.co for v in obj.data.vertices], REST * 2, atol=1e-6)
    assert not handles.state(obj)[1].any()


def test_an_object_that_is_moved_turned_or_scaled_takes_its_points_along(scene):
    obj = net(scene)
    motion = Matrix.Translation((1.0, 2.0, 3.0)) @ Matrix.Rotation(0.5, 4, "X")
    obj.matrix_basis = motion @ Matrix.Diagonal((2.0, 1.0, 1.0, 1.0))
    moved, touched = handles.state(obj)
    assert touched.all()
    np.testing.assert_allclose(
        moved, [(obj.matrix_basis @ v.co)[:] for v in obj.data.vertices], atol=1e-6
    )
    handles.write(obj, moved)
    again, touched = handles.state(obj)
    np.testing.assert_array_equal(again, moved)
    assert not touched.any()
    handles.restore(obj)
    np.testing.assert_array_equal(handles.read(obj), moved)
    assert obj.matrix_basis == Matrix.Identity(4)


def test_moving_the_surface_moves_no_handle(scene):
    obj = net(scene)
    obj.parent.location = (5.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    assert not handles.state(obj)[1].any()


def test_frozen_points_are_hidden_and_never_count(scene):
    obj = net(scene, frozen=(0, 1))
    assert [v.hide for v in obj.data.vertices] == [True, True] + [False] * 6
    obj.location.x = 1.0
    assert list(handles.state(obj)[1]) == [False, False] + [True] * 6
    bones = skeleton(scene, (True, False, False))
    assert all(bones.pose.bones["root"].lock_location)


def test_a_net_that_lost_points_is_no_handle_until_it_is_made_again(scene):
    obj = net(scene)
    told = Handle(
        0, "box", "lattice", "ball", "net", LINES, REST, REST, np.zeros(8, bool),
        [str(i) for i in range(8)],
    )  # fmt: skip
    obj.data.clear_geometry()
    assert handles.read(obj) is None and handles.all_of(scene) == []
    handles.rebuild(scene, obj.parent, [told])
    np.testing.assert_array_equal(handles.read(handles.all_of(scene)[0]), REST)


def test_bones_lie_between_head_and_tail_and_roll_to_their_side(scene):
    obj = skeleton(scene)
    np.testing.assert_array_equal(handles.read(obj), marks())
    for bone, (head, tail, side) in zip(obj.data.bones, marks(), strict=True):
        np.testing.assert_allclose(bone.head_local, head, atol=1e-6)
        np.testing.assert_allclose(bone.tail_local, tail, atol=1e-6)
        z = np.array(bone.matrix_local.to_3x3()) @ [0, 0, 1]
        y = (tail - head) / np.linalg.norm(tail - head)
        lever = (side - head) - (side - head) @ y * y
        np.testing.assert_allclose(z, lever / np.linalg.norm(lever), atol=1e-6)


def test_a_posed_bone_moves_its_marks_and_no_others(scene):
    obj = skeleton(scene)
    pose = obj.pose.bones["mid"]
    pose.location = (0.1, 0.2, 0.3)
    pose.rotation_quaternion = Quaternion((1.0, 2.0, 3.0), 0.4)
    pose.scale = (1.1, 1.2, 1.3)
    bpy.context.view_layer.update()
    moved, touched = handles.state(obj)
    assert list(touched) == [False, True, False]
    np.testing.assert_array_equal(moved[[0, 2]], marks()[[0, 2]])
    np.testing.assert_allclose(moved[1, 0], pose.head, atol=1e-5)
    np.testing.assert_allclose(moved[1, 1], pose.tail, atol=1e-5)


def test_poses_are_written_from_marks(scene):
    obj = skeleton(scene)
    turn = np.array(Quaternion((0.3, 1.0, 0.2), 0.7).to_matrix())
    wanted = marks()
    wanted[1] = wanted[1] @ turn.T * 1.5 + [1.0, 2.0, 3.0]
    handles.write(obj, wanted)
    bpy.context.view_layer.update()
    moved, touched = handles.state(obj)
    np.testing.assert_array_equal(moved, wanted)
    assert not touched.any()
    pose = obj.pose.bones["mid"]
    np.testing.assert_allclose(pose.head, wanted[1, 0], atol=1e-5)
    np.testing.assert_allclose(pose.tail, wanted[1, 1], atol=1e-5)
    np.testing.assert_allclose(pose.scale, 1.5, atol=1e-5)
    np.testing.assert_allclose(np.array(obj.pose.bones["tip"].matrix_basis), np.eye(4), atol=1e-6)


def test_handles_that_fit_are_kept_when_the_case_changes(scene):
    obj, names = net(scene), [str(i) for i in range(8)]
    told = Handle(0, "b", "lattice", "", "net", LINES, REST, REST * 2, np.zeros(8, bool), names)
    handles.rebuild(scene, obj.parent, [told, told._replace(stage=3)])
    assert handles.of_stage(scene, 0) == obj and len(handles.all_of(scene)) == 2
    np.testing.assert_array_equal(handles.read(obj), REST * 2)
    handles.rebuild(scene, obj.parent, [])
    assert not handles.all_of(scene) and "box" not in bpy.data.meshes


def test_only_blender_holds_blenders_objects():
    held = [one for one in vars(sys.modules[handles.__name__]).values() if hasattr(one, "id_data")]
    assert not [one for one in held if isinstance(one, bpy.types.ID)]
