# SPDX-License-Identifier: GPL-3.0-or-later
"""What a hand takes hold of: control points and pilots as meshes, skeletons as armatures.

A handle keeps, beside what Blender has of it, where moldline put it in double precision and what
was written into Blender for that. What differs from it was moved by a hand; this holds after undo
and in a file that was opened again.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector

COLLECTION = "Moldline"
MOVED, WRITTEN, PLACE, FROZEN = (
    "moldline_moved", "moldline_written", "moldline_place", "moldline_frozen",
)  # fmt: skip
"""Properties of a handle: places in the case's space, coordinates or poses, matrix, frozen ones."""


class MoldlineHandle(bpy.types.PropertyGroup):
    """What an object is a handle of; `role` is empty where it is none."""

    role: bpy.props.StringProperty(description="net, bones or marks")
    stage: bpy.props.IntProperty(description="Number of the stage in the case, from 0", default=-1)
    on: bpy.props.StringProperty(description="The geometry that the stage acts on")
    labels: bpy.props.StringProperty(description="A name for each point or bone, as JSON")


def all_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The scene's handles, by stage."""
    found = [one for one in scene.objects if one.moldline.role and _is_whole(one)]
    return sorted(found, key=lambda one: (one.moldline.stage, one.name))


def broken(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Those that have not the points or bones that they were made with."""
    return [one for one in scene.objects if one.moldline.role and not _is_whole(one)]


def of_stage(scene: bpy.types.Scene, stage: int) -> bpy.types.Object | None:
    """The handle of a stage, if it is there."""
    return next((one for one in all_of(scene) if one.moldline.stage == stage), None)


def labels(obj: bpy.types.Object) -> list[str]:
    """A name for each of its points or bones."""
    return json.loads(obj.moldline.labels or "[]")


def renumber(scene: bpy.types.Scene, new: Callable[[int], int]) -> dict[str, int]:
    """Give handles other stages, since stages come or go; those that they had, by name."""
    before = {one.name: one.moldline.stage for one in all_of(scene)}
    number({name: new(stage) for name, stage in before.items()})
    return before


def number(stages: Mapping[str, int]) -> None:
    """Give handles stages, by their names."""
    for name, stage in stages.items():
        if name in bpy.data.objects:
            bpy.data.objects[name].moldline.stage = stage


def rebuild(scene: bpy.types.Scene, surface: bpy.types.Object, found: Sequence[Any]) -> None:
    """Make the scene's handles those that a case has.

    Such as fit are kept, and what a hand has moved stays moved.
    """
    left = [one for one in scene.objects if one.moldline.role]
    for handle in found:
        fits = [one for one in left if _fits(one, handle)]
        if fits:
            left.remove(fits[0])
            _describe(fits[0], handle, surface)
            if not state(fits[0])[1].any():
                write(fits[0], handle.moved)
        else:
            create(scene, surface, handle)
    for one in left:
        _remove(one)


def create(
    scene: bpy.types.Scene, surface: bpy.types.Object | None, handle: Any
) -> bpy.types.Object:
    """A handle as an object, in the collection Moldline; it goes along with the surface."""
    name = (handle.name or handle.deformer).replace("_", " ")
    if handle.kind == "bones":
        obj = _armature(scene, name, handle)
    else:
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(np.asarray(handle.moved).tolist(), np.asarray(handle.lines).tolist(), ())
        mesh.vertices.foreach_set("hide", np.asarray(handle.frozen, bool))
        obj = bpy.data.objects.new(name, mesh)
        _collection(scene).objects.link(obj)
    obj.show_in_front = True
    _describe(obj, handle, surface)
    write(obj, handle.moved)
    return obj


def remove_all(scene: bpy.types.Scene) -> None:
    """Take all handles away."""
    for one in [one for one in scene.objects if one.moldline.role]:
        _remove(one)


def read(obj: bpy.types.Object) -> np.ndarray | None:
    """Where a handle's points are, (k, 3), or its bones' marks, (b, 3, 3), in the case's space.

    None where it has not the points that it was made with.
    """
    found = state(obj)
    return None if found is None else found[0]


def state(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray] | None:
    """Where a handle's points or bones are, and which of them a hand has moved.

    Those that were not moved have the doubles that moldline gave them.
    """
    shape = (-1, 3, 3) if obj.moldline.role == "bones" else (-1, 3)
    known = np.array(obj[MOVED]).reshape(shape)
    local, place, before = own(obj), placed(obj), np.array(obj[PLACE]).reshape(4, 4)
    if local is None:
        return None
    written = np.array(obj[WRITTEN]).reshape(local.shape)
    rows = (local != written).reshape(len(local), -1).any(axis=1)
    moved = known.copy()
    if not np.array_equal(place, before):
        moved = _apply(place @ _inverse(before), known)
        rows[:] = True
    elif not rows.any():
        return moved, rows
    is_own = np.array_equal(place, np.eye(4)) and np.array_equal(place, before)
    for i in np.flatnonzero(rows):
        if obj.moldline.role == "bones":
            rest = _rest(obj)[i]
            pose, old = rest @ local[i], rest @ written[i]
            moved[i] = _apply(place @ pose @ _inverse(old) @ _inverse(before), known[i])
        elif (local[i] != written[i]).any():
            moved[i] = _apply(place, local[i])
            if is_own:  # a coordinate that was not touched stays to the bit
                moved[i] = np.where(local[i] == written[i], known[i], moved[i])
    return moved, rows & ~np.array(obj[FROZEN], bool)


def write(obj: bpy.types.Object, moved: np.ndarray) -> None:
    """Put a handle's points or bones somewhere; a hand's motion is forgotten."""
    place = placed(obj)
    local = _apply(_inverse(place), np.asarray(moved, float))
    if obj.moldline.role == "bones":
        _pose(obj, local)
    else:
        _move(obj, local.astype(np.float32))
    obj[MOVED] = np.ravel(np.asarray(moved, float)).tolist()
    obj[PLACE] = place.ravel().tolist()
    now = own(obj)
    if now is not None:
        obj[WRITTEN] = now.ravel().tolist()


def push(obj: bpy.types.Object, moved: np.ndarray) -> int:
    """Move points as a hand does, so that the shape follows; how many are elsewhere now."""
    local = _apply(_inverse(placed(obj)), np.asarray(moved, float)).astype(np.float32)
    before = own(obj)
    _move(obj, local)
    return int((before != local).any(axis=1).sum())


def own(obj: bpy.types.Object) -> np.ndarray | None:
    """What Blender has: coordinates, (k, 3), or poses against rest, (b, 4, 4); None if others."""
    count = len(obj[FROZEN])
    if obj.moldline.role == "bones":
        found = np.array([bone.matrix_basis for bone in obj.pose.bones], float).reshape(-1, 4, 4)
    elif obj.mode == "EDIT":
        found = np.array([v.co[:] for v in bmesh.from_edit_mesh(obj.data).verts]).reshape(-1, 3)
    else:
        coordinates = np.empty((len(obj.data.vertices), 3), np.float32)
        if len(coordinates):
            obj.data.attributes["position"].data.foreach_get("vector", coordinates.reshape(-1))
        found = coordinates.astype(float)
    return found if len(found) == count else None


def placed(obj: bpy.types.Object) -> np.ndarray:
    """From a handle's own coordinates to those of the case, which are the surface's."""
    if obj.parent is not None and not obj.constraints:
        found = obj.matrix_parent_inverse @ obj.matrix_basis  # known before Blender evaluates it
    else:
        found = obj.matrix_world
    return np.array(found, float)


def restore(obj: bpy.types.Object) -> None:
    """Put a handle back where moldline has it, also one that was moved as an object."""
    obj.matrix_basis = Matrix.Identity(4)
    obj.matrix_parent_inverse = Matrix.Identity(4)
    shape = (-1, 3, 3) if obj.moldline.role == "bones" else (-1, 3)
    write(obj, np.array(obj[MOVED]).reshape(shape))


def _fits(obj: bpy.types.Object, handle: Any) -> bool:
    """Whether an object can be the handle."""
    has_same = (obj.moldline.role, obj.moldline.stage) == (handle.kind, handle.stage)
    if not has_same or not _is_whole(obj) or json.loads(obj.moldline.labels) != handle.labels:
        return False
    return handle.kind == "bones" or len(obj.data.edges) == len(handle.lines)


def _is_whole(obj: bpy.types.Object) -> bool:
    kind = "ARMATURE" if obj.moldline.role == "bones" else "MESH"
    if obj.type != kind or FROZEN not in obj:
        return False
    if kind == "ARMATURE":
        return len(obj.pose.bones) == len(obj[FROZEN])
    has = bmesh.from_edit_mesh(obj.data).verts if obj.mode == "EDIT" else obj.data.vertices
    return len(has) == len(obj[FROZEN])


def _describe(obj: bpy.types.Object, handle: Any, surface: bpy.types.Object | None) -> None:
    told = obj.moldline
    told.role, told.stage, told.on = handle.kind, handle.stage, handle.on
    told.labels = json.dumps(list(handle.labels))
    obj[FROZEN] = [int(x) for x in handle.frozen]
    if obj.parent != surface:
        obj.parent = surface
        obj.matrix_parent_inverse = Matrix.Identity(4)


def _remove(obj: bpy.types.Object) -> None:
    data = obj.data
    if obj.mode != "OBJECT" and bpy.context.object == obj:
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.objects.remove(obj)
    if data is not None and not data.users:
        bpy.data.batch_remove([data])


def _collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    """Where handles are, in this scene."""
    for one in scene.collection.children_recursive:
        if one.name.split(".")[0] == COLLECTION:
            return one
    found = bpy.data.collections.new(COLLECTION)
    scene.collection.children.link(found)
    return found


def _move(obj: bpy.types.Object, local: np.ndarray) -> None:
    if obj.mode == "EDIT":
        edited = bmesh.from_edit_mesh(obj.data)
        if len(edited.verts) != len(local):
            return
        for vertex, place in zip(edited.verts, local.tolist(), strict=True):
            vertex.co = place
        bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)
    elif len(obj.data.vertices) == len(local):
        obj.data.attributes["position"].data.foreach_set("vector", local.reshape(-1))
        obj.data.update()


def _pose(obj: bpy.types.Object, marks: np.ndarray) -> None:
    """Give bones location, rotation and scale that put head, tail and side where marks are."""
    sizes = np.array(obj["moldline_sizes"]).reshape(-1, 2)
    for bone, rest, size, mark in zip(obj.pose.bones, _rest(obj), sizes, marks, strict=True):
        turned, lengths = _frame(mark)
        pose = np.eye(4)
        grown = lengths / size
        pose[:3, :3] = turned * np.array([grown[1], *grown])  # sections keep their proportions
        pose[:3, 3] = mark[0]
        bone.matrix_basis = Matrix(_inverse(rest) @ pose)


def _frame(marks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes of a bone by its head, tail and side, as columns; its length and its side's distance."""
    along, aside = marks[1] - marks[0], marks[2] - marks[0]
    length = float(np.linalg.norm(along))
    y = along / length if length else np.array([0.0, 1.0, 0.0])
    across = aside - (aside @ y) * y
    reach = float(np.linalg.norm(across))
    z = across / reach if reach else np.array(Vector(y).orthogonal().normalized())
    return np.stack([np.cross(y, z), y, z], axis=1), np.array([length or 1.0, reach or 1.0])


def _rest(obj: bpy.types.Object) -> np.ndarray:
    """Matrices of the bones at rest, (b, 4, 4)."""
    return np.array([bone.bone.matrix_local for bone in obj.pose.bones], float).reshape(-1, 4, 4)


def _armature(scene: bpy.types.Scene, name: str, handle: Any) -> bpy.types.Object:
    """An armature whose bones are a handle's marks at rest."""
    obj = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    _collection(scene).objects.link(obj)
    marks, sizes = np.asarray(handle.rest, float).reshape(-1, 3, 3), []
    with _edited(scene, obj):
        for label, mark in zip(handle.labels, marks, strict=True):
            axes, lengths = _frame(mark)
            bone = obj.data.edit_bones.new(label)
            bone.head, bone.tail = mark[0], mark[0] + axes[:, 1] * lengths[0]
            bone.align_roll(Vector(axes[:, 2]))
            sizes.append(lengths)
    obj["moldline_sizes"] = np.ravel(sizes).tolist()
    for bone, frozen in zip(obj.pose.bones, np.asarray(handle.frozen, bool), strict=True):
        bone.rotation_mode = "QUATERNION"
        bone.lock_location = bone.lock_rotation = bone.lock_scale = [bool(frozen)] * 3
    return obj


@contextmanager
def _edited(scene: bpy.types.Scene, obj: bpy.types.Object) -> Iterator[None]:
    """Edit mode of an object for a moment; what was active, and how, comes back."""
    layer = bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]
    for one in layer.layer_collection.children:
        if obj.name in one.collection.objects:
            one.exclude = False
    before = layer.objects.active
    mode = before.mode if before is not None else "OBJECT"
    windows = bpy.context.window_manager.windows
    override: dict[str, Any] = {} if bpy.context.window or not windows else {"window": windows[0]}
    with bpy.context.temp_override(scene=scene, view_layer=layer, **override):
        if mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        layer.objects.active = obj
        bpy.ops.object.mode_set(mode="EDIT")
        try:
            yield
        finally:
            bpy.ops.object.mode_set(mode="OBJECT")
            layer.objects.active = before
            if before is not None and mode != "OBJECT":
                bpy.ops.object.mode_set(mode=mode)


def _apply(matrix: np.ndarray, places: np.ndarray) -> np.ndarray:
    if np.array_equal(matrix, np.eye(4)):
        return np.array(places)  # to the bit
    return places @ matrix[:3, :3].T + matrix[:3, 3]


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Of an affine matrix; what a size of zero has lost stays lost."""
    found = np.eye(4)
    if np.array_equal(matrix, found):
        return found
    a, b, c = matrix[:3, :3]
    columns = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    volume = float(a @ columns[:, 0])
    is_flat = abs(volume) < 1e-30
    found[:3, :3] = np.linalg.pinv(matrix[:3, :3]) if is_flat else columns / volume
    found[:3, 3] = -found[:3, :3] @ matrix[:3, 3]
    return found


def register() -> None:
    """Let objects be handles."""
    bpy.utils.register_class(MoldlineHandle)
    bpy.types.Object.moldline = bpy.props.PointerProperty(type=MoldlineHandle)


def unregister() -> None:
    """Take it back."""
    del bpy.types.Object.moldline
    bpy.utils.unregister_class(MoldlineHandle)
