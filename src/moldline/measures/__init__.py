"""MEASURE: differentiable numbers taken from a shape."""

from .angle import Incidence, Opening
from .area import Area, ProjectedArea
from .base import AbstractMeasure, Constraint
from .bending_energy import BendingEnergy
from .camber import Camber
from .centroid import Centroid
from .chord import Chord
from .circularity import Circularity, EdgeRadius
from .clearance import Clearance
from .controls import Controls
from .cross_section import CrossSection
from .curvature import Curvature
from .distance import Distance
from .enclosed import Enclosed
from .monotonicity import Monotonicity
from .opposed import Opposed
from .picks import Place, Region
from .position import Position
from .ray_thickness import RayThickness
from .regions import Fixed, Rigid, Symmetry
from .section_area import SectionArea
from .separation import Separation
from .spot import Spot
from .straightness import Linearity, Planarity
from .thickness import Thickness
from .volume import Volume

__all__ = [
    "AbstractMeasure",
    "Area",
    "BendingEnergy",
    "Camber",
    "Centroid",
    "Chord",
    "Circularity",
    "Clearance",
    "Constraint",
    "Controls",
    "CrossSection",
    "Curvature",
    "Distance",
    "EdgeRadius",
    "Enclosed",
    "Fixed",
    "Incidence",
    "Linearity",
    "Monotonicity",
    "Opening",
    "Opposed",
    "Place",
    "Planarity",
    "Position",
    "ProjectedArea",
    "RayThickness",
    "Region",
    "Rigid",
    "SectionArea",
    "Separation",
    "Spot",
    "Symmetry",
    "Thickness",
    "Volume",
]
