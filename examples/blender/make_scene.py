"""Make wing.blend: two of Blender's modifiers on an object that a wing is put into.

Run it by a Blender, or by a Python that has it as a module; FOLDER is where it goes:

    $(moldline blender where) examples/blender/make_scene.py examples/blender
    blender --background --python examples/blender/make_scene.py -- examples/blender

In the file you may add modifiers, or move what is there, by hand: the case file goes on as it is.
"""

import os
import sys
from pathlib import Path

import bpy

LOW, HIGH = (22.0, 0.0, 2.0), (49.0, 29.5, 7.5)
"""A box around the wing of examples/data/transport_wing.tri [m]."""


def main(folder: Path) -> None:
    """Write the file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("wing")
    mesh.from_pydata([LOW, (HIGH[0], *LOW[1:]), HIGH], [], [(0, 1, 2)])  # moldline replaces it
    wing = put("wing", mesh)
    lattice(wing)
    twist(wing)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder.absolute() / "wing.blend"))


def put(name, data):
    """An object in the scene."""
    body = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(body)
    return body


def lattice(wing) -> None:
    """Four rows of control points along the span; the outer ones are the group "tip"."""
    net = bpy.data.lattices.new("net")
    box = put("net", net)
    net.points_u, net.points_v, net.points_w = 2, 4, 2
    box.location = [(a + b) / 2 for a, b in zip(LOW, HIGH, strict=True)]
    box.scale = [b - a for a, b in zip(LOW, HIGH, strict=True)]
    tip = box.vertex_groups.new(name="tip")
    for k in range(len(net.points)):
        row = k // 2 % 4  # Blender's first index runs fastest
        if row >= 2:
            tip.add([k], (0.25, 1.0)[row - 2], "REPLACE")
    wing.modifiers.new("Lattice", "LATTICE").object = box


def twist(wing) -> None:
    """Turn sections about a line along y, more and more towards the tip."""
    axis = put("axis", None)
    axis.location = (38.0, 0.0, 4.0)
    made = wing.modifiers.new("Twist", "SIMPLE_DEFORM")
    made.deform_method, made.deform_axis, made.origin = "TWIST", "Y", axis
    made.angle = 0.0


if __name__ == "__main__":
    main(Path(sys.argv[-1]))
    sys.stdout.flush()
    os._exit(0)  # as a module, Blender may hang while the interpreter cleans up
