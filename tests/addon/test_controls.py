"""Lattices, cages, skeletons and pilots are added around what is selected, and move it."""

import bmesh
import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import (
    convert,
    edits,
    files,
    following,
    handles,
    project,
    results,
    stages,
)
from conftest import ball, write_tri
from mathutils import Quaternion


@pytest.fixture
def thing(tmp_path):
    """An imported ball, selected and active."""
    write_tri(tmp_path / "ball.tri", *ball())
    files.import_file(tmp_path / "ball.tri", "m")
    return bpy.context.object


@pytest.fixture
def wing(tmp_path):
    """An imported half wing: 0 to 4 m of span, straight, 1 m of chord, closed."""
    x = 0.5 * (1 - np.cos(np.linspace(0, 2 * np.pi, 40, endpoint=False)))
    z = 0.1 * np.sin(np.linspace(0, 2 * np.pi, 40, endpoint=False))
    rings = [np.stack([x, np.full(40, y), z], axis=1) for y in np.linspace(0.0, 4.0, 17)]
    points = np.concatenate([*rings, [[0.5, 0.0, 0.0], [0.5, 4.0, 0.0]]])
    a = np.arange(40)
    b = (a + 1) % 40
    sides = [
        face
        for i in range(16)
        for face in (
            np.stack([a + 40 * i, b + 40 * i, a + 40 * i + 40], axis=1),
            np.stack([b + 40 * i, b + 40 * i + 40, a + 40 * i + 40], axis=1),
        )
    ]
    caps = [np.stack([b, a, np.full(40, 680)], axis=1)]
    caps += [np.stack([a + 640, b + 640, np.full(40, 681)], axis=1)]
    write_tri(tmp_path / "wing.tri", points, np.concatenate([*sides, *caps]))
    files.import_file(tmp_path / "wing.tri", "m")
    return bpy.context.object


def shape():
    """Points of the case's surface, which are those of its values."""
    scene = bpy.context.scene
    following.settle()
    found = convert.points(project.surface(scene).data)
    np.testing.assert_array_equal(found, project.case(scene).points(project.values(scene)))
    return found


def case():
    """Tables of the scene's case."""
    return edits.tables(project.text(bpy.context.scene))


def test_a_lattice_around_an_imported_object_is_a_case_that_a_hand_moves(thing):
    assert bpy.ops.moldline.add_lattice(shape=(3, 3, 3)) == {"FINISHED"}
    scene, obj = bpy.context.scene, bpy.context.object
    assert project.surface(scene) == thing
    assert obj.moldline.role == "net" and len(obj.data.vertices) == 27
    assert case()["geometry"]["ball"]["units"] == "m"
    assert list(case()["variable"]) == ["move_x", "move_y", "move_z"]
    assert "27 control points" in scene.moldline.status or "3 x 3 x 3" in scene.moldline.status
    before = shape()
    obj.data.vertices[13].co.z += 2.0
    moved = shape() - before
    assert moved[:, 2].max() > 0.05 and np.abs(moved[:, :2]).max() < 1e-5


def test_of_a_lattice_one_count_may_be_given_alone(thing):
    bpy.ops.moldline.add_lattice(shape=(5, 0, 0))
    counts = case()["stage"][0]["shape"]
    assert counts[0] == 5 and min(counts) > 1 and len(bpy.context.object.data.vertices) > 20


def test_a_second_lattice_around_selected_points_is_another_stage_of_the_case(thing):
    bpy.ops.moldline.add_lattice(shape=(3, 3, 3))
    first = bpy.context.object
    bpy.context.view_layer.objects.active = thing
    thing.data.vertices.foreach_set("select", convert.points(thing.data)[:, 2] > 0.3)
    assert bpy.ops.moldline.add_lattice(shape=(4, 4, 4), around="REGION") == {"FINISHED"}
    scene = bpy.context.scene
    assert len(case()["stage"]) == 2 and len(handles.all_of(scene)) == 2
    assert bpy.context.object.moldline.stage == 1 and first.moldline.stage == 0
    assert "move_z_2" in case()["variable"]
    before = shape()
    obj = handles.of_stage(scene, 1)
    inner = [i for i, x in enumerate(obj[handles.FROZEN]) if not x]
    for i in inner:
        obj.data.vertices[i].co.z += 0.2
    moved = shape() - before
    assert np.abs(moved[before[:, 2] < 0.2]).max() == 0.0 and moved[:, 2].max() > 0.05


def test_a_stage_that_is_removed_takes_its_variables_and_its_handle_along(thing):
    bpy.ops.moldline.add_lattice(shape=(3, 3, 3))
    bpy.ops.moldline.add_lattice(shape=(2, 2, 2))
    scene = bpy.context.scene
    kept = handles.of_stage(scene, 1).name
    assert bpy.ops.moldline.remove_stage(stage=0) == {"FINISHED"}
    assert [obj.name for obj in handles.all_of(scene)] == [kept]
    assert handles.all_of(scene)[0].moldline.stage == 0
    assert list(case()["variable"]) == ["move_x_2", "move_y_2", "move_z_2"]
    shape()


