# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays into Blender's meshes and back, in double precision beside Blender's floats."""

import colorsys
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import bmesh
import bpy
import numpy as np

DOUBLES = (".moldline_x", ".moldline_y", ".moldline_z")
"""Hidden point attributes: the 64 bits of each coordinate as two integers."""

COMPONENT = "component"
"""Face attribute: the number of each face's component."""

NAMES = "moldline_components"
"""Property of a mesh: the components' names, as JSON; of a material: the one it stands for."""

LEFT_OUT = "moldline_left_out"
"""Property of a mesh: how many faces with a repeated corner it could not take."""

COLOUR = "moldline_colour"
"""Colour attribute that `colour` writes."""


def new_object(
    name: str,
    points: np.ndarray,
    faces: np.ndarray | None = None,
    lines: np.ndarray | None = None,
    tags: np.ndarray | None = None,
    components: Sequence[str] = (),
    data: Mapping[str, np.ndarray] | None = None,
    collection: bpy.types.Collection | None = None,
) -> bpy.types.Object:
    """A mesh object of points (n, 3) [m], in a collection, by default the active one.

    `faces` are (m, 3), or (m, 4) where a triangle repeats its last corner or has -1 there; `lines`
    are (l, 2); `tags` are each face's component; `data` are numbers (n,) or (n, 3) by point.
    """
    mesh = bpy.data.meshes.new(name)
    _fill(mesh, np.asarray(points), faces, lines)
    if faces is not None:
        _set_components(mesh, _kept(faces), tags, components)
    for key, values in (data or {}).items():
        _set_data(mesh, key, values)
    found = bpy.data.objects.new(name, mesh)
    (collection or bpy.context.collection).objects.link(found)
    return found


def set_points(mesh: bpy.types.Mesh, points: np.ndarray) -> None:
    """Move all points, (n, 3) [m]; doubles are kept beside the floats, single precision is not."""
    given = np.asarray(points)
    with np.errstate(over="ignore"):
        floats = np.ascontiguousarray(given, np.float32)
    if mesh.is_editmode:
        _move_edited(mesh, floats)
        return
    if given.shape != (len(mesh.vertices), 3):
        raise ValueError(
            f"{mesh.name}: {len(mesh.vertices)} points need an array of ({len(mesh.vertices)}, 3), "
            f"got {given.shape}"
        )
    if not len(given):
        return
    mesh.attributes["position"].data.foreach_set("vector", floats.ravel())
    if given.dtype == np.float64:
        for name, column in zip(DOUBLES, given.T, strict=True):
            bits = np.ascontiguousarray(column).view(np.int32)
            _attribute(mesh, name, "INT32_2D", "POINT").data.foreach_set("value", bits)
    mesh.update()


def points(mesh: bpy.types.Mesh) -> np.ndarray:
    """The points, (n, 3) [m], in double precision where they have not been moved since.

    A coordinate's double counts as long as Blender's float is the float of it.
    """
    with settled(mesh) as own:
        found = floats(own).astype(float)
        for axis, name in enumerate(DOUBLES):
            held = own.attributes.get(name)
            if held is None or held.data_type != "INT32_2D" or not len(found):
                continue
            double = _doubles(own, name)
            with np.errstate(over="ignore", invalid="ignore"):
                is_valid = double.astype(np.float32) == found[:, axis]
            found[is_valid, axis] = double[is_valid]
        return found


def has_doubles(mesh: bpy.types.Mesh) -> bool:
    """Whether each point is where `set_points` has put it in double precision."""
    found = floats(mesh)
    with np.errstate(over="ignore", invalid="ignore"):
        return all(
            name in mesh.attributes
            and np.array_equal(column, _doubles(mesh, name).astype(np.float32))
            for name, column in zip(DOUBLES, found.T, strict=True)
        )


