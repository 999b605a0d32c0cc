"""A wing lofted through two sections of a NACA four-digit airfoil, by OpenCascade.

A modelling script for moldline: a function `make` of parameters that returns a shape. Lengths are
in metres, angles in degrees.
"""

import math

from OCP.OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeWire
from OCP.OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.OCP.collections import HArray1_gp_Pnt
from OCP.OCP.GeomAPI import GeomAPI_Interpolate
from OCP.OCP.gp import gp_Pnt

PLACES = [(1 - math.cos(math.pi * k / 20)) / 2 for k in range(21)]
"""Of points along the chord, denser at both ends."""


def half_thickness(x, thickness):
    """Of the airfoil at a place along its chord, by the chord; closed at the trailing edge."""
    powers = 0.2969 * math.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4
    return 5 * thickness * powers


def section(chord, thickness, sweep, twist, y):
    """A closed wire: from the trailing edge over the top to it again."""
    upper = [(x, half_thickness(x, thickness)) for x in reversed(PLACES)]
    lower = [(x, -half_thickness(x, thickness)) for x in PLACES[1:]]
    turn, behind = math.radians(twist), y * math.tan(math.radians(sweep))
    outline = HArray1_gp_Pnt(1, len(upper + lower))
    for k, (x, z) in enumerate(upper + lower, start=1):
        along, above = chord * (x - 0.25), chord * z
        outline.SetValue(
            k,
            gp_Pnt(
                behind + 0.25 * chord + along * math.cos(turn) + above * math.sin(turn),
                y,
                above * math.cos(turn) - along * math.sin(turn),
            ),
        )
    curve = GeomAPI_Interpolate(outline, False, 1e-9)
    curve.Perform()
    edge = BRepBuilderAPI_MakeEdge(curve.Curve()).Edge()
    return BRepBuilderAPI_MakeWire(edge).Wire()


def make(parameters):
    """A closed half wing from the plane y = 0."""
    p = parameters
    loft = BRepOffsetAPI_ThruSections(True, True)
    for part, twist in ((0.0, 0.0), (1.0, p["twist"])):
        chord = p["chord"] * (1 + part * (p["taper"] - 1))
        loft.AddWire(section(chord, p["thickness"], p["sweep"], twist, part * p["span"]))
    loft.CheckCompatibility(False)
    return loft.Shape()
