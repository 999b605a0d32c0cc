"""Closing of openings that lie in a plane, such as a half model's at its symmetry plane."""

from dataclasses import dataclass

import numpy as np

from .._types import Array
from ..errors import GeometryError, ParameterError
from . import quality, topology
from .planar import loop_area, triangulated
from .surface import Surface

IN_PLANE = 1e-6
"""A loop lies in a plane if no point is farther off it than this part of the surface's extent."""


@dataclass(frozen=True)
class Capping:
    """What was closed."""

    plane: str
    loops: tuple[np.ndarray, ...]
    """Points around each opening, in order."""
    faces: int
    area: float
    """[m²] if the coordinates are in m."""
    off_plane: float
    """Largest distance of a point on the loops from the plane; points stay where they are."""
    left: int
    """Openings that lie in other places."""

    def sentences(self) -> list[str]:
        """What was done, and what was not."""
        sizes = ", ".join(str(len(loop)) for loop in self.loops)
        told = [
            f"capped at {self.plane}: {_counted(len(self.loops), 'opening')} of {sizes} points "
            f"by {self.faces} faces, area {self.area:.6g}; points lie up to {self.off_plane:.2g} "
            "off the plane and stay there"
        ]
        rest = f"{_counted(self.left, 'opening')} elsewhere left open"
        return [*told, rest] if self.left else told


def capped(
    surface: Surface,
    tag: str = "symmetry",
    plane: str = "y",
    at: float = 0.0,
    tolerance: float | None = None,
) -> tuple[Surface, Capping]:
    """Close the openings that lie in the plane x, y or z = `at`, by one more component.

    An opening counts if all its points lie within `tolerance` of the plane [the points' unit; by
    default `IN_PLANE` of the surface's extent]. The cap has no points of its own, and none is
    moved, not even onto the plane: what a deformation moves stays the same to the bit, and
    `uncapped` gives the first surface back. Data of the cap's faces is 0.
    """
    if plane not in ("x", "y", "z"):
        raise ParameterError(f"a cap's plane is x, y or z, got {plane!r}")
    axis = "xyz".index(plane)
    points = np.asarray(surface.points)
    low, high = quality.bounding_box(points)
    near = IN_PLANE * float(np.linalg.norm(high - low)) if tolerance is None else tolerance
    found = topology.boundary_loops(surface.faces)
    offsets = [float(np.abs(points[loop, axis] - at).max()) for loop in found]
    loops = [loop[::-1] for loop, off in zip(found, offsets, strict=True) if off <= near]
    if not loops:
        raise GeometryError(_none_found(plane, at, near, offsets))
    faces = spanned(points[:, [(axis + 1) % 3, (axis + 2) % 3]], loops)
    names = surface.components if tag in surface.components else (*surface.components, tag)
    cap = Surface(points, faces)
    result = Surface(
        points,
        np.concatenate([np.asarray(surface.faces), faces]),
        np.append(surface.tags, np.full(len(faces), names.index(tag))),
        names,
        surface.point_data,
        {name: _extended(data, len(faces)) for name, data in surface.face_data.items()},
    )
    off_plane = max(off for off in offsets if off <= near)
    report = Capping(
        plane=f"{plane} = {at:g}",
        loops=tuple(loops),
        faces=len(faces),
        area=quality.area(cap),
        off_plane=off_plane,
        left=len(found) - len(loops),
    )
    return result, report


def uncapped(surface: Surface, tag: str = "symmetry") -> Surface:
    """The surface without the faces of a component; the points all stay, in their order."""
    surface.component(tag)  # refuses a name that it does not have
    number = surface.components.index(tag)
    tags = np.asarray(surface.tags)
    stays = tags != number
    return Surface(
        surface.points,
        np.asarray(surface.faces)[stays],
        tags[stays] - (tags[stays] > number),
        tuple(name for name in surface.components if name != tag),
        surface.point_data,
        {name: np.asarray(data)[stays] for name, data in surface.face_data.items()},
    )


def spanned(flat: np.ndarray, loops: list[np.ndarray]) -> np.ndarray:
    """Triangles between loops in a plane that run along them, whichever side they are seen from."""
    sizes = np.array([loop_area(flat[loop]) for loop in loops])
    is_clockwise = sizes[np.argmax(np.abs(sizes))] < 0
    return triangulated(flat[:, ::-1] if is_clockwise else flat, loops)


def _extended(data: Array, count: int) -> np.ndarray:
    data = np.asarray(data)
    return np.concatenate([data, np.zeros((count, *data.shape[1:]), data.dtype)])


def _none_found(plane: str, at: float, near: float, offsets: list[float]) -> str:
    where = f"no opening lies in the plane {plane} = {at:g} within {near:.3g}"
    if not offsets:
        return f"{where}: the surface is closed, so there is nothing to cap"
    return (
        f"{where}; the nearest of {len(offsets)} reaches {min(offsets):.3g} off it: give another "
        "plane or tolerance"
    )


def _counted(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