def floats(mesh: bpy.types.Mesh) -> np.ndarray:
    """The points as Blender has them, (n, 3) in single precision; not in edit mode."""
    found = np.empty((len(mesh.vertices), 3), np.float32)
    if len(found):
        mesh.attributes["position"].data.foreach_get("vector", found.reshape(-1))
    return found


def triangles(mesh: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Triangles, (m, 3), and the component of each, (m,); faces of more corners are cut."""
    with settled(mesh) as own:
        tags = _parts(own)[1]
        if len(own.loops) == 3 * len(own.polygons):
            return _corners_of(own).reshape(-1, 3), tags
        own.calc_loop_triangles()
        found = np.empty(3 * len(own.loop_triangles), np.int32)
        own.loop_triangles.foreach_get("vertices", found)
        return found.reshape(-1, 3), tags[_polygons_of(own)]


def lines(mesh: bpy.types.Mesh) -> np.ndarray:
    """The edges, (l, 2)."""
    with settled(mesh) as own:
        found = np.empty((len(own.edges), 2), np.int32)
        if len(found):
            own.attributes[".edge_verts"].data.foreach_get("value", found.reshape(-1))
        return found


def components(thing: bpy.types.Object | bpy.types.Mesh) -> list[str]:
    """Names of the components, by the numbers that `triangles` gives.

    A mesh that was made in Blender has one for each material, or one by its own name.
    """
    mesh = thing.data if isinstance(thing, bpy.types.Object) else thing
    with settled(mesh) as own:
        found = _parts(own)[0]
    return found or [thing.name]


def data(mesh: bpy.types.Mesh) -> dict[str, np.ndarray]:
    """Numbers by point, (n,) or (n, 3), that others than Blender and this add-on gave names."""
    found = {}
    with settled(mesh) as own:
        for one in own.attributes:
            width = {"FLOAT": 1, "FLOAT_VECTOR": 3}.get(one.data_type)
            is_given = one.domain == "POINT" and width and not one.name.startswith(".")
            if is_given and one.name != "position":
                numbers = np.empty(len(own.vertices) * width, np.float32)
                one.data.foreach_get("value" if width == 1 else "vector", numbers)
                shaped = numbers if width == 1 else numbers.reshape(-1, 3)
                found[one.name] = shaped.astype(float)
    return found


def set_faces(
    thing: bpy.types.Object,
    points: np.ndarray,
    faces: np.ndarray,
    tags: np.ndarray | None = None,
    components: Sequence[str] = (),
) -> None:
    """Give an object other triangles: those of a union that was made anew."""
    mesh = thing.data
    mesh.clear_geometry()
    _fill(mesh, np.asarray(points), faces, None)
    _set_components(mesh, _kept(faces), tags, components)


def mark(mesh: bpy.types.Mesh, faces: np.ndarray) -> None:
    """Select these triangles, by their numbers in `triangles`, and nothing else."""
    wanted = np.zeros(len(mesh.polygons), bool)
    chosen = np.asarray(faces, int)
    if len(mesh.loops) != 3 * len(mesh.polygons):
        mesh.calc_loop_triangles()
        chosen = _polygons_of(mesh)[chosen]
    wanted[chosen] = True
    sizes = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    of_wanted = np.repeat(wanted, sizes)
    for name, things, attribute in (
        ("vertices", mesh.vertices, ".corner_vert"),
        ("edges", mesh.edges, ".corner_edge"),
    ):
        is_selected = np.zeros(len(things), bool)
        if len(mesh.polygons):
            is_selected[_corners_of(mesh, attribute)[of_wanted]] = True
        getattr(mesh, name).foreach_set("select", is_selected)
    mesh.polygons.foreach_set("select", wanted)
    mesh.update()


def colour(mesh: bpy.types.Mesh, rgba: np.ndarray | None) -> None:
    """Colour each point, (n, 4), linear and from 0 to 1; None takes the colours away."""
    if rgba is None:
        held = mesh.attributes.get(COLOUR)
        if held is not None:
            mesh.attributes.remove(held)
        mesh.update()
        return
    given = np.ascontiguousarray(rgba, np.float32)
    if given.shape != (len(mesh.vertices), 4):
        raise ValueError(f"{mesh.name}: colours are ({len(mesh.vertices)}, 4), got {given.shape}")
    held = _attribute(mesh, COLOUR, "FLOAT_COLOR", "POINT")
    if len(given):
        held.data.foreach_set("color", given.reshape(-1))
    mesh.color_attributes.active_color_name = COLOUR
    mesh.color_attributes.render_color_index = mesh.color_attributes.find(COLOUR)
    mesh.update()


@contextmanager
def settled(mesh: bpy.types.Mesh) -> Iterator[bpy.types.Mesh]:
    """The mesh, or what it is in edit mode just now, as a mesh for a moment."""
    if not mesh.is_editmode:
        yield mesh
        return
    moment = bpy.data.meshes.new(mesh.name)
    try:
        bmesh.from_edit_mesh(mesh).to_mesh(moment)
        for key in (NAMES, LEFT_OUT):
            if key in mesh:
                moment[key] = mesh[key]
        for material in mesh.materials:
            moment.materials.append(material)
        yield moment
    finally:
        bpy.data.meshes.remove(moment)


def _doubles(mesh: bpy.types.Mesh, name: str) -> np.ndarray:
    bits = np.empty(2 * len(mesh.vertices), np.int32)
    mesh.attributes[name].data.foreach_get("value", bits)
    return bits.view(np.float64)


def _fill(
    mesh: bpy.types.Mesh,
    points: np.ndarray,
    faces: np.ndarray | None,
    lines: np.ndarray | None,
) -> None:
    """Points and what joins them, into an empty mesh."""
    mesh.vertices.add(len(points))
    if lines is not None and len(lines):
        mesh.edges.add(len(lines))
        pairs = np.ascontiguousarray(lines, np.int32).reshape(-1)
        mesh.attributes[".edge_verts"].data.foreach_set("value", pairs)
    if faces is not None and len(faces):
        corners, starts = _loops(np.asarray(faces)[_kept(faces)])
        mesh.loops.add(len(corners))
        mesh.polygons.add(len(starts))
        mesh.attributes[".corner_vert"].data.foreach_set("value", corners)
        mesh.polygons.foreach_set("loop_start", starts)
        mesh[LEFT_OUT] = len(faces) - len(starts)
        mesh.update(calc_edges=True)
    set_points(mesh, points)


def _is_triangle(faces: np.ndarray) -> np.ndarray:
    if faces.shape[1] == 3:
        return np.ones(len(faces), bool)
    return (faces[:, 3] < 0) | (faces[:, 3] == faces[:, 2])


def _kept(faces: np.ndarray) -> np.ndarray:
    """Which faces Blender can take: those whose corners are all different."""
    given = np.asarray(faces)
    a, b, c = given[:, :3].T
    is_whole = (a != b) & (b != c) & (c != a)
    if given.shape[1] == 4:
        d = given[:, 3]
        is_whole &= _is_triangle(given) | ((d != a) & (d != b))
    return is_whole


def _loops(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners one after the other, and where each face begins."""
    if faces.shape[1] == 3:
        corners = np.ascontiguousarray(faces, np.int32).reshape(-1)
        return corners, np.arange(0, len(corners), 3, dtype=np.int32)
    sizes = np.where(_is_triangle(faces), 3, 4)
    is_corner = np.arange(faces.shape[1]) < sizes[:, None]
    corners = np.ascontiguousarray(faces[is_corner], np.int32)
    return corners, np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int32)


