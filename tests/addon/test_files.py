"""Import and export: to the bit, with components, units and data; what is wrong is a sentence."""

import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import convert, files, session
from conftest import ball, write_tri


@pytest.fixture
def tri(tmp_path):
    """A ball of two components, with numbers that need double precision."""
    points, faces = ball()
    tags = (points[faces[:, 0], 2] > 0).astype(int)
    write_tri(tmp_path / "ball.tri", points / 3, faces, tags)
    return tmp_path / "ball.tri"


def imported(path, **more):
    assert bpy.ops.moldline.import_geometry(filepath=str(path), **more) == {"FINISHED"}
    return bpy.context.object


def test_a_geometry_comes_in_to_the_bit_with_its_components(tri):
    found = imported(tri)
    points, faces = ball()
    np.testing.assert_array_equal(convert.points(found.data), points / 3)
    np.testing.assert_array_equal(convert.triangles(found.data)[0], faces)
    assert found.name == "ball" and len(convert.components(found)) == 2
    assert found.select_get()


def test_out_and_in_again_nothing_is_lost(tri, tmp_path):
    first = imported(tri)
    first.data[convert.NAMES] = '["lower", "upper"]'
    for material, name in zip(first.data.materials, ("lower", "upper"), strict=True):
        material[convert.NAMES] = name
    bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "again.vtp"))
    second = imported(tmp_path / "again.vtp")
    np.testing.assert_array_equal(convert.points(second.data), convert.points(first.data))
    for one, other in zip(
        convert.triangles(second.data), convert.triangles(first.data), strict=True
    ):
        np.testing.assert_array_equal(one, other)
    assert convert.components(second) == ["lower", "upper"]


def test_lengths_are_metres_where_the_unit_is_said(tri, tmp_path):
    found = imported(tri, units="mm")
    np.testing.assert_allclose(convert.points(found.data), ball()[0] / 3e3, rtol=1e-15)
    bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "out.tri"), units="mm")
    again = imported(tmp_path / "out.tri")
    np.testing.assert_allclose(convert.points(again.data), ball()[0] / 3, rtol=1e-15)


def test_several_files_come_in_at_once(tri, tmp_path):
    write_tri(tmp_path / "other.tri", *ball())
    bpy.ops.moldline.import_geometry(
        directory=str(tmp_path), files=[{"name": "ball.tri"}, {"name": "other.tri"}]
    )
    assert [one.name for one in bpy.data.objects] == ["ball", "other"]


def test_several_objects_go_out_as_one_where_they_stand(tri, tmp_path):
    first, second = imported(tri), imported(tri)
    second.location.x = 3.0
    for one in (first, second):
        one.select_set(True)
    bpy.context.view_layer.update()
    bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "two.vtp"))
    found = imported(tmp_path / "two.vtp")
    own = ball()[0] / 3
    moved = own + [3.0, 0.0, 0.0]
    np.testing.assert_array_equal(convert.points(found.data), np.vstack([own, moved]))
    assert len(convert.components(found)) == 4


def test_what_is_modelled_in_blender_goes_out_with_its_modifiers(tmp_path):
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    cube.modifiers.new("round", "SUBSURF").levels = 2
    bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "cube.stl"))
    found = imported(tmp_path / "cube.stl")
    assert len(convert.triangles(found.data)[0]) == 6 * 16 * 2


def test_an_airfoil_is_a_line_of_edges(tmp_path):
    angle = np.linspace(0, 2 * np.pi, 41)
    rows = [f"{0.5 + 0.5 * np.cos(a):.7f} {0.06 * np.sin(a):.7f}" for a in angle]
    (tmp_path / "foil.dat").write_text("foil\n" + "\n".join(rows) + "\n")
    found = imported(tmp_path / "foil.dat")
    assert not len(found.data.polygons) and len(found.data.edges) >= 40
    bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "again.dat"))
    again = imported(tmp_path / "again.dat")
    np.testing.assert_allclose(
        convert.points(again.data), convert.points(found.data), rtol=0, atol=1e-12
    )


