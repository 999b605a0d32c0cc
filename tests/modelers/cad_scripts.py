"""Modelling scripts of small shapes, as text for files."""

HEAD = """
from OCP.OCP.BRepPrimAPI import (BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus)
from OCP.OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

class Part:
    def __init__(self, shape):
        self.wrapped = shape

def at(shape, x, y, z):
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(x, y, z))
    return BRepBuilderAPI_Transform(shape, move).Shape()
"""

CYLINDER = "def make(p): return BRepPrimAPI_MakeCylinder(p['radius'], p['height']).Shape()"
SPHERE = "def make(p): return BRepPrimAPI_MakeSphere(p['radius']).Shape()"
CONE = "def make(p): return BRepPrimAPI_MakeCone(p['radius'], 0.0, p['height']).Shape()"
TORUS = "def make(p): return BRepPrimAPI_MakeTorus(p['radius'], p['tube']).Shape()"
BOX = "def make(p): return Part(BRepPrimAPI_MakeBox(*p['edges']).Shape())"
PAIR = """
def make(p):
    box = BRepPrimAPI_MakeBox(1.0, 1.0, 1.0).Shape()
    return {'case': box, 'ball': Part(at(BRepPrimAPI_MakeSphere(0.5).Shape(), p['x'], 0.0, 0.0))}
"""
PLATE = """
def make(p):
    plate = BRepPrimAPI_MakeBox(4.0, 2.0, 0.5).Shape()
    axis = gp_Ax2(gp_Pnt(p['x'], 1.0, -1.0), gp_Dir(0.0, 0.0, 1.0))
    return BRepAlgoAPI_Cut(plate, BRepPrimAPI_MakeCylinder(axis, p['radius'], 3.0).Shape()).Shape()
"""
BRANCH = """
from OCP.OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse

def make(p):
    along = gp_Ax2(gp_Pnt(-2.0, 0.0, 0.0), gp_Dir(1.0, 0.0, 0.0))
    main = BRepPrimAPI_MakeCylinder(along, p['radius'], 4.0).Shape()
    branch = BRepPrimAPI_MakeCylinder(p['bore'], p['height']).Shape()
    return BRepAlgoAPI_Fuse(main, branch).Shape()
"""
ROUGH = """
import math
def make(p):
    return BRepPrimAPI_MakeSphere(p['radius'] + 1e-6 * math.sin(1e6 * p['radius'])).Shape()
"""