def _set_components(
    mesh: bpy.types.Mesh,
    is_kept: np.ndarray,
    tags: np.ndarray | None,
    components: Sequence[str],
) -> None:
    names = list(components) or [mesh.name]
    numbers = np.zeros(len(is_kept), np.int32) if tags is None else np.asarray(tags, np.int32)
    numbers = np.ascontiguousarray(numbers[is_kept])
    mesh[NAMES] = json.dumps(names)
    mesh.materials.clear()
    for name in names:
        mesh.materials.append(_material(name))
    if len(numbers):
        _attribute(mesh, COMPONENT, "INT", "FACE").data.foreach_set("value", numbers)
        _attribute(mesh, "material_index", "INT", "FACE").data.foreach_set("value", numbers)
    mesh.update()


def _material(name: str) -> bpy.types.Material:
    """The material that stands for a component, with a colour of its own."""
    ours = [one for one in bpy.data.materials if NAMES in one]
    for one in ours:
        if one[NAMES] == name:
            return one
    found = bpy.data.materials.new(name)
    found[NAMES] = name
    hue = (0.58 + 0.618034 * len(ours)) % 1.0  # the golden section never comes near itself
    found.diffuse_color = (*colorsys.hsv_to_rgb(hue, 0.35, 0.75), 1.0)
    return found


