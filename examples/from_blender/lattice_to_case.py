"""Write a Blender object and its Lattice modifier as a moldline case.

In Blender: select the object, open this file in the Text editor, run it. From a shell:

    blender scene.blend --background --python lattice_to_case.py -- OBJECT FOLDER

FOLDER gets `OBJECT.obj` and `OBJECT.toml`. The case has one design variable, `moves`, three numbers
per control point in the order of a moldline lattice; its value is where the points are now.
Coordinates are those of Blender's world, in its unit.
"""

import sys
from pathlib import Path

import bpy

CASE = """\
moldline = 1

[geometry.{name}]
file = "{name}.obj"

[variable.moves]
value = {moves}

[[stage]]
deformer = "lattice"
shape = {shape}
origin = {origin}
edges = {edges}
ends = "blender"
outside = "extend"

[[stage.link]]
variable = "moves"
link = "controls"
"""


def main(name: str, folder: Path) -> None:
    """Write both files."""
    body = bpy.data.objects[name]
    modifiers = [m for m in body.modifiers if m.type == "LATTICE" and m.object]
    if len(modifiers) != 1:
        raise SystemExit(f"{name} has {len(modifiers)} Lattice modifiers, expected one")
    cage = modifiers[0].object
    kinds = {getattr(cage.data, f"interpolation_type_{axis}") for axis in "uvw"}
    if kinds != {"KEY_BSPLINE"}:
        raise SystemExit(f"{cage.name} interpolates by {kinds}, expected BSpline along U, V and W")
    shape = cage.data.points_u, cage.data.points_v, cage.data.points_w
    rest = [cage.matrix_world @ point.co for point in cage.data.points]
    moved = [cage.matrix_world @ point.co_deform for point in cage.data.points]
    steps = 1, shape[0], shape[0] * shape[1]  # Blender's first index runs fastest
    own = [sum(i * s for i, s in zip(index, steps, strict=True)) for index in _indices(shape)]
    moves = [x for k in own for x in moved[k] - rest[k]]
    spans = [_edge(cage, rest, shape, steps, axis) for axis in range(3)]
    text = CASE.format(
        name=name,
        shape=list(shape),
        origin=list(rest[0]),
        edges=[list(e) for e in spans],
        moves=moves,
    )
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    _write_obj(body, folder / f"{name}.obj")


def _indices(shape):
    return [(i, j, k) for i in range(shape[0]) for j in range(shape[1]) for k in range(shape[2])]


def _edge(cage, rest, shape, steps, axis):
    """The box's edge along an axis; of any length where there is one control point."""
    if shape[axis] > 1:
        return rest[steps[axis] * (shape[axis] - 1)] - rest[0]
    return cage.matrix_world.to_3x3().col[axis]


def _write_obj(body, path):
    mesh = body.data
    mesh.calc_loop_triangles()
    with path.open("w", encoding="utf-8") as file:
        for vertex in mesh.vertices:
            file.write("v {!r} {!r} {!r}\n".format(*(body.matrix_world @ vertex.co)))
        for triangle in mesh.loop_triangles:
            file.write("f {} {} {}\n".format(*(k + 1 for k in triangle.vertices)))


if __name__ == "__main__":
    if "--" in sys.argv:
        given = sys.argv[sys.argv.index("--") + 1 :]
        main(given[0], Path(given[1]))
    else:
        main(bpy.context.object.name, Path(bpy.path.abspath("//") or Path.home()))
