"""Blender's lattice modifier on given points: runs inside Blender's own environment.

usage: .venv-blender/bin/python benchmarks/blender_lattice.py IN.npz OUT.npz [REPEATS]

IN holds `points` (n, 3), `shape` (nu, nv, nw), `rest` and `moved` (nu nv nw, 3) in space, in
Blender's order (the first index runs fastest), the box along the axes of space. OUT gets
`deformed` (n, 3), `seconds` of each evaluation after a control has changed, and `version`.
This file imports bpy (GPL-3.0-or-later); moldline never imports it and only runs it as a process.
"""

import sys
import time

import bpy
import numpy as np


def main(given: str, result: str, repeats: int = 30) -> None:
    """Deform and time."""
    data = np.load(given)
    points, shape = data["points"], data["shape"]
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new("points")
    mesh.vertices.add(len(points))
    mesh.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    body = bpy.data.objects.new("points", mesh)
    scene.collection.objects.link(body)
    lattice, cage = _lattice(data["rest"], shape)
    scene.collection.objects.link(cage)
    modifier = body.modifiers.new("lattice", "LATTICE")
    modifier.object = cage
    moves = data["moved"] - data["rest"]
    own = np.empty(3 * len(moves), np.float32)
    lattice.points.foreach_get("co", own)
    bpy.context.view_layer.update()  # the matrix is stale until then
    inverse = np.linalg.inv(np.array(cage.matrix_world)[:3, :3])
    target = own + (moves @ inverse.T).astype(np.float32).ravel()
    lattice.points.foreach_set("co_deform", target)
    seconds = []
    for _ in range(repeats + 1):
        lattice.points[0].co_deform.x = float(target[0])
        cage.update_tag()
        lattice.update_tag()
        start = time.perf_counter()
        bpy.context.view_layer.update()
        evaluated = body.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        seconds.append(time.perf_counter() - start)
    deformed = np.empty(3 * len(points), np.float32)
    evaluated.attributes["position"].data.foreach_get("vector", deformed)
    np.savez(
        result,
        deformed=deformed.reshape(-1, 3),
        seconds=np.array(seconds[1:]),
        version=bpy.app.version_string,
    )


def _lattice(rest: np.ndarray, shape: np.ndarray) -> tuple[object, object]:
    """A lattice whose control points lie where they should, by the object's place and scale."""
    lattice = bpy.data.lattices.new("lattice")
    cage = bpy.data.objects.new("lattice", lattice)  # used before its counts are set: keeps size 1
    lattice.points_u, lattice.points_v, lattice.points_w = map(int, shape)
    for axis in "uvw":
        setattr(lattice, f"interpolation_type_{axis}", "KEY_BSPLINE")
    own = np.empty(3 * len(lattice.points), np.float32)
    lattice.points.foreach_get("co", own)
    own = own.reshape(-1, 3)
    span, wanted = np.ptp(own, axis=0), np.ptp(rest, axis=0)
    scale = np.where(span > 0, wanted / np.where(span > 0, span, 1), 1.0)
    cage.scale = scale
    cage.location = rest[0] - own[0] * scale
    return lattice, cage


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], *map(int, sys.argv[3:]))