def _parts(mesh: bpy.types.Mesh) -> tuple[list[str], np.ndarray]:
    """Components' names and each face's number.

    What a face is painted with counts: joined objects and newly assigned materials say it so.
    """
    count = len(mesh.polygons)
    held, slots = mesh.attributes.get(COMPONENT), np.zeros(count, np.int32)
    index = mesh.attributes.get("material_index")
    if index is not None and count:
        index.data.foreach_get("value", slots)
    painted = [one and one.get(NAMES) for one in mesh.materials]
    if NAMES not in mesh or held is None or held.data_type != "INT":
        names = [one.name if one else str(i + 1) for i, one in enumerate(mesh.materials)]
        is_plain = len(names) < 2 and not any(painted)
        if is_plain:
            return json.loads(mesh.get(NAMES, "[]")), np.zeros(count, np.int32)
        names = [known or name for known, name in zip(painted, names, strict=True)]
        return names, np.clip(slots, 0, len(names) - 1)
    names = list(json.loads(mesh[NAMES]))
    numbers = np.zeros(count, np.int32)
    if count:
        held.data.foreach_get("value", numbers)
    for slot, name in enumerate(painted):
        if name is not None:
            names += [] if name in names else [name]
            numbers[slots == slot] = names.index(name)
    return names, np.clip(numbers, 0, len(names) - 1)


def _set_data(mesh: bpy.types.Mesh, name: str, values: np.ndarray) -> None:
    given = np.ascontiguousarray(values, np.float32)
    kind, field = ("FLOAT", "value") if given.ndim == 1 else ("FLOAT_VECTOR", "vector")
    if len(given):
        _attribute(mesh, name, kind, "POINT").data.foreach_set(field, given.reshape(-1))


def _attribute(mesh: bpy.types.Mesh, name: str, kind: str, domain: str) -> Any:
    held = mesh.attributes.get(name)
    if held is not None and (held.data_type, held.domain) != (kind, domain):
        mesh.attributes.remove(held)
        held = None
    return held or mesh.attributes.new(name, kind, domain)


def _corners_of(mesh: bpy.types.Mesh, attribute: str = ".corner_vert") -> np.ndarray:
    found = np.empty(len(mesh.loops), np.int32)
    if len(found):
        mesh.attributes[attribute].data.foreach_get("value", found)
    return found


def _polygons_of(mesh: bpy.types.Mesh) -> np.ndarray:
    """The face that each triangle is cut from."""
    found = np.empty(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("polygon_index", found)
    return found


def _move_edited(mesh: bpy.types.Mesh, floats: np.ndarray) -> None:
    own = bmesh.from_edit_mesh(mesh)
    if len(own.verts) != len(floats):
        raise ValueError(f"{mesh.name}: {len(own.verts)} points, {len(floats)} were given")
    for vertex, place in zip(own.verts, floats.tolist(), strict=True):
        vertex.co = place
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
