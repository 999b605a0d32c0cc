"""Blender's Mesh Deform modifier on given points: runs inside Blender's own environment.

usage: .venv-blender/bin/python benchmarks/blender_cage.py IN.npz OUT.npz [--repeat 30]

IN holds `points` (n, 3), the cage's `rest` and `moved` (m, 3) and `faces` (t, 3), and `precision`.
OUT gets `deformed` (n, 3); `bind` [s]; `seconds` by the clock of each evaluation, from the change
of a cage's vertex to the evaluated mesh; `processor_seconds`, the sum over Blender's threads; and
`version`. Blender takes all cores that the process may use: for one, put `taskset -c 0` before.

This file imports bpy (GPL-3.0-or-later). moldline never imports it: it runs it as a process of its
own and exchanges files with it.
"""

import argparse
import time

import bpy
import numpy as np


def main() -> None:
    """Bind, deform and time."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("given", metavar="IN.npz")
    parser.add_argument("result", metavar="OUT.npz")
    parser.add_argument("--repeat", type=int, default=30, help="evaluations to time")
    asked = parser.parse_args()
    data = np.load(asked.given)
    cage = _object("cage", data["rest"], data["faces"])
    body = _object("points", data["points"], np.empty((0, 3), int))
    bind = _bound(body, cage, int(data["precision"]))
    _put(cage.data, data["moved"])
    times = _timed(body, cage, asked.repeat)
    np.savez(
        asked.result,
        deformed=_coordinates(_evaluated(body)),
        bind=bind,
        seconds=times[:, 0],
        processor_seconds=times[:, 1],
        version=bpy.app.version_string,
    )


def _object(name: str, points: np.ndarray, faces: np.ndarray) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    if len(faces):
        mesh.from_pydata(points.tolist(), [], faces.tolist())
    else:
        mesh.vertices.add(len(points))
        _put(mesh, points)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)
    return made


def _bound(body: bpy.types.Object, cage: bpy.types.Object, precision: int) -> float:
    """Seconds by the clock of the bind."""
    modifier = body.modifiers.new("cage", "MESH_DEFORM")
    modifier.object, modifier.precision = cage, precision
    bpy.context.view_layer.objects.active = body
    _evaluated(body)
    start = time.perf_counter()
    bpy.ops.object.meshdeform_bind(modifier=modifier.name)
    _evaluated(body)
    bind = time.perf_counter() - start
    if not modifier.is_bound:
        raise SystemExit("Blender did not bind the points to the cage")
    return bind


def _put(mesh: bpy.types.Mesh, points: np.ndarray) -> None:
    mesh.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    mesh.update()


def _timed(body: bpy.types.Object, cage: bpy.types.Object, repeats: int) -> np.ndarray:
    """Seconds by the clock and of the processor for each evaluation, (repeats, 2)."""
    vertex = cage.data.vertices[0]
    target = vertex.co.x
    times = []
    for left in range(repeats, -1, -1):  # the last one puts the vertex where it belongs
        clock, processor = time.perf_counter(), time.process_time()
        vertex.co.x = target + 1e-3 * left
        cage.data.update()
        _evaluated(body)
        times.append((time.perf_counter() - clock, time.process_time() - processor))
    return np.array(times[1:])  # the first one also builds the graph


def _evaluated(body: bpy.types.Object) -> bpy.types.Mesh:
    return body.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def _coordinates(mesh: bpy.types.Mesh) -> np.ndarray:
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", points)
    return points.reshape(-1, 3)


if __name__ == "__main__":
    main()
