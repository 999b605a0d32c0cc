"""Meshes of Blender as arrays, in and out."""

import zlib
from typing import Any

import numpy as np

from .wrong import Wrong


def positions(mesh: Any) -> np.ndarray:
    """Where the vertices are, in the object's own coordinates (n, 3)."""
    found = np.empty(3 * len(mesh.vertices), np.float32)
    if len(found):
        mesh.attributes["position"].data.foreach_get("vector", found)
    return found.reshape(-1, 3)


def place(mesh: Any, points: np.ndarray) -> None:
    """Move the vertices; shape keys keep their differences from the first."""
    own = np.ascontiguousarray(points, np.float32)
    keys = mesh.shape_keys
    if keys is not None:
        base = _key_points(keys.reference_key)
        change = own - base
        for key in keys.key_blocks:
            moved = own if key == keys.reference_key else _key_points(key) + change
            key.data.foreach_set("co", moved.astype(np.float32).ravel())
        keys.update_tag()
    mesh.attributes["position"].data.foreach_set("vector", own.ravel())
    mesh.update_tag()


def _key_points(key: Any) -> np.ndarray:
    found = np.empty(3 * len(key.data), np.float32)
    key.data.foreach_get("co", found)
    return found.reshape(-1, 3)


def replace(mesh: Any, points: np.ndarray, faces: np.ndarray) -> None:
    """Put other triangles in its place."""
    if mesh.shape_keys is not None:
        raise Wrong(
            "geometry",
            f"the mesh {mesh.name!r} has {len(mesh.vertices)} vertices with shape keys, and is "
            f"given {len(points)} points: shape keys need the same number",
        )
    mesh.clear_geometry()
    mesh.vertices.add(len(points))
    mesh.loops.add(3 * len(faces))
    mesh.polygons.add(len(faces))
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(faces, np.int32).ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * len(faces), 3, dtype=np.int32))
    mesh.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    mesh.update(calc_edges=True)
    mesh.validate(verbose=False)
    if len(mesh.polygons) != len(faces):
        raise Wrong(
            "geometry",
            f"Blender takes {len(mesh.polygons)} of {len(faces)} triangles only: the others use a "
            "vertex twice, or the same three as another",
        )


def connectivity(mesh: Any) -> list[int]:
    """Counts of vertices, faces and corners, and a sum of which vertices the corners are."""
    corners = np.empty(len(mesh.loops), np.int32)
    if len(corners):
        mesh.attributes[".corner_vert"].data.foreach_get("value", corners)
    return [len(mesh.vertices), len(mesh.polygons), len(corners), zlib.crc32(corners.data)]


def triangles(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    """Vertices of its triangles (m, 3), and the number of each one's material."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners = np.empty(3 * count, np.int32)
    owners = np.empty(count, np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    mesh.loop_triangles.foreach_get("polygon_index", owners)
    materials = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", materials)
    return corners.reshape(-1, 3), materials[owners]
