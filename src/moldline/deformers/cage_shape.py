"""What a cage is made of, and why some surfaces are none."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from ..errors import GeometryError
from ..mesh import Surface, topology
from ..mesh.intersections import self_intersections
from ..mesh.planar import triangulated
from ..mesh.quality import signed_volume
from ..numerics.winding import winding

NAMED = 3
"""Places that an error names."""

LARGEST = 1e50
"""Coordinate of a cage: its fourth power is still a number."""

MOST = 20_000
"""Points of a cage; more are a slip of the pen."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A closed surface: its points, its triangles, and the lines between its polygons."""

    points: Float[np.ndarray, "m 3"]
    faces: Int[np.ndarray, "t 3"]
    lines: Int[np.ndarray, "l 2"]


def shaped(points: Any, faces: Sequence[Sequence[Any]] | Array) -> Shape:
    """A cage's shape, its faces turned outwards.

    Raises
    ------
    GeometryError
        Where it is open, not manifold, or runs through itself.
    """
    points = np.array(points, float)
    if points.ndim != 2 or points.shape[1:] != (3,) or not np.all(np.abs(points) < LARGEST):
        raise GeometryError(
            f"a cage's points must be finite, coordinates below {LARGEST:g}, of shape (m, 3)"
        )
    if len(points) > MOST:
        raise GeometryError(f"a cage has {MOST} points at most, got {len(points)}; make it coarser")
    loops = [np.asarray(face) for face in faces]
    for number, loop in enumerate(loops):
        if (
            loop.dtype.kind not in "iu"
            or len(set(loop.tolist())) < max(3, len(loop))
            or loop.min() < 0
            or loop.max() >= len(points)
        ):
            raise GeometryError(
                f"face {number} of the cage is {loop.tolist()[:8]}: expected three or more "
                f"different points of 0 to {len(points) - 1}"
            )
    if not loops:
        raise GeometryError("a cage needs faces, got none")
    triangles = np.concatenate([_triangles(points, loop) for loop in loops])
    _check_closed(points, triangles)
    triangles = _outwards(points, triangles)
    sides = [np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops]
    lines = np.unique(np.sort(np.concatenate(sides), axis=1), axis=0)
    unused = np.setdiff1d(np.arange(len(points)), triangles)
    if len(unused):
        raise GeometryError(f"point {unused[0]} of the cage is in no face; leave it out")
    return Shape(points, triangles, lines)


def _triangles(points: np.ndarray, loop: np.ndarray) -> Int[np.ndarray, "t 3"]:
    """A polygon's triangles, the same however often it is asked: of a quadrilateral by the shorter
    diagonal, of others in the plane that fits them."""
    if len(loop) == 3:
        return loop[None]
    if len(loop) == 4:
        a, b, c, d = loop
        shorter = np.linalg.norm(points[a] - points[c]) <= np.linalg.norm(points[b] - points[d])
        return np.array([[a, b, c], [a, c, d]] if shorter else [[a, b, d], [b, c, d]])
    corners = points[loop] - points[loop].mean(axis=0)
    normal = np.sum(np.cross(corners, np.roll(corners, -1, axis=0)), axis=0)
    along = corners[0] / (np.linalg.norm(corners[0]) or 1.0)
    axes = np.stack([along, np.cross(normal, along) / (np.linalg.norm(normal) or 1.0)])
    try:
        return loop[triangulated(corners @ axes.T, [np.arange(len(loop))])]
    except GeometryError as error:
        raise GeometryError(f"face {loop.tolist()} of the cage: {error}") from None


def _check_closed(points: np.ndarray, faces: np.ndarray) -> None:
    edges = topology.edges(faces)
    for kind, found in (
        ("is open", edges.open),
        ("has edges of more than two faces", edges.nonmanifold),
        ("has faces of different sides", edges.misoriented),
    ):
        if len(found):
            raise GeometryError(
                f"the cage {kind} at {len(found)} edges, near "
                f"{_places(points[found].mean(axis=1))}; a cage is a closed surface "
                "(moldline check --fix may mend it)"
            )
    crossing = self_intersections(points, faces)
    if len(crossing.pairs):
        raise GeometryError(
            f"the cage runs through itself in {len(crossing.pairs)} pairs of faces, near "
            f"{_places(crossing.places)}; move its points apart"
        )


def _outwards(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Faces of every piece turned outwards, or inwards where it lies in another: a hole."""
    count, piece = topology.pieces(faces)
    turned = faces.copy()
    for number in range(count):
        own = faces[piece == number]
        around = sum(
            abs(winding(points[own[:1, 0]], points, faces[piece == other])[0]) > 0.5
            for other in range(count)
            if other != number
        )
        if (signed_volume(Surface(points, own)) < 0) != (around % 2 == 1):
            turned[piece == number] = own[:, ::-1]
    return turned


def _places(places: np.ndarray) -> str:
    shown = [f"({', '.join(f'{x:.6g}' for x in place)})" for place in places[:NAMED]]
    return "; ".join(shown) + (" ..." if len(places) > NAMED else "")


def check_finite(points: np.ndarray) -> None:
    """Refuse points that are nowhere."""
    lost = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(lost):
        raise GeometryError(
            f"{len(lost)} of {len(points)} points have coordinates that are not finite (first: "
            f"point {lost[0]}); leave them out"
        )


def check_inside(
    points: np.ndarray, outside: np.ndarray, touching: np.ndarray, gaps: np.ndarray
) -> None:
    """Refuse points outside a cage, or on it; both are given by number."""
    for rows, what, remedy in (
        (outside, "outside the cage", "make the cage larger, or take mean value coordinates"),
        (touching, "on the cage", "move the cage away from the geometry"),
    ):
        if len(rows):
            first = "; ".join(
                f"point {n} at ({', '.join(f'{x:.6g}' for x in points[n])}), {gaps[n]:.2g} from it"
                for n in rows[:NAMED]
            )
            raise GeometryError(
                f"{len(rows)} of {len(points)} points lie {what}: {first}; {remedy}"
            )
