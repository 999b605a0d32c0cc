"""What measures need of a geometry, and its directions where nobody names them."""

import numpy as np

from .._types import Faces
from ..errors import ParameterError
from ..mesh import Geometry, Grid, Section, Surface
from .directions import Way


def surface_of(geometry: Geometry, what: str) -> Surface:
    """A surface, or the surface patches of a grid, with the same points."""
    if isinstance(geometry, Grid) and len(geometry.faces):
        return Surface(geometry.points, geometry.faces)
    if not isinstance(geometry, Surface):
        raise ParameterError(f"{what} needs a surface of triangles, got a {kind(geometry)}")
    return geometry


def faces_of(geometry: Geometry, component: str | None, what: str) -> Faces:
    """All faces of a surface, or those of one component."""
    surface = surface_of(geometry, what)
    faces = np.asarray(surface.faces)
    if component is not None:
        faces = faces[np.asarray(surface.tags) == component_number(surface, component)]
    if not len(faces):
        raise ParameterError(f"{what} needs faces, there are none")
    return faces


def component_number(surface: Surface, component: str) -> int:
    """Which of a surface's components has a name."""
    if component not in surface.components:
        raise ParameterError(
            f"no component named {component!r}; the surface has: {', '.join(surface.components)}"
        )
    return surface.components.index(component)


def section_of(geometry: Geometry, what: str) -> Section:
    """A section."""
    if not isinstance(geometry, Section):
        raise ParameterError(f"{what} needs a section, got a {kind(geometry)}")
    return geometry


def kind(geometry: Geometry) -> str:
    """What sort of geometry it is, in a word."""
    return type(geometry).__name__.lower()


def up(geometry: Geometry) -> str:
    """Where lift points: sections lie in the x-y plane, elsewhere z is up."""
    return "y" if isinstance(geometry, Section) else "z"


def span(geometry: Geometry) -> Way:
    """Across a section's plane, so that x, this and up are right-handed."""
    return (0.0, 0.0, -1.0) if isinstance(geometry, Section) else "y"


def room(geometry: Geometry) -> str:
    """The directions in which points can move."""
    return "xy" if isinstance(geometry, Section) else "xyz"