def test_blocks_of_points_stay_blocks(tmp_path):
    i, j = np.meshgrid(np.arange(4.0), np.arange(3.0), indexing="ij")
    axes = np.stack([i, j, 0 * i]).transpose(0, 2, 1).reshape(-1)
    (tmp_path / "grid.xyz").write_text("1\n4 3 1\n" + " ".join(map(repr, axes.tolist())) + "\n")
    found = imported(tmp_path / "grid.xyz")
    assert len(found.data.vertices) == 12 and len(found.data.polygons) == 12
    bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "again.xyz"))
    again = imported(tmp_path / "again.xyz")
    np.testing.assert_array_equal(convert.points(again.data), convert.points(found.data))


def test_a_source_counts_as_long_as_the_object_is_what_was_read(tri):
    found = imported(tri, units="cm")
    assert files.source(found) == (str(tri), "cm")
    convert.set_points(found.data, convert.points(found.data) + 1e-12)
    assert files.source(found) is None
    assert files.source(imported(tri)) == (str(tri), "")
    tri.write_text(tri.read_text())
    assert files.source(bpy.context.object) is None


@pytest.mark.parametrize(
    "name, said", [("none.tri", "none.tri"), ("bad.tri", "bad.tri"), ("odd.abc", "odd.abc")]
)
def test_a_file_that_cannot_be_read_is_a_sentence(tmp_path, name, said):
    if name != "none.tri":
        (tmp_path / name).write_text("3 1\n0 0\n")
    with pytest.raises(RuntimeError, match=said):
        bpy.ops.moldline.import_geometry(filepath=str(tmp_path / name))
    assert not bpy.data.objects and not bpy.data.meshes


def test_nothing_to_write_is_a_sentence(tmp_path):
    with pytest.raises(RuntimeError, match="select one or more mesh objects that have faces"):
        bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "a.tri"))


def test_an_airfoil_file_is_not_for_a_surface(tri, tmp_path):
    imported(tri)
    with pytest.raises(RuntimeError, match="airfoil coordinates are of one object with edges"):
        bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "a.dat"))
    line = convert.new_object("star", np.random.default_rng(0).random((4, 3)), lines=[[0, 1]])
    with pytest.raises(session.Problem, match="one line through all points"):
        files.geometry([line], ".dat")


def test_a_folder_that_is_not_there_is_a_sentence(tri, tmp_path):
    imported(tri)
    with pytest.raises(RuntimeError, match="nowhere"):
        bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "nowhere" / "a.tri"))


def test_the_endings_that_blender_offers_are_those_that_moldline_has():
    told = []
    session.run(lambda client: client.formats(), told.append)
    assert {one["ending"] for one in told[0]["read"]} == set(files.READ)
    offered = {ending for ending, _ in files.WRITE}
    assert offered <= {one["ending"] for one in told[0]["write"]}
    names = [{one["name"] for one in told[0]["write"] if one["ending"] == e}.pop() for e in offered]
    assert set(names) == {one["name"] for one in told[0]["write"]}


def test_menus_and_dropped_files_know_the_operator():
    assert files._import_entry in bpy.types.TOPBAR_MT_file_import._dyn_ui_initialize()
    handler = bpy.types.MOLDLINE_FH_geometry
    assert handler.bl_import_operator == "moldline.import_geometry"
    assert ".tri" in handler.bl_file_extensions


def test_what_shape_keys_show_is_written_also_of_what_was_read(tri, tmp_path):
    found = imported(tri)
    found.shape_key_add(name="Basis")
    found.shape_key_add(name="up").value = 0.5
    found.data.shape_keys.key_blocks["up"].data[0].co.z += 1.0
    assert files.source(found) is None
    bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "up.tri"))
    again = imported(tmp_path / "up.tri")
    moved = convert.points(again.data) - ball()[0] / 3
    assert moved[0, 2] == pytest.approx(0.5, abs=1e-7) and np.abs(moved[1:]).max() < 1e-7


def test_a_mirrored_object_is_written_with_its_outside_outside(tri):
    found = imported(tri)
    found.scale.y = -1.0
    bpy.context.view_layer.update()
    given = files.geometry([found])
    a, b, c = (given.points[given.faces[:, i]] for i in range(3))
    assert np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c).min() > 0
