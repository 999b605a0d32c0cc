"""A scene of Blender's becomes a case that gives Blender's points."""

import subprocess

import numpy as np
import pytest
from blender_process import PYTHON, ROOT

import moldline as ml

SCENE = """
import runpy, sys
import bpy, numpy as np
bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, location=(0.5, 0.2, 0.1))
body = bpy.context.object
body.name = "ball"
body.scale = (1.5, 1.0, 0.4)
lattice = bpy.data.lattices.new("cage")
cage = bpy.data.objects.new("cage", lattice)
bpy.context.scene.collection.objects.link(cage)
lattice.points_u, lattice.points_v, lattice.points_w = 4, 3, 2
for axis in "uvw":
    setattr(lattice, "interpolation_type_" + axis, "KEY_BSPLINE")
cage.location, cage.scale, cage.rotation_euler = (0.4, 0.1, 0), (3.5, 2.5, 1.2), (0.1, 0.2, 0.3)
rng = np.random.default_rng(0)
for point in lattice.points:
    point.co_deform = [a + b for a, b in zip(point.co, rng.uniform(-0.05, 0.05, 3))]
body.modifiers.new("lattice", "LATTICE").object = cage
bpy.context.view_layer.update()
folder = sys.argv[1]
sys.argv = ["blender", "--", "ball", folder]
runpy.run_path(SCRIPT, run_name="__main__")
seen = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
points = [list(body.matrix_world @ vertex.co) for vertex in seen.data.vertices]
np.save(folder + "/seen.npy", np.array(points))
"""


@pytest.mark.blender
def test_a_lattice_modifier_becomes_a_case(imports_bpy, tmp_path):
    script = ROOT / "examples/from_blender/lattice_to_case.py"
    (tmp_path / "scene.py").write_text(f"SCRIPT = {str(script)!r}\n{SCENE}")
    command = [PYTHON, tmp_path / "scene.py", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    seen = np.load(tmp_path / "seen.npy")
    case = ml.load(tmp_path / "ball.toml")
    ours = np.asarray(case.pipeline.points())
    rest = np.asarray(case.pipeline.geometry.points)
    assert np.abs(seen - rest).max() > 0.02
    np.testing.assert_allclose(ours, seen, rtol=0, atol=2e-6)  # Blender works in single precision
