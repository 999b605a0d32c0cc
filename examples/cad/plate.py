"""A plate with a round hole, by a boolean of OpenCascade: a modelling script for moldline [m]."""

from OCP.OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.OCP.gp import gp_Ax2, gp_Dir, gp_Pnt


def make(parameters):
    """The hole's place along x and its radius are parameters."""
    plate = BRepPrimAPI_MakeBox(4.0, 2.0, 0.5).Shape()
    axis = gp_Ax2(gp_Pnt(parameters["place"], 1.0, -1.0), gp_Dir(0.0, 0.0, 1.0))
    hole = BRepPrimAPI_MakeCylinder(axis, parameters["radius"], 3.0).Shape()
    return BRepAlgoAPI_Cut(plate, hole).Shape()
