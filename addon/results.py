# SPDX-License-Identifier: GPL-3.0-or-later
"""A case's result as a mesh object."""

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from . import convert

EDITED, JOINED = "moldline_edited", "moldline_joined"
"""Properties of the object: whether it was edited by hand, and the name of its triangles."""

BY_HAND = (
    "the surface was edited by hand: 'Use Edited Surface' makes it the geometry, "
    "'Restore Surface' brings the result back"
)
"""What is said while it is; nothing else writes over it."""


def show(
    scene: bpy.types.Scene, shown: bpy.types.Object | None, case: Any, shape: Any, title: str
) -> bpy.types.Object:
    """The object of the result, made where there is none, with the shape's points.

    One that was edited by hand stays as it is.
    """
    joining = (shape.faces, shape.tags, shape.components)
    faces, tags, components = case.joining if shape.faces is None else joining
    if shown is not None and shown.type != "MESH":
        shown = None
    if shown is not None and shown.get(EDITED, False):
        return shown
    if shown is None:
        lines = _lines(case, len(shape.points)) if faces is None else None
        shown = convert.new_object(
            title, shape.points, faces=faces, lines=lines, tags=tags, components=components or ()
        )
    elif is_other(shown.data, shape.points, faces):
        if faces is None:
            shown.data.clear_geometry()
            shown.data.from_pydata(shape.points, _lines(case, len(shape.points)), ())
        else:
            convert.set_faces(shown, shape.points, faces, tags, components)
    shown.pop(JOINED, None)
    convert.set_points(shown.data, shape.points)
    if shown.name not in scene.objects:
        scene.collection.objects.link(shown)
    return shown


def adopt(obj: bpy.types.Object) -> None:
    """Let an object show a result: what placed and changed its mesh is in the geometry already."""
    obj.pop(EDITED, None)
    if obj.data.users > 1:
        obj.data = obj.data.copy()
    if obj.data.shape_keys is not None:
        obj.shape_key_clear()
    obj.modifiers.clear()
    obj.matrix_world = Matrix.Identity(4)


def is_other(mesh: bpy.types.Mesh, points: np.ndarray, faces: np.ndarray | None) -> bool:
    """Whether a mesh is not made of these points and faces."""
    if len(mesh.vertices) != len(points):
        return True
    if faces is None:
        return len(mesh.polygons) > 0
    if len(mesh.polygons) != len(faces) - mesh.get(convert.LEFT_OUT, 0):
        return True
    corners = np.empty(len(mesh.loops), np.int32)
    if len(corners) != faces.size:
        return faces.shape[1] == 3 and not mesh.get(convert.LEFT_OUT)
    mesh.attributes[".corner_vert"].data.foreach_get("value", corners)
    return not np.array_equal(corners, np.ravel(faces))


def _lines(case: Any, count: int) -> np.ndarray:
    """What joins points without faces: those of a section follow each other."""
    if case.description.get("kind") != "section":
        return np.zeros((0, 2), np.int32)
    first = np.arange(count - 1)
    return np.stack([first, first + 1], axis=1)