@pytest.mark.parametrize("name", ["add_cage", "add_body_cage"])
def test_cages_move_what_they_enclose(thing, name):
    options = {"faces": 80} if name == "add_cage" else {"stations": 4, "points": 6}
    assert getattr(bpy.ops.moldline, name)(**options) == {"FINISHED"}
    before = shape()
    for vertex in bpy.context.object.data.vertices:
        vertex.co.x += 0.1
    np.testing.assert_allclose(shape() - before, [[0.1, 0.0, 0.0]] * 258, atol=1e-6)


def test_a_wing_skeleton_is_posed_by_its_bones(wing):
    assert bpy.ops.moldline.add_wing_skeleton(stations=3) == {"FINISHED"}
    obj = bpy.context.object
    assert obj.type == "ARMATURE" and len(obj.pose.bones) == 3
    before = shape()
    tip = obj.pose.bones[2]
    np.testing.assert_allclose(tip.bone.head_local, [0.0, 4.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(tip.bone.tail_local, [1.0, 4.0, 0.0], atol=1e-6)
    bpy.ops.object.mode_set(mode="POSE")
    tip.location = tip.bone.matrix_local.to_3x3().inverted() @ type(tip.location)((0.5, 0.0, 0.0))
    after = shape()
    values = project.values(bpy.context.scene)
    assert values["sweep"][1] == pytest.approx(np.degrees(np.arctan(0.25)), abs=1e-3)
    assert values["sweep"][0] == pytest.approx(0.0, abs=1e-3)
    is_tip = before[:, 1] == 4.0
    np.testing.assert_allclose((after - before)[is_tip], [[0.5, 0.0, 0.0]] * 41, atol=1e-5)
    tip.scale = (0.5, 0.5, 0.5)
    shape()
    assert project.values(bpy.context.scene)["chord"][2] == pytest.approx(0.5, abs=1e-4)
    tip.rotation_quaternion @= Quaternion((1.0, 0.0, 0.0), np.radians(-3.0))
    shape()
    assert abs(project.values(bpy.context.scene)["twist"][2]) == pytest.approx(3.0, abs=1e-3)


def test_sliders_of_a_skeleton_pose_its_bones(wing):
    bpy.ops.moldline.add_wing_skeleton(stations=3)
    scene, obj = bpy.context.scene, bpy.context.object
    project.set_values(scene, {"twist": [0.0, 0.0, 5.0]})
    shape()
    tip = obj.pose.bones[2]
    _, turn, _ = tip.matrix_basis.decompose()
    assert np.degrees(turn.angle) == pytest.approx(5.0, abs=1e-3)
    bpy.ops.moldline.reset_handle()
    shape()
    assert tip.matrix_basis.to_quaternion().angle == pytest.approx(0.0, abs=1e-4)


def test_pilots_hold_the_selected_points(thing):
    top = int(np.argmax(convert.points(thing.data)[:, 2]))
    chosen = np.zeros(258, bool)
    chosen[top] = True
    thing.data.vertices.foreach_set("select", chosen)
    assert bpy.ops.moldline.add_pilot_points() == {"FINISHED"}
    obj = bpy.context.object
    assert obj.moldline.role == "marks" and len(obj.data.vertices) == 1
    obj.data.vertices[0].co.z += 0.2
    np.testing.assert_allclose(shape()[top], [0.0, 0.0, 1.2], atol=1e-5)


def test_a_mesh_made_in_blender_becomes_the_geometry(tmp_path):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12)
    count = len(bpy.context.object.data.vertices)
    assert bpy.ops.moldline.add_lattice(shape=(2, 2, 2)) == {"FINISHED"}
    scene = bpy.context.scene
    assert case()["geometry"]["Sphere"]["file"].endswith(".vtp")
    assert len(shape()) == count and scene.moldline.path == ""


def test_mirroring_moves_the_other_side_alike(thing):
    bpy.ops.moldline.add_lattice(shape=(2, 3, 2))
    obj = bpy.context.object
    before = np.array([v.co for v in obj.data.vertices])
    obj.data.vertices[int(np.argmax(before @ [1.0, 1.0, 1.0]))].co += type(obj.location)(
        (0.1, 0.2, 0.3)
    )
    shape()
    assert bpy.ops.moldline.mirror_handle(across="y", side="+") == {"FINISHED"}
    shape()
    moved = np.array([v.co for v in obj.data.vertices]) - before
    low = int(np.argmax(before @ [1.0, -1.0, 1.0]))
    np.testing.assert_allclose(moved[low], [0.1, -0.2, 0.3], atol=1e-6)


def test_a_handle_that_was_deleted_or_hidden_comes_back(thing):
    bpy.ops.moldline.add_lattice(shape=(2, 2, 2))
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.context.object)
    shape()
    assert bpy.ops.moldline.show_handles() == {"FINISHED"}
    obj = handles.all_of(scene)[0]
    obj.hide_set(True)
    assert bpy.ops.moldline.select_handle(stage=0) == {"FINISHED"}
    assert bpy.context.object == obj and not obj.hide_get()


