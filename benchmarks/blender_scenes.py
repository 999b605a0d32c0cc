"""Blender's own modifiers on given points: runs inside Blender's environment, on requests.

usage: .venv-blender/bin/python benchmarks/blender_scenes.py     (started by blender_process.py)

Each line read is a request, a JSON object, and each is answered by a line. `{"open": "IN.npz"}`
makes a scene in place of the last one and binds; `{"deform": "OUT.npz", "repeats": 30}` changes a
control so often and evaluates the mesh, then writes `deformed` (n, 3), `seconds` by the clock of
each evaluation, from the change to the evaluated mesh, and `processor_seconds`, the sum over
Blender's threads, which is larger where it found a second core free. An answer `{"error": ...}`
says what is wrong. For one core, put `taskset -c 0` before the command.

IN holds `points` (n, 3), and all places are in space. Of a lattice: `lattice_rest` and
`lattice_moves` (nu, nv, nw, 3), `lattice_edges` (3, 3), and `lattice_interpolation` if it is not
KEY_BSPLINE. Of a cage: `cage_rest` and `cage_moved` (m, 3), `cage_faces` (t, 3), `cage_precision`.
Of bones, parents first, which move the lattice where there is one, else the points: `bone_heads`,
`bone_tails`, `bone_ups` (b, 3), `bone_parents` (b,), `bone_radii` (b, 2), `bone_distances` and
`bone_strengths` (b,); along the bones' own axes `bone_turns` (b, 4), `bone_shifts` and
`bone_scales` (b, 3); `bone_preserve` for dual quaternions, and where the weights are not by
envelopes `bone_weights`, a row for each point, or each of the lattice as in `lattice_rest`.

This file imports bpy (GPL-3.0-or-later). moldline never imports it: it runs it as a process of its
own and exchanges files with it.
"""

import json
import os
import sys
import time
from collections.abc import Callable, Mapping

import bpy
import mathutils
import numpy as np

Given = Mapping[str, np.ndarray]


class Refused(Exception):
    """A request that cannot be fulfilled."""


class Scene:
    """Points and what deforms them."""

    def __init__(self, given: Given):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.body = _mesh("points", given["points"])
        self.told: dict[str, object] = {"version": bpy.app.version_string}
        self.touch: Callable[[float], None] = lambda offset: self.body.data.update_tag()
        target = self.body
        if "lattice_rest" in given:
            target = _lattice(given)
            self.body.modifiers.new("lattice", "LATTICE").object = target
            self.touch = _toucher(target.data.points[0].co_deform, target.data.update_tag)
        if "cage_rest" in given:
            cage = _mesh("cage", given["cage_rest"], given["cage_faces"])
            self.told |= _bound(self.body, cage, int(given["cage_precision"]))
            _put(cage.data, given["cage_moved"])
            self.touch = _toucher(cage.data.vertices[0].co, cage.data.update)
        if "bone_heads" in given:
            _rig(target, given)

    def deformed(self, repeats: int) -> dict[str, np.ndarray]:
        """The points, and how long each evaluation took."""
        times = []
        for left in range(repeats, -1, -1):  # the last one puts the control where it belongs
            clock, processor = time.perf_counter(), time.process_time()
            self.touch(1e-3 * left)
            _evaluated(self.body)
            times.append((time.perf_counter() - clock, time.process_time() - processor))
        wall, processor = np.array(times[1:]).T  # the first one also builds the graph
        points = _coordinates(_evaluated(self.body))
        return {"deformed": points, "seconds": wall, "processor_seconds": processor}


