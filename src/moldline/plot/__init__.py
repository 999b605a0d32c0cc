"""LOOK: pictures without a display and without OpenGL."""

from ..mesh.slices import cut
from .faults import of_faults
from .figure import save
from .flowchart import of_pipeline
from .nets import Net, draw_net
from .pictures import of_cuts, of_deformation, of_geometry, of_sensitivity
from .reflections import of_reflections
from .sections import draw_section, section_picture
from .surfaces import before_and_after, draw_surface, sensitivity_map
from .view import View

__all__ = [
    "Net",
    "View",
    "before_and_after",
    "cut",
    "draw_net",
    "draw_section",
    "draw_surface",
    "of_cuts",
    "of_deformation",
    "of_faults",
    "of_geometry",
    "of_pipeline",
    "of_reflections",
    "of_sensitivity",
    "save",
    "section_picture",
    "sensitivity_map",
]
