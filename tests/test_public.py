"""What moldline offers, and what importing it costs."""

import subprocess
import sys

import moldline as ml

PUBLIC = {
    "AbstractBinding", "AbstractDeformer", "AbstractModeler", "AbstractNumpyDeformer", "Blender",
    "Body", "BodySkeleton", "Bone", "Bones", "Cad", "Cage", "Cloud", "Constraint", "Construction",
    "ControlVolume", "DirectSkeleton", "Esp", "Geometry", "Grid", "Hinge", "Kulfan", "Lattice",
    "LinearBinding", "Link", "Measurements", "Naca4", "Naca5", "NacaModified", "Nacelle",
    "OpenVsp", "Pilots", "Pipeline", "Planform", "Program", "Section", "Skeleton", "Spot", "Stage",
    "Subdivision", "Surface", "Tabulated", "TrapezoidalWing", "Union", "Variable", "VolumeMesh",
    "Wing", "WingSkeleton", "airfoil", "errors", "links", "load", "measures", "planform", "plot",
    "read", "read_sensitivities", "variable", "write", "write_sensitivities",
}  # fmt: skip


def test_the_public_names_are_these():
    assert set(ml.__all__) == PUBLIC
    for name in PUBLIC:
        assert getattr(ml, name) is not None


def test_importing_moldline_imports_nothing_heavy():
    code = "import sys, moldline; print([m for m in ('jax', 'numpy', 'numba') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_floats_are_64_bits_whoever_imports_first():
    for first in ("import jax, moldline", "import moldline, jax"):
        code = f"{first}; import jax.numpy as jnp; print(jnp.zeros(1).dtype)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.stdout.strip() == "float64", done.stderr