def test_an_edited_surface_becomes_the_geometry_or_is_brought_back(thing):
    bpy.ops.moldline.add_lattice(shape=(2, 2, 2))
    shape()
    for act, height in (("restore_surface", 1.0), ("use_surface", 2.0)):
        bpy.context.view_layer.objects.active = thing
        bpy.ops.object.mode_set(mode="EDIT")
        own = bmesh.from_edit_mesh(thing.data)
        max(own.verts, key=lambda vertex: vertex.co.z).co.z = 2.0
        bmesh.update_edit_mesh(thing.data)
        bpy.ops.object.mode_set(mode="OBJECT")
        following.settle()
        assert thing[results.EDITED]
        assert getattr(bpy.ops.moldline, act)() == {"FINISHED"}
        assert shape()[:, 2].max() == pytest.approx(height)
    assert case()["geometry"]["ball"]["file"].endswith("ball_edited.vtp")


def test_what_cannot_be_is_said(thing):
    with pytest.raises(RuntimeError, match="select from 1 to 100 points"):
        bpy.ops.moldline.add_pilot_points()
    thing.data.vertices.foreach_set("select", np.zeros(258, bool))
    with pytest.raises(RuntimeError, match="select some points"):
        bpy.ops.moldline.add_lattice(around="REGION")
    assert not project.has_case(bpy.context.scene)


def test_mirrored_places_are_those_of_their_partners():
    rest = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 0.0]])
    moved = rest + [[0.1, 0.2, 0.3], [0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]
    found = stages.mirrored(rest, moved, 1, 1.0)
    np.testing.assert_allclose(found, moved + [[0, 0, 0], [0.1, -0.2, 0.3], [0, 0, 0]])


def test_an_object_that_was_placed_and_changed_becomes_the_geometry_as_it_is_seen():
    bpy.ops.mesh.primitive_cube_add(location=(3.0, 0.0, 0.0))
    bpy.context.object.modifiers.new("finer", "SUBSURF").levels = 2
    assert bpy.ops.moldline.add_lattice(shape=(2, 2, 2)) == {"FINISHED"}
    surface = project.surface(bpy.context.scene)
    points = shape()
    assert len(points) == 98 and not surface.modifiers
    np.testing.assert_allclose(points.mean(axis=0), [3.0, 0.0, 0.0], atol=1e-6)
    assert surface.location.x == 0.0


def test_another_object_does_not_take_the_place_of_a_case(thing):
    bpy.ops.moldline.add_lattice(shape=(2, 2, 2))
    text = project.text(bpy.context.scene)
    bpy.ops.mesh.primitive_cube_add()
    with pytest.raises(RuntimeError, match="case is about 'ball'"):
        bpy.ops.moldline.add_lattice(shape=(2, 2, 2))
    assert project.text(bpy.context.scene) == text


def test_a_body_skeleton_is_posed_by_its_bones(thing):
    assert bpy.ops.moldline.add_body_skeleton(stations=4) == {"FINISHED"}
    obj, before = bpy.context.object, shape()
    bone = obj.pose.bones[1]
    bone.location = bone.bone.matrix_local.to_3x3().inverted() @ type(bone.location)((0, 0, 0.1))
    assert (shape() - before)[:, 2].max() > 0.05
    np.testing.assert_allclose(handles.read(obj)[1, 0, 2], 0.1, atol=1e-5)


def test_a_lattice_around_a_component_moves_that_alone(tmp_path):
    points, faces = ball()
    tags = np.repeat([0, 1], len(faces))
    both = np.concatenate([faces, faces + len(points)])
    write_tri(tmp_path / "two.tri", np.concatenate([points, points + [5.0, 0.0, 0.0]]), both, tags)
    files.import_file(tmp_path / "two.tri", "m")
    bpy.context.object.active_material_index = 1
    assert bpy.ops.moldline.add_lattice(shape=(2, 2, 2), around="COMPONENT") == {"FINISHED"}
    before = shape()
    bpy.context.object.location.z = 0.5
    moved = shape() - before
    assert not moved[: len(points)].any()
    np.testing.assert_allclose(moved[len(points) :, 2], 0.5, atol=1e-6)
