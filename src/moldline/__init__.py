"""Geometry engine for aerodynamic shape design.

A name is imported when it is first used, so that `import moldline` itself costs nothing.
"""

import importlib
import os
import sys
from typing import TYPE_CHECKING, Any

if "jax" in sys.modules:
    sys.modules["jax"].config.update("jax_enable_x64", True)
else:
    os.environ["JAX_ENABLE_X64"] = "1"  # JAX reads it when it is imported

if TYPE_CHECKING:
    from . import errors, measures, plot
    from .case import load
    from .deformers.base import AbstractBinding, AbstractDeformer, LinearBinding
    from .deformers.body_skeleton import BodySkeleton
    from .deformers.bones import Bone, Bones
    from .deformers.cage import Cage
    from .deformers.control_volume import ControlVolume
    from .deformers.direct_skeleton import DirectSkeleton
    from .deformers.foreign import AbstractNumpyDeformer
    from .deformers.hinge import Hinge
    from .deformers.lattice import Lattice
    from .deformers.pilots import Pilots
    from .deformers.skeleton import Skeleton
    from .deformers.wing_skeleton import WingSkeleton
    from .measures.base import Constraint
    from .measures.spot import Spot
    from .mesh import Cloud, Geometry, Grid, Section, Surface, VolumeMesh
    from .mesh.io import read, write
    from .mesh.io.sensitivities import read_sensitivities, write_sensitivities
    from .mesh.planform import Planform, planform
    from .modelers.airfoils import airfoil
    from .modelers.base import AbstractModeler
    from .modelers.blender import Blender
    from .modelers.body import Body
    from .modelers.cad import Cad
    from .modelers.esp import Esp
    from .modelers.kulfan import Kulfan
    from .modelers.naca4 import Naca4
    from .modelers.naca5 import Naca5
    from .modelers.naca_modified import NacaModified
    from .modelers.nacelle import Nacelle
    from .modelers.openvsp import OpenVsp
    from .modelers.program import Program
    from .modelers.subdivision import Subdivision
    from .modelers.tabulated import Tabulated
    from .modelers.trapezoidal_wing import TrapezoidalWing
    from .modelers.union import Union
    from .modelers.wing import Wing
    from .parameters import links
    from .parameters.link import Link
    from .parameters.variable import Variable, variable
    from .pipeline.construction import Construction
    from .pipeline.measurements import Measurements
    from .pipeline.pipeline import Pipeline
    from .pipeline.stage import Stage

_HOMES = {
    "AbstractBinding": "deformers.base",
    "AbstractDeformer": "deformers.base",
    "AbstractModeler": "modelers.base",
    "AbstractNumpyDeformer": "deformers.foreign",
    "Blender": "modelers.blender",
    "Body": "modelers.body",
    "BodySkeleton": "deformers.body_skeleton",
    "Bone": "deformers.bones",
    "Bones": "deformers.bones",
    "Cad": "modelers.cad",
    "Cage": "deformers.cage",
    "Cloud": "mesh",
    "Constraint": "measures.base",
    "Construction": "pipeline.construction",
    "ControlVolume": "deformers.control_volume",
    "DirectSkeleton": "deformers.direct_skeleton",
    "Esp": "modelers.esp",
    "Geometry": "mesh",
    "Grid": "mesh",
    "Hinge": "deformers.hinge",
    "Kulfan": "modelers.kulfan",
    "Lattice": "deformers.lattice",
    "LinearBinding": "deformers.base",
    "Link": "parameters.link",
    "Measurements": "pipeline.measurements",
    "Naca4": "modelers.naca4",
    "Naca5": "modelers.naca5",
    "NacaModified": "modelers.naca_modified",
    "Nacelle": "modelers.nacelle",
    "OpenVsp": "modelers.openvsp",
    "Pilots": "deformers.pilots",
    "Pipeline": "pipeline.pipeline",
    "Planform": "mesh.planform",
    "Program": "modelers.program",
    "Section": "mesh",
    "Skeleton": "deformers.skeleton",
    "Spot": "measures.spot",
    "Stage": "pipeline.stage",
    "Subdivision": "modelers.subdivision",
    "Surface": "mesh",
    "Tabulated": "modelers.tabulated",
    "TrapezoidalWing": "modelers.trapezoidal_wing",
    "Union": "modelers.union",
    "Variable": "parameters.variable",
    "VolumeMesh": "mesh",
    "Wing": "modelers.wing",
    "WingSkeleton": "deformers.wing_skeleton",
    "airfoil": "modelers.airfoils",
    "errors": "",
    "links": "parameters",
    "load": "case",
    "measures": "",
    "planform": "mesh.planform",
    "plot": "",
    "read": "mesh.io",
    "read_sensitivities": "mesh.io.sensitivities",
    "variable": "parameters.variable",
    "write": "mesh.io",
    "write_sensitivities": "mesh.io.sensitivities",
}

_MODULES = {"errors", "links", "measures", "plot"}

__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'moldline' has no attribute {name!r}")
    home = ".".join(filter(None, ["moldline", _HOMES[name]]))
    if name in _MODULES:
        return importlib.import_module(f"{home}.{name}")
    return getattr(importlib.import_module(home), name)


def __dir__() -> list[str]:
    return sorted(__all__)
