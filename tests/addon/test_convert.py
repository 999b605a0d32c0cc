"""Arrays in Blender's meshes: doubles survive, names survive, what Blender cannot take is told."""

import bmesh
import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import convert
from conftest import ball


@pytest.fixture
def exact():
    """Points that no single precision number is equal to."""
    return np.random.default_rng(3).normal(size=(258, 3)) * 10.0 ** np.arange(-3, 6, 3)


def _made(points, **more):
    return convert.new_object("ball", points, ball()[1], **more)


def test_points_come_back_to_the_bit(exact):
    thing = _made(exact)
    np.testing.assert_array_equal(convert.points(thing.data), exact)
    assert convert.points(thing.data).dtype == np.float64
    np.testing.assert_array_equal(convert.triangles(thing.data)[0], ball()[1])


def test_a_moved_vertex_takes_its_float_and_the_others_keep_their_doubles(exact):
    thing = _made(exact)
    thing.data.vertices[5].co.x += 1.0
    thing.data.update()
    found = convert.points(thing.data)
    assert found[5, 0] == thing.data.vertices[5].co.x != exact[5, 0]
    found[5, 0] = exact[5, 0]
    np.testing.assert_array_equal(found, exact)


def test_single_precision_moves_points_and_doubles_return_when_they_are_written(exact):
    thing = _made(exact)
    convert.set_points(thing.data, (exact + 1).astype(np.float32))
    np.testing.assert_array_equal(convert.points(thing.data), (exact + 1).astype(np.float32))
    convert.set_points(thing.data, exact)
    np.testing.assert_array_equal(convert.points(thing.data), exact)


def test_doubles_survive_edits_of_topology_undo_and_the_file(exact, tmp_path):
    thing = _made(exact)
    own = bmesh.new()
    own.from_mesh(thing.data)
    own.verts.ensure_lookup_table()
    bmesh.ops.delete(own, geom=[own.verts[0], own.verts[100]], context="VERTS")
    own.to_mesh(thing.data)
    own.free()
    left = np.delete(exact, [0, 100], axis=0)
    np.testing.assert_array_equal(convert.points(thing.data), left)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    np.testing.assert_array_equal(convert.points(bpy.data.objects["ball"].data), left)


def test_a_new_vertex_of_a_cut_edge_takes_its_float(exact):
    thing = _made(exact)
    own = bmesh.new()
    own.from_mesh(thing.data)
    bmesh.ops.subdivide_edges(own, edges=own.edges[:1], cuts=1)
    own.to_mesh(thing.data)
    own.free()
    found = convert.points(thing.data)
    np.testing.assert_array_equal(found[:258], exact)
    np.testing.assert_array_equal(found[258], np.array(thing.data.vertices[258].co))


