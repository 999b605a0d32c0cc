"""Small scenes for tests: run by a Python that has bpy, writes one .blend each into a folder.

usage: PYTHON blender_scenes.py FOLDER
"""

import os
import sys
from pathlib import Path

import bpy
import numpy as np


def main(folder: Path) -> None:
    """Write all scenes."""
    for scene in (lattice, keys, twist, nodes, arm, decimate, cage, driven, curve, wrap):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene()
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{scene.__name__}.blend"))


def put(name, data):
    body = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(body)
    return body


def mesh(name, points, faces):
    made = bpy.data.meshes.new(name)
    made.from_pydata(np.asarray(points, float).tolist(), [], [list(map(int, f)) for f in faces])
    return put(name, made)


def box(name, size=1.0):
    """A cube of six quads, from the origin or around it."""
    points = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return mesh(name, size * np.array(points), faces)


def column():
    """A square column from z = 0 to 1, of quads."""
    ring = [(0.2, 0.1), (-0.1, 0.2), (-0.2, -0.1), (0.1, -0.2)]
    points = [(x, y, z) for z in np.linspace(0, 1, 6) for x, y in ring]
    faces = [
        (4 * i + j, 4 * i + (j + 1) % 4, 4 * i + 4 + (j + 1) % 4, 4 * i + 4 + j)
        for i in range(5)
        for j in range(4)
    ]
    return mesh("wing", points, faces)


def lattice():
    """A box in a lattice of 4 x 3 x 2 points, which is turned, moved and stretched."""
    body = box("wing", 0.8)
    net = bpy.data.lattices.new("net")
    cage = put("net", net)
    net.points_u, net.points_v, net.points_w = 4, 3, 2
    cage.scale, cage.location = (2.0, 2.2, 2.4), (0.1, -0.05, 0.0)
    cage.rotation_euler = (0.0, 0.0, 0.3)
    body.modifiers.new("Lattice", "LATTICE").object = cage
    group = cage.vertex_groups.new(name="tip")
    group.add([3, 7, 11], 1.0, "REPLACE")
    group.add([2], 0.5, "REPLACE")
    cage.hide_viewport = body.hide_viewport = True


def keys():
    """Shape keys, and a second material."""
    body = column()
    body.shape_key_add(name="Basis")
    swell = body.shape_key_add(name="Swell")
    swell.value = 0.0
    for k, point in enumerate(swell.data):
        point.co.x += 0.1 * k
    for name in ("skin", "glass"):
        body.data.materials.append(bpy.data.materials.new(name))
    body.data.polygons[3].material_index = 1


def twist():
    """A Simple Deform modifier."""
    body = column()
    made = body.modifiers.new("Twist", "SIMPLE_DEFORM")
    made.deform_method, made.deform_axis, made.angle = "TWIST", "Z", 0.5


def nodes():
    """Subdivision, then geometry nodes that move every point by Size times where it is."""
    body = box("wing")
    body.modifiers.new("Subdivision", "SUBSURF").levels = 1
    tree = bpy.data.node_groups.new("Grow", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    size = tree.interface.new_socket("Size", in_out="INPUT", socket_type="NodeSocketFloat")
    size.default_value = 0.25
    tree.interface.new_socket("Count", in_out="INPUT", socket_type="NodeSocketInt")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    place = tree.nodes.new("GeometryNodeInputPosition")
    scale = tree.nodes.new("ShaderNodeVectorMath")
    scale.operation = "SCALE"
    put_at = tree.nodes.new("GeometryNodeSetPosition")
    tree.links.new(start.outputs["Geometry"], put_at.inputs["Geometry"])
    tree.links.new(place.outputs[0], scale.inputs[0])
    tree.links.new(start.outputs["Size"], scale.inputs["Scale"])
    tree.links.new(scale.outputs[0], put_at.inputs["Offset"])
    tree.links.new(put_at.outputs[0], end.inputs[0])
    body.modifiers.new("Nodes", "NODES").node_group = tree


def arm():
    """Two bones along x, and a row of points that are each one's own."""
    rig = put("rig", bpy.data.armatures.new("rig"))
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for k, name in enumerate(("root", "tip")):
        bone = rig.data.edit_bones.new(name)
        bone.head, bone.tail = (k, 0, 0), (k + 1, 0, 0)
        if k:
            bone.parent = rig.data.edit_bones["root"]
    bpy.ops.object.mode_set(mode="OBJECT")
    points = [(x, y, 0) for x in (0.25, 0.75, 1.25, 1.75) for y in (0, 0.2)]
    body = mesh("wing", points, [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(3)])
    for name, own in (("root", [0, 1, 2, 3]), ("tip", [4, 5, 6, 7])):
        body.vertex_groups.new(name=name).add(own, 1.0, "REPLACE")
    body.modifiers.new("Armature", "ARMATURE").object = rig


def decimate():
    """What has fewer faces the smaller a property is."""
    body = box("wing")
    body.modifiers.new("Subdivision", "SUBSURF").levels = 2
    body.modifiers.new("Fewer", "DECIMATE").ratio = 1.0


def cage():
    """A Mesh Deform modifier that is bound, and one on another object that is not."""
    body, around, other = box("wing", 0.5), box("cage"), box("loose", 0.5)
    for one in (body, other):
        made = one.modifiers.new("Cage", "MESH_DEFORM")
        made.object, made.precision = around, 4
    bpy.context.view_layer.objects.active = body
    bpy.ops.object.meshdeform_bind(modifier="Cage")


def driven():
    """A property that users have added drives a modifier."""
    body = column()
    made = body.modifiers.new("Twist", "SIMPLE_DEFORM")
    made.deform_method, made.deform_axis = "TWIST", "Z"
    body["turn"] = 0.2
    curve = made.driver_add("angle")
    own = curve.driver.variables.new()
    own.name, own.targets[0].id, own.targets[0].data_path = "turn", body, '["turn"]'
    curve.driver.expression = "2 * turn"


def curve():
    """A tube: a curve with a bevel, which is no mesh before it is evaluated."""
    data = bpy.data.curves.new("tube", "CURVE")
    data.dimensions, data.bevel_depth, data.bevel_resolution = "3D", 0.1, 1
    line = data.splines.new("POLY")
    line.points.add(1)
    line.points[1].co = (1, 0, 0, 1)
    put("tube", data)


def wrap():
    """A column that shrinks down to a plane, in a collection that is not shown."""
    plane = mesh("plane", [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)])
    plane.location.z = -0.5
    body = column()
    made = body.modifiers.new("Wrap", "SHRINKWRAP")
    made.wrap_method, made.target, made.use_project_z = "PROJECT", plane, True
    made.use_negative_direction = True
    hidden = bpy.data.collections.new("hidden")
    bpy.context.scene.collection.children.link(hidden)
    for one in (body, plane):
        bpy.context.scene.collection.objects.unlink(one)
        hidden.objects.link(one)
    bpy.context.view_layer.layer_collection.children["hidden"].exclude = True
    keyed = put("keyed", bpy.data.lattices.new("keyed"))
    keyed.shape_key_add(name="Basis")


if __name__ == "__main__":
    main(Path(sys.argv[-1]))
    sys.stdout.flush()
    os._exit(0)  # bpy may hang while the interpreter cleans up
