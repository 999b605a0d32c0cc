"""GLB, which viewers read."""

import json
import struct

import numpy as np
import pytest
import trimesh
from conftest import same_bits
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from strategies import geometry

from moldline.errors import FileError, GeometryError
from moldline.mesh import io
from moldline.mesh.surface import Surface

ROOF = Surface(
    np.array([[0, 0, 0], [2, 0, 0], [0, 1, 3], [2, 1, 3], [0, 2, 0], [2, 2, 0]], float),
    [[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]],
    [1, 1, 3, 3],
    ("nothing", "left", "nothing else", "right ü"),
)
"""Two planes that meet at a sharp ridge along x; z is up."""


def tree(path):
    """The JSON of a file whose sizes are right."""
    data = path.read_bytes()
    magic, version, size, length, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, size, kind) == (b"glTF", 2, len(data), b"JSON")
    binary, mark = struct.unpack("<I4s", data[20 + length : 28 + length])
    assert (mark, 28 + length + binary) == (b"BIN\0", len(data))
    assert length % 4 == binary % 4 == 0
    return json.loads(data[20 : 20 + length])


def loaded(path):
    """Name and mesh of each component as a viewer sees them, turned back to have z up."""
    scene = trimesh.load(path, process=False)
    found = {}
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        mesh = scene.geometry[name].copy()
        mesh.apply_transform(matrix)
        found[node] = mesh.vertices @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]], mesh.faces
    return found


def normals_in(path):
    """The normals of each component, as they stand in the file."""
    scene, found = tree(path), {}
    binary = path.read_bytes()[-scene["buffers"][0]["byteLength"] :]
    for mesh in scene["meshes"]:
        accessor = scene["accessors"][mesh["primitives"][0]["attributes"]["NORMAL"]]
        begin = scene["bufferViews"][accessor["bufferView"]]["byteOffset"]
        numbers = np.frombuffer(binary, "<f4", 3 * accessor["count"], begin)
        found[mesh["name"]] = numbers.reshape(-1, 3)
    return found


def test_each_component_is_a_node_of_its_name(tmp_path):
    io.write(tmp_path / "a.glb", ROOF)
    found = loaded(tmp_path / "a.glb")
    assert found.keys() == {"left", "right ü"}
    for name, faces in (("left", ROOF.faces[:2]), ("right ü", ROOF.faces[2:])):
        points, triangles = found[name]
        np.testing.assert_allclose(points[triangles], ROOF.points[faces], atol=1e-6)


def test_z_becomes_y_as_viewers_have_it(tmp_path):
    io.write(tmp_path / "a.glb", ROOF)
    np.testing.assert_allclose(
        trimesh.load(tmp_path / "a.glb").bounds, [[0, 0, -2], [2, 3, 0]], atol=1e-6
    )


def test_coordinates_far_from_the_origin_keep_their_digits(tmp_path):
    far = ROOF.moved(ROOF.points * 1e-3 + 1e6)
    io.write(tmp_path / "a.glb", far)
    scene = tree(tmp_path / "a.glb")
    x, y, z = next(node for node in scene["nodes"] if "translation" in node)["translation"]
    np.testing.assert_allclose([x, -z, y], far.points.mean(axis=0), atol=1e-9)
    assert max(map(max, (accessor["max"] for accessor in scene["accessors"]))) <= 3  # of indices


def test_normals_are_flat_at_a_ridge_and_smooth_on_a_ball(tmp_path, ball):
    io.write(tmp_path / "a.glb", ROOF)
    for name, (points, faces) in loaded(tmp_path / "a.glb").items():
        normals = normals_in(tmp_path / "a.glb")[name]
        a, b, c = points[faces].swapaxes(0, 1)
        flat = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a), axis=1)[:, None]
        np.testing.assert_allclose(normals[faces], np.repeat(flat[:, None], 3, 1), atol=1e-6)
    io.write(tmp_path / "b.glb", ball)
    ((points, faces),) = loaded(tmp_path / "b.glb").values()
    (normals,) = normals_in(tmp_path / "b.glb").values()
    assert same_bits(faces, np.asarray(ball.faces, faces.dtype))  # no vertex was split or moved
    middle = np.asarray(ball.points).mean(axis=0)
    outward = (points - middle) / np.linalg.norm(points - middle, axis=1)[:, None]
    assert (np.einsum("ij,ij->i", normals, outward) > np.cos(np.radians(5))).all()


@settings(
    derandomize=True,
    deadline=None,
    database=None,
    max_examples=50,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(seed=st.integers(0, 2**32))
def test_any_surface_keeps_its_triangles_and_names(tmp_path, seed):
    surface = geometry(Surface, seed, precision=4)
    io.write(tmp_path / "a.glb", surface)
    scene = tree(tmp_path / "a.glb")
    assert [mesh["name"] for mesh in scene["meshes"]] == [*surface.components]
    span = np.ptp(surface.points, axis=0).max() + np.abs(surface.points).max()
    normals = normals_in(tmp_path / "a.glb")
    for name, (points, faces) in loaded(tmp_path / "a.glb").items():
        expected = surface.points[surface.faces[surface.tags == surface.components.index(name)]]
        np.testing.assert_allclose(points[faces], expected, atol=1e-6 * span)
        assert normals[name].shape == points.shape
        np.testing.assert_allclose(np.linalg.norm(normals[name], axis=1), 1, atol=1e-6)


def test_it_is_not_read_and_says_what_to_do(tmp_path):
    io.write(tmp_path / "a.glb", ROOF)
    message = r"a\.glb: GLB is only written; read the file that it was made from"
    with pytest.raises(FileError, match=message):
        io.read(tmp_path / "a.glb")
    with pytest.raises(FileError, match=message):
        io.read(tmp_path / "a.glb", format="glb")


def test_what_cannot_be_viewed_is_refused(tmp_path):
    with pytest.raises(GeometryError, match="the surface has no triangles"):
        io.write(tmp_path / "a.glb", Surface(np.eye(3), np.empty((0, 3))))
    with pytest.raises(FileError, match="does not fit a float of 4 bytes"):
        io.write(tmp_path / "a.glb", ROOF.moved(ROOF.points * 1e300))
    assert not list(tmp_path.iterdir())