def main() -> None:
    """Answer requests until there are no more."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what Blender prints is not an answer
    scene = None
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if "open" in request:
                with np.load(request["open"]) as given:
                    scene = Scene(dict(given))
                answer = scene.told
            elif scene is None:
                raise Refused("no scene is open")
            else:
                np.savez(request["deform"], **scene.deformed(request["repeats"]))
                answer = {}
        except (Refused, RuntimeError, KeyError, ValueError) as error:
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


def _linked(name: str, data: bpy.types.ID) -> bpy.types.Object:
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    return made


def _mesh(name: str, points: np.ndarray, faces: np.ndarray | None = None) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    if faces is not None:
        mesh.from_pydata(points.tolist(), [], faces.tolist())
    else:
        mesh.vertices.add(len(points))
        _put(mesh, points)
    return _linked(name, mesh)


def _put(mesh: bpy.types.Mesh, points: np.ndarray) -> None:
    mesh.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    mesh.update()


def _lattice(given: Given) -> bpy.types.Object:
    """A lattice whose control points lie where they should, by the object's matrix."""
    rest = given["lattice_rest"]
    lattice = bpy.data.lattices.new("lattice")
    made = _linked("lattice", lattice)  # before the counts are set: keeps size 1
    lattice.points_u, lattice.points_v, lattice.points_w = rest.shape[:3]
    for axis in "uvw":
        kind = str(given.get("lattice_interpolation", "KEY_BSPLINE"))
        setattr(lattice, f"interpolation_type_{axis}", kind)
    own = np.empty(3 * len(lattice.points), np.float32)
    lattice.points.foreach_get("co", own)
    own = own.reshape(-1, 3).astype(float)
    span = np.ptp(own, axis=0)
    linear = (given["lattice_edges"] / np.where(span > 0, span, 1)[:, None]).T
    rest, moves = (_first_runs_fastest(x) for x in (rest, given["lattice_moves"]))
    origin = rest[0] - linear @ own[0]
    gap = np.abs(own @ linear.T + origin - rest).max()
    if gap > 1e-5 * np.abs(rest).max():
        raise Refused(
            f"control points must rest evenly spaced in a box, one is {gap:.3g} away from there"
        )
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, origin
    # a parent's inverse may be any matrix, an object's own place none that shears
    made.parent = _linked("place", None)
    made.matrix_parent_inverse = mathutils.Matrix(matrix)
    moved = own + moves @ np.linalg.inv(linear).T
    lattice.points.foreach_set("co_deform", moved.astype(np.float32).ravel())
    return made


def _first_runs_fastest(grid: np.ndarray) -> np.ndarray:
    return grid.transpose(2, 1, 0, 3).reshape(-1, grid.shape[3])


def _bound(body: bpy.types.Object, cage: bpy.types.Object, precision: int) -> dict[str, object]:
    """Whether Blender says that it has bound the body, and the seconds that it took."""
    modifier = body.modifiers.new("cage", "MESH_DEFORM")
    modifier.object, modifier.precision = cage, precision
    bpy.context.view_layer.objects.active = body
    _evaluated(body)
    clock, processor = time.perf_counter(), time.process_time()
    bpy.ops.object.meshdeform_bind(modifier=modifier.name)
    _evaluated(body)
    return {
        "is_bound": modifier.is_bound,
        "bind": time.perf_counter() - clock,
        "bind_processor": time.process_time() - processor,
    }


def _rig(target: bpy.types.Object, given: Given) -> None:
    """Bones that move an object."""
    rig = _linked("rig", bpy.data.armatures.new("rig"))
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    made = []
    for i, parent in enumerate(given["bone_parents"]):
        bone = rig.data.edit_bones.new(f"{i}")
        made.append(bone)
        bone.head, bone.tail = given["bone_heads"][i], given["bone_tails"][i]
        bone.align_roll(given["bone_ups"][i])
        bone.head_radius, bone.tail_radius = given["bone_radii"][i]
        bone.envelope_distance = given["bone_distances"][i]
        bone.envelope_weight = given["bone_strengths"][i]
        bone.inherit_scale = "NONE"
        if parent >= 0:  # parents come first
            bone.parent = made[parent]
    bpy.ops.object.mode_set(mode="OBJECT")
    for i, bone in enumerate(rig.pose.bones):
        bone.rotation_mode = "QUATERNION"
        bone.rotation_quaternion = given["bone_turns"][i]
        bone.location, bone.scale = given["bone_shifts"][i], given["bone_scales"][i]
    modifier = target.modifiers.new("rig", "ARMATURE")
    modifier.object = rig
    modifier.use_deform_preserve_volume = bool(given["bone_preserve"])
    modifier.use_vertex_groups = "bone_weights" in given
    modifier.use_bone_envelopes = "bone_weights" not in given
    for i, weights in enumerate(_in_order(given).T):
        group = target.vertex_groups.new(name=f"{i}")
        for point, weight in enumerate(weights):
            group.add([point], weight, "REPLACE")


def _in_order(given: Given) -> np.ndarray:
    """Weights by hand, in the order in which Blender has the points."""
    weights = given.get("bone_weights", np.empty((0, 0)))
    if "lattice_rest" not in given or not weights.size:
        return weights
    grid = weights.reshape(*given["lattice_rest"].shape[:3], -1)
    return _first_runs_fastest(grid)


def _toucher(place: mathutils.Vector, update: Callable[[], None]) -> Callable[[float], None]:
    target = place.x

    def touch(offset: float) -> None:
        place.x = target + offset
        update()

    return touch


def _evaluated(body: bpy.types.Object) -> bpy.types.Mesh:
    return body.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def _coordinates(mesh: bpy.types.Mesh) -> np.ndarray:
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", points)
    return points.reshape(-1, 3)


if __name__ == "__main__":
    main()
