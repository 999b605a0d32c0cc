"""How good triangles and cells are: areas, angles, volume, inverted cells."""

import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from . import topology
from .surface import Surface
from .volume import VolumeMesh

FLAT = 1e-12
"""A face is degenerate if its height is below this fraction of its longest side."""

SLIVER_DEG = 1.0
"""A face is a sliver if its smallest angle is below this; its height is then less than 1/57 of its
second longest side."""

FOLD_DEG = 150.0
"""Two faces are folded onto each other if their normals differ by more than this."""

_CORNERS = {
    10: [(0, 1, 2, 3)],
    12: [
        *[(0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7)],
        *[(4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)],
    ],
    13: [(0, 1, 2, 3), (1, 2, 0, 4), (2, 0, 1, 5), (3, 5, 4, 0), (4, 3, 5, 1), (5, 4, 3, 2)],
    14: [(0, 1, 3, 4), (1, 2, 0, 4), (2, 3, 1, 4), (3, 0, 2, 4)],
}
"""By VTK's number of a solid cell: corners with three neighbours that form a positive volume."""

_SIDES = {5: 3, 9: 4}
"""Sides of plane cells by VTK's number."""

_PRISM = 13


def bounding_box(points: Array) -> Float[np.ndarray, "2 3"]:
    """Smallest and largest coordinates [the points' unit]; NaN where there are no points."""
    points = np.asarray(points)
    if not len(points):
        return np.full((2, 3), np.nan)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def face_areas(surface: Surface) -> Float[np.ndarray, "m"]:
    """Area of each face [m²]."""
    a, b, c = _corners(surface)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def area(surface: Surface) -> float:
    """Area of all faces [m²]."""
    return float(face_areas(surface).sum())


def signed_volume(surface: Surface) -> float:
    """Volume a closed surface encloses [m³]; negative if its faces look inward."""
    a, b, c = _corners(surface)
    middle = bounding_box(surface.points).mean(axis=0)  # far from the origin digits would cancel
    return float(np.einsum("ij,ij->", a - middle, np.cross(b - middle, c - middle)) / 6)


def degenerate_faces(surface: Surface) -> Int[np.ndarray, "d"]:
    """Faces without area: two points in one place, or all three in a line."""
    longest = np.sqrt(_squared_sides(surface).max(axis=0, initial=0.0))
    return np.flatnonzero(2 * face_areas(surface) <= FLAT * longest**2)


def smallest_angles(surface: Surface) -> Float[np.ndarray, "m"]:
    """Smallest angle of each face [rad]; 0 where the face is degenerate."""
    squares = np.sort(_squared_sides(surface), axis=0)
    twice_area = 2 * face_areas(surface)
    # the smallest angle lies opposite the shortest side: tan = 2 * 2A / (b² + c² - a²)
    return np.arctan2(2 * twice_area, np.maximum(squares[1] + squares[2] - squares[0], 0))


def slivers(surface: Surface) -> Int[np.ndarray, "s"]:
    """Needles and caps: faces with area whose smallest angle is below `SLIVER_DEG`."""
    is_sliver = smallest_angles(surface) < np.radians(SLIVER_DEG)
    is_sliver[degenerate_faces(surface)] = False
    return np.flatnonzero(is_sliver)


def folded_faces(surface: Surface) -> Int[np.ndarray, "f"]:
    """Faces folded over onto their neighbours: all of two or more face the other way.

    One such neighbour proves nothing, it may lie beyond a sharp edge. Looked at are neighbours that
    have area and show the same side; the normals must differ by more than `FOLD_DEG`.
    """
    a, b, c = _corners(surface)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    lengths[degenerate_faces(surface)] = np.inf
    near = topology.neighbours(surface.faces)
    pairs = np.stack([near.one, near.other])[:, near.is_oriented]
    pairs = pairs[:, np.isfinite(lengths[pairs]).all(axis=0)]
    cosine = np.einsum("ij,ij->i", *normals[pairs]) / lengths[pairs].prod(axis=0)
    is_opposite = cosine < np.cos(np.radians(FOLD_DEG))
    count = len(normals)
    opposite = np.bincount(pairs[:, is_opposite].ravel(), minlength=count)
    return np.flatnonzero(
        (opposite >= 2) & (opposite == np.bincount(pairs.ravel(), minlength=count))
    )


def inverted_cells(mesh: VolumeMesh) -> Int[np.ndarray, "i"]:
    """Cells that are turned inside out at one of their corners or more, ascending.

    Triangles and quadrangles must run counter-clockwise in the x-y plane; solid cells are looked
    at corner by corner, in VTK's order of nodes. Prisms are written in both senses by the programs
    in use, so the sense of most of a mesh's prisms counts as right.
    """
    points = np.asarray(mesh.points)
    types, starts, nodes = (np.asarray(array) for array in mesh.cells)
    found = [np.empty(0, np.int64)]
    for kind in np.unique(types).tolist():
        cells = np.flatnonzero(types == kind)
        if mesh.dimension == 2 and kind in _SIDES:
            corners = nodes[starts[cells][:, None] + np.arange(_SIDES[kind])]
            worst = _turns(points[corners]).min(axis=1)
        elif mesh.dimension == 3 and kind in _CORNERS:
            corners = nodes[starts[cells][:, None] + np.array(_CORNERS[kind])[:, None]]
            volumes = _volumes(points[corners])
            if kind == _PRISM and np.median(volumes) < 0:
                volumes = -volumes
            worst = volumes.min(axis=0)
        else:
            continue
        found.append(cells[worst <= 0])
    return np.sort(np.concatenate(found))


def _corners(surface: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    return points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]


def _squared_sides(surface: Surface) -> np.ndarray:
    a, b, c = _corners(surface)
    return np.stack([np.einsum("ij,ij->i", side, side) for side in (b - a, c - b, a - c)])


def _turns(polygons: np.ndarray) -> np.ndarray:
    """At each corner of each polygon, twice the area it spans with its two neighbours."""
    before = polygons - np.roll(polygons, 1, axis=1)
    after = np.roll(polygons, -1, axis=1) - polygons
    return before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]


def _volumes(corners: np.ndarray) -> np.ndarray:
    """Six times the volume of the tetrahedra whose four corners stand on the last axis but one."""
    a, b, c = (corners[..., k, :] - corners[..., 0, :] for k in (1, 2, 3))
    return np.einsum("...i,...i->...", np.cross(a, b), c)
