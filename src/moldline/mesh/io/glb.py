"""GLB: surfaces for viewers, the binary form of glTF 2.0. It is only written.

Each component becomes a node of its name, with a mesh of its own. Viewers have y up where aircraft
have z: one node above all turns the surface, and moves it to its place, for coordinates count from
the middle of the surface, so that 4-byte floats lose least. Normals are smooth but for edges where
two triangles meet at more than `CREASE`; points there become several.

Lost on writing: data, double precision, points without faces, components without triangles. What a
viewer gets is no geometry to go on with, so such files are not read: read the file that the surface
came from.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...errors import GeometryError
from ..surface import Surface
from ..topology import neighbours
from .binary import narrowed
from .files import replacing

NAME = "GLB"
SUFFIXES = (".glb",)
HOLDS = Surface

CREASE = np.radians(35)
"""Smallest angle between the normals of two triangles at an edge that is to be seen [rad]."""

TURN = [-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
"""Quaternion (x, y, z, w) that lays z on y, about x."""

MATERIAL = {
    "name": "surface",
    "doubleSided": True,  # an open patch is to be seen from both sides
    "pbrMetallicRoughness": {
        "baseColorFactor": [0.75, 0.78, 0.82, 1.0],
        "metallicFactor": 0.1,
        "roughnessFactor": 0.55,
    },
}

_FLOAT, _UINT, _ARRAY, _INDEX = 5126, 5125, 34962, 34963


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether it begins as glTF does."""
    return head[:4] == b"glTF"


class _Vertices(NamedTuple):
    """Fans of triangles around a point that no crease divides; a smooth point has one."""

    of_corners: np.ndarray
    """The vertex of each corner, by face."""
    points: np.ndarray
    """Which point each vertex stands at, ascending."""
    normals: np.ndarray


def write(path: Path | str, surface: Surface) -> None:
    """Write one scene."""
    with replacing(path) as file:
        if not len(surface.faces):
            raise GeometryError(f"{path}: the surface has no triangles, so there is none to view")
        tree, binary = _scene(surface, path)
        text = json.dumps(tree, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        size = 12 + 8 + len(text) + 8 + len(binary)
        if size >= 2**32:
            raise GeometryError(f"{path}: a GLB file ends at 4 GB, this needs {size} bytes")
        file.write(b"glTF" + np.array([2, size, len(text)], "<u4").tobytes() + b"JSON" + text)
        file.write(np.array(len(binary), "<u4").tobytes() + b"BIN\0" + binary)


def _scene(surface: Surface, path: Path | str) -> tuple[dict[str, Any], bytes]:
    """The tree of nodes, and the numbers that it refers to."""
    points, faces, tags = (np.asarray(a) for a in (surface.points, surface.faces, surface.tags))
    used = points[_different(faces, len(points))[0]]
    middle = used.min(axis=0) / 2 + used.max(axis=0) / 2
    vertices = _vertices(points, faces)
    x, y, z = middle.tolist()
    nodes: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    arrays: list[np.ndarray] = []
    for number in np.unique(tags).tolist():
        own, index = _different(vertices.of_corners[tags == number], len(vertices.points))
        at, name = len(arrays), surface.components[number]
        arrays.append(narrowed(points[vertices.points[own]] - middle, np.dtype("<f4"), path))
        arrays += [vertices.normals[own].astype("<f4"), index.astype("<u4")]
        attributes = {"POSITION": at, "NORMAL": at + 1}
        primitive = {"attributes": attributes, "indices": at + 2, "material": 0}
        nodes.append({"name": name, "mesh": len(meshes)})
        meshes.append({"name": name, "primitives": [primitive]})
    top = {"name": "moldline", "rotation": TURN, "translation": [x, z, -y]}
    nodes.append({**top, "children": [*range(len(nodes))]})
    views, accessors, binary = _packed(arrays)
    tree = {
        "asset": {"version": "2.0", "generator": "moldline"},
        "scene": 0,
        "scenes": [{"nodes": [len(meshes)]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [MATERIAL],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    return tree, binary


def _vertices(points: np.ndarray, faces: np.ndarray) -> _Vertices:
    """Corners are one vertex where smooth edges join their triangles."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        areas = np.cross(b - a, c - a)
    flat, pairs = _units(areas), neighbours(faces)
    is_smooth = np.einsum("ij,ij->i", flat[pairs.one], flat[pairs.other]) > np.cos(CREASE)
    one, other = pairs.one[is_smooth], pairs.other[is_smooth]
    pair, i, j = np.nonzero(faces[one][:, :, None] == faces[other][:, None, :])
    links = (np.ones(len(pair), bool), (3 * one[pair] + i, 3 * other[pair] + j))
    count, fan = connected_components(coo_array(links, (faces.size, faces.size)), directed=False)
    point = np.empty(count, np.int64)
    point[fan] = faces.ravel()
    order = np.argsort(point, kind="stable")
    rank = np.empty(count, np.int64)
    rank[order] = np.arange(count)
    vertex = rank[fan]
    sums = [np.bincount(vertex, np.repeat(areas[:, k], 3), count) for k in range(3)]
    return _Vertices(vertex.reshape(-1, 3), point[order], _units(np.stack(sums, axis=1)))


def _different(numbers: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The different numbers among some below `count`, ascending, and which of them each is."""
    occurs = np.zeros(count, bool)
    occurs[numbers] = True
    return np.flatnonzero(occurs), (np.cumsum(occurs) - 1)[numbers.ravel()]


def _units(vectors: np.ndarray) -> np.ndarray:
    """Vectors of length 1; any where there is no direction."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        units = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    units[~np.isfinite(units).all(axis=1)] = [0.0, 0.0, 1.0]
    return units


def _packed(arrays: list[np.ndarray]) -> tuple[list[dict], list[dict], bytes]:
    """Where each array lies in the bytes of all, and what it holds."""
    views, accessors, at = [], [], 0
    for number, array in enumerate(arrays):
        is_index = array.ndim == 1
        target = _INDEX if is_index else _ARRAY
        views.append({"buffer": 0, "byteOffset": at, "byteLength": array.nbytes, "target": target})
        accessors.append(
            {
                "bufferView": number,
                "componentType": _UINT if is_index else _FLOAT,
                "count": len(array),
                "type": "SCALAR" if is_index else "VEC3",
                "min": np.atleast_1d(array.min(axis=0)).tolist(),
                "max": np.atleast_1d(array.max(axis=0)).tolist(),
            }
        )
        at += array.nbytes
    return views, accessors, b"".join(array.tobytes() for array in arrays)