def test_edit_mode_is_read_and_moved_as_it_is_now(exact):
    thing = _made(exact, tags=np.arange(len(ball()[1])) % 2, components=["up", "down"])
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.mode_set(mode="EDIT")
    own = bmesh.from_edit_mesh(thing.data)
    own.verts.ensure_lookup_table()
    own.verts[7].co.z = 4.0
    found = convert.points(thing.data)
    assert found[7, 2] == 4.0
    found[7, 2] = exact[7, 2]
    np.testing.assert_array_equal(found, exact)
    assert convert.components(thing) == ["up", "down"]
    assert set(convert.triangles(thing.data)[1]) == {0, 1}
    convert.set_points(thing.data, exact + 1.0)
    assert own.verts[7].co.z == np.float32(exact[7, 2] + 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(bpy.data.meshes) == 1


def test_components_have_names_numbers_and_colours():
    points, faces = ball()
    tags = (points[faces[:, 0], 2] > 0).astype(int)
    thing = _made(points, tags=tags, components=["lower", "upper"])
    assert convert.components(thing) == ["lower", "upper"]
    np.testing.assert_array_equal(convert.triangles(thing.data)[1], tags)
    colours = {tuple(one.diffuse_color) for one in thing.data.materials}
    assert [one.name for one in thing.data.materials] == ["lower", "upper"] and len(colours) == 2


def test_joined_objects_keep_the_components_of_both():
    points, faces = ball()
    first = _made(points, tags=np.zeros(len(faces), int), components=["wing"])
    second = _made(points + 3.0, tags=np.arange(len(faces)) % 2, components=["body", "fin"])
    for one in (first, second):
        one.select_set(True)
    bpy.context.view_layer.objects.active = first
    bpy.ops.object.join()
    tags = convert.triangles(first.data)[1]
    names = np.array(convert.components(first))[tags]
    assert list(names[: len(faces)]) == ["wing"] * len(faces)
    assert list(names[len(faces) :]) == ["body", "fin"] * (len(faces) // 2)
    np.testing.assert_array_equal(convert.points(first.data), np.vstack([points, points + 3.0]))


def test_what_is_made_in_blender_has_a_component_by_its_name_or_its_materials():
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    faces, tags = convert.triangles(cube.data)
    assert faces.shape == (12, 3) and not tags.any()
    assert convert.components(cube) == ["Cube"]
    for name in ("paint", "glass"):
        cube.data.materials.append(bpy.data.materials.new(name))
    cube.data.polygons[5].material_index = 1
    assert convert.components(cube) == ["paint", "glass"]
    assert sum(convert.triangles(cube.data)[1]) == 2


def test_quadrilaterals_stay_and_triangles_among_them_too():
    points = np.random.default_rng(0).random((6, 3))
    faces = np.array([[0, 1, 2, 3], [3, 2, 4, 4], [4, 5, 0, -1]])
    thing = convert.new_object("grid", points, faces)
    assert [len(one.vertices) for one in thing.data.polygons] == [4, 3, 3]
    assert len(convert.triangles(thing.data)[0]) == 4


def test_faces_with_a_repeated_corner_are_left_out_and_counted():
    points, faces = ball()
    faces[4] = [7, 7, 9]
    thing = _made(points)
    thing = convert.new_object("bad", points, faces, tags=np.arange(len(faces)) % 2)
    assert thing.data[convert.LEFT_OUT] == 1
    assert len(convert.triangles(thing.data)[0]) == len(faces) - 1


def test_lines_and_clouds_have_no_faces():
    line = convert.new_object("section", np.eye(3), lines=np.array([[0, 1], [1, 2]]))
    np.testing.assert_array_equal(convert.lines(line.data), [[0, 1], [1, 2]])
    cloud = convert.new_object("cloud", np.eye(3))
    assert convert.points(cloud.data).shape == (3, 3)
    assert convert.triangles(cloud.data)[0].shape == (0, 3)
    assert convert.points(convert.new_object("none", np.zeros((0, 3))).data).shape == (0, 3)


def test_a_union_made_anew_has_other_faces_in_the_same_object(exact):
    thing = _made(exact)
    points = ball()[0]
    convert.set_faces(thing, points[:6], np.array([[0, 1, 2], [1, 3, 2]]), [0, 1], ["a", "b"])
    assert len(thing.data.vertices) == 6 and convert.components(thing) == ["a", "b"]
    np.testing.assert_array_equal(convert.points(thing.data), points[:6])
    np.testing.assert_array_equal(convert.triangles(thing.data)[1], [0, 1])


def test_numbers_by_point_come_back():
    points = ball()[0]
    thing = _made(points, data={"cp": points[:, 0], "force": points})
    found = convert.data(thing.data)
    assert set(found) == {"cp", "force"}
    np.testing.assert_allclose(found["cp"], points[:, 0], rtol=0, atol=1e-7)
    np.testing.assert_allclose(found["force"], points, rtol=0, atol=1e-7)


def test_marked_triangles_are_selected_with_their_points():
    points, faces = ball()
    thing = _made(points)
    convert.mark(thing.data, [3, 8])
    assert [one.index for one in thing.data.polygons if one.select] == [3, 8]
    chosen = [one.index for one in thing.data.vertices if one.select]
    assert chosen == sorted(set(faces[[3, 8]].ravel()))


def test_colours_are_shown_and_taken_away():
    thing = _made(ball()[0])
    convert.colour(thing.data, np.tile([1.0, 0.0, 0.0, 1.0], (258, 1)))
    assert thing.data.color_attributes.active_color.name == convert.COLOUR
    assert tuple(thing.data.color_attributes[0].data[5].color) == (1.0, 0.0, 0.0, 1.0)
    convert.colour(thing.data, None)
    assert not thing.data.color_attributes


def test_a_wrong_number_of_points_is_refused():
    thing = _made(ball()[0])
    with pytest.raises(ValueError, match=r"258 points need an array of \(258, 3\), got \(3, 3\)"):
        convert.set_points(thing.data, np.eye(3))
