"""Blender's lattice modifier on given points: runs inside Blender's own environment.

usage: .venv-blender/bin/python benchmarks/blender_lattice.py IN.npz OUT.npz [--repeat 30]

IN holds `points` (n, 3), `shape` (nu, nv, nw), and `rest` and `moved` (nu nv nw, 3) in space, in
Blender's order (the first index runs fastest), at rest evenly spaced in a box along the axes of
space; `interpolation` too if it is not KEY_BSPLINE. OUT gets `deformed` (n, 3); `seconds` by the
clock of each evaluation, from the change of a control to the evaluated mesh; `processor_seconds`,
the sum over Blender's threads, which is larger where it found a second core free; and `version`.
Blender takes all cores that the process may use: for one, put `taskset -c 0` before the command.

This file imports bpy (GPL-3.0-or-later). moldline never imports it: it runs it as a process of its
own and exchanges files with it.
"""

import argparse
import time

import bpy
import numpy as np


def main() -> None:
    """Deform and time."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("given", metavar="IN.npz")
    parser.add_argument("result", metavar="OUT.npz")
    parser.add_argument("--repeat", type=int, default=30, help="evaluations to time")
    asked = parser.parse_args()
    data = np.load(asked.given)
    kind = str(data.get("interpolation", "KEY_BSPLINE"))
    cage = _cage(data["rest"], data["shape"], kind)
    body = _body(data["points"])
    body.modifiers.new("lattice", "LATTICE").object = cage
    _move(cage, data["moved"] - data["rest"])
    times = _timed(body, cage, asked.repeat)
    np.savez(
        asked.result,
        deformed=_coordinates(_evaluated(body)),
        seconds=times[:, 0],
        processor_seconds=times[:, 1],
        version=bpy.app.version_string,
    )


def _body(points: np.ndarray) -> bpy.types.Object:
    mesh = bpy.data.meshes.new("points")
    mesh.vertices.add(len(points))
    mesh.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    body = bpy.data.objects.new("points", mesh)
    bpy.context.scene.collection.objects.link(body)
    return body


def _cage(rest: np.ndarray, shape: np.ndarray, interpolation: str) -> bpy.types.Object:
    """A lattice whose control points lie where they should, by the object's place and scale."""
    lattice = bpy.data.lattices.new("lattice")
    cage = bpy.data.objects.new("lattice", lattice)  # before the counts are set: keeps size 1
    bpy.context.scene.collection.objects.link(cage)
    lattice.points_u, lattice.points_v, lattice.points_w = map(int, shape)
    for axis in "uvw":
        setattr(lattice, f"interpolation_type_{axis}", interpolation)
    own = _rest(lattice)
    span = np.ptp(own, axis=0)
    cage.scale = np.where(span > 0, np.ptp(rest, axis=0) / np.where(span > 0, span, 1), 1)
    cage.location = rest[0] - own[0] * np.array(cage.scale)
    gap = np.abs(np.array(cage.location) + own * np.array(cage.scale) - rest).max()
    if gap > 1e-5 * np.abs(rest).max():
        raise SystemExit(
            f"control points must rest evenly spaced in a box along the axes of space, "
            f"one is {gap:.3g} away from there"
        )
    return cage


def _move(cage: bpy.types.Object, moves: np.ndarray) -> None:
    """Displace the control points by vectors in space."""
    moved = _rest(cage.data) + moves / np.array(cage.scale)
    cage.data.points.foreach_set("co_deform", moved.astype(np.float32).ravel())


def _rest(lattice: bpy.types.Lattice) -> np.ndarray:
    own = np.empty(3 * len(lattice.points), np.float32)
    lattice.points.foreach_get("co", own)
    return own.reshape(-1, 3)


def _timed(body: bpy.types.Object, cage: bpy.types.Object, repeats: int) -> np.ndarray:
    """Seconds by the clock and of the processor for each evaluation, (repeats, 2)."""
    point = cage.data.points[0]
    target = point.co_deform.x
    times = []
    for left in range(repeats, -1, -1):  # the last one puts the control where it belongs
        clock, processor = time.perf_counter(), time.process_time()
        point.co_deform.x = target + 1e-3 * left
        cage.data.update_tag()
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
