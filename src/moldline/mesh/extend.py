"""Continuation of an open end, such as a wing's root into a body."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from ..errors import GeometryError, ParameterError
from . import topology
from .slices import axis_number
from .surface import Surface

STEEPEST = np.radians(80)
"""Between the way on and the plane's normal."""


@dataclass(frozen=True)
class Extension:
    """How an open end was continued."""

    plane: str
    points: int
    """New ones."""
    faces: int
    """New ones."""
    longest: float
    """The longest way from the opening to the plane [the points' unit]."""
    steepest: float
    """The largest angle between a way and the plane's normal [rad]."""
    end: Int[np.ndarray, "l"]
    """Points of the new opening in the plane, one for each of the old one, in their order."""

    def sentences(self) -> list[str]:
        """What was done."""
        return [
            f"extended to {self.plane}: {self.points} points and {self.faces} faces more, up to "
            f"{self.longest:.4g} long and {np.degrees(self.steepest):.3g} degrees off the normal"
        ]


def extended(
    surface: Surface,
    plane: str,
    at: float,
    rows: Sequence[float] = (0.0, 0.5, 1.0),
    loop: Int[Array, "l"] | None = None,
) -> tuple[Surface, Extension]:
    """Continue an open end straight on to the plane x, y or z = `at`, and tell what was done.

    Where the next ring has as many points as the opening, each point goes on along the edge that
    arrives there from its partner, so that the lines of a structured wing go on as they are.
    Elsewhere it goes on square to the opening in the tangent plane. The new end lies in the plane
    to the bit, so that `capped` closes it.

    `rows` are where rows of points lie, as parts of the way; the opening's own move to the first.
    With 0 they stay; with more, edges run through the places where they were, and no point is left
    there: that suits an end that lay to the bit on another surface, which would otherwise meet it
    in points, not in faces. New faces belong to the component of the face beside them; data of new
    points is that of the point they came from.

    `loop` is the opening, as `topology.boundary_loops` gives it; there may be but one if not said.
    """
    shares = _checked(rows)
    axis = axis_number(plane)
    points, faces = np.asarray(surface.points, float), np.asarray(surface.faces)
    ring = opening(surface, loop)
    ways = _ways(points[ring], _arriving(points, faces, ring), axis, at, plane)
    places = points[ring] + shares[:, None, None] * ways
    places[-1, :, axis] = at
    moved = points.copy()
    moved[ring] = places[0]
    count, size = len(points), len(ring)
    numbers = np.concatenate(
        [ring[None], count + np.arange(places[1:].size // 3).reshape(-1, size)]
    )
    new, beside = _skin(places, numbers), _beside(faces, ring)
    again = np.tile(np.repeat(beside, 2), len(shares) - 1)
    came = np.append(np.arange(count), np.tile(ring, len(shares) - 1))
    result = Surface(
        np.concatenate([moved, places[1:].reshape(-1, 3)]),
        np.concatenate([faces, new]),
        np.append(np.asarray(surface.tags), np.asarray(surface.tags)[again]),
        surface.components,
        {name: np.asarray(data)[came] for name, data in surface.point_data.items()},
        {
            name: np.concatenate([np.asarray(data), np.asarray(data)[again]])
            for name, data in surface.face_data.items()
        },
    )
    lengths = np.linalg.norm(ways, axis=1)
    steepest = float(np.arccos(np.clip(np.abs(ways[:, axis]) / lengths, 0, 1)).max())
    told = Extension(
        f"{plane} = {at:g}",
        len(result.points) - count,
        len(new),
        float(lengths.max()),
        steepest,
        numbers[-1],
    )
    return result, told


def opening(surface: Surface, loop: Array | None) -> Int[np.ndarray, "l"]:
    """The opening given, or the only one."""
    found = topology.boundary_loops(surface.faces)
    if loop is not None:
        ours = [own for own in found if np.array_equal(np.sort(loop), np.sort(own))]
        if not ours:
            raise ParameterError(
                f"{len(loop)} points are none of the surface's {len(found)} openings; take them "
                "from mesh.topology.boundary_loops"
            )
        return ours[0]
    if len(found) != 1:
        middles = [np.asarray(surface.points)[own].mean(axis=0) for own in found]
        places = "; ".join("{} points around ({:.4g}, {:.4g}, {:.4g})".format(len(own), *middle)
                           for own, middle in zip(found, middles, strict=True))  # fmt: skip
        raise GeometryError(
            f"the surface has {len(found)} openings{': ' if places else ''}{places}; say which "
            "one: loop = topology.boundary_loops(surface.faces)[k]"
        )
    return found[0]


def _checked(rows: Sequence[float]) -> Float[np.ndarray, "r"]:
    shares = np.array(rows, float)
    if shares.ndim != 1 or len(shares) < 2 or shares[0] < 0 or shares[-1] != 1:
        raise ParameterError(f"rows are parts of the way from 0 or more to 1, got {list(rows)}")
    if np.any(np.diff(shares) <= 0):
        raise ParameterError(f"rows must ascend, got {list(rows)}")
    return shares


def _arriving(points: np.ndarray, faces: np.ndarray, ring: np.ndarray) -> Float[np.ndarray, "l 3"]:
    """The direction in which the surface arrives at each point of an opening.

    Where the next ring has as many points, these are paired in order, by that of all pairings along
    edges which is shortest. Elsewhere it is square to the opening, in the tangent plane.
    """
    before = _paired(points, faces, ring)
    return _square(points, faces, ring) if before is None else points[ring] - points[before]


def _paired(points: np.ndarray, faces: np.ndarray, ring: np.ndarray) -> Int[np.ndarray, "l"] | None:
    touches = np.isin(faces, ring).any(axis=1)
    rings = [
        own
        for own in topology.boundary_loops(faces[~touches])
        if len(own) == len(ring) and np.isin(own, faces[touches]).all()
    ]
    if len(rings) != 1:
        return None
    ends = topology.edges(faces[touches]).ends
    known = set(map(tuple, ends.tolist()))
    pairings = [np.roll(rings[0], -shift) for shift in range(len(ring))]
    fits = [
        p
        for p in pairings
        if known.issuperset(map(tuple, np.sort(np.stack([ring, p], axis=1), axis=1).tolist()))
    ]
    lengths = [np.linalg.norm(points[ring] - points[p], axis=1).sum() for p in fits]
    return fits[int(np.argmin(lengths))] if fits else None


def _square(points: np.ndarray, faces: np.ndarray, ring: np.ndarray) -> Float[np.ndarray, "l 3"]:
    along = points[np.roll(ring, -1)] - points[np.roll(ring, 1)]
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = np.zeros_like(points)
    for corner in faces.T:
        np.add.at(normals, corner, np.cross(b - a, c - a))
    return np.cross(along, normals[ring])


def _ways(
    places: np.ndarray, arriving: np.ndarray, axis: int, at: float, plane: str
) -> Float[np.ndarray, "l 3"]:
    """From each point of the opening to the plane."""
    missing = at - places[:, axis]
    sizes = np.linalg.norm(arriving, axis=1)
    lean = arriving[:, axis] * np.sign(missing) / np.where(sizes > 0, sizes, 1.0)
    if np.any(missing == 0) or np.any(lean < np.cos(STEEPEST)):
        worst = int(np.argmin(np.where(missing == 0, -1.0, lean)))
        raise GeometryError(
            f"the surface does not go on to the plane {plane} = {at:g}: near "
            "({:.6g}, {:.6g}, {:.6g}) it runs along ({:.3g}, {:.3g}, {:.3g}); give a plane beyond "
            "the opening, across which the surface leads".format(*places[worst], *arriving[worst])
        )
    return arriving * (missing / arriving[:, axis])[:, None]


def _skin(places: Float[np.ndarray, "r l 3"], numbers: np.ndarray) -> Int[np.ndarray, "m 3"]:
    """Two faces for each edge of each row, cut along the shorter diagonal."""
    a, b = numbers[:-1], np.roll(numbers[:-1], -1, axis=1)
    d, c = numbers[1:], np.roll(numbers[1:], -1, axis=1)
    at = places[:-1], np.roll(places[:-1], -1, axis=1), np.roll(places[1:], -1, axis=1), places[1:]
    is_first = np.linalg.norm(at[2] - at[0], axis=2) <= np.linalg.norm(at[3] - at[1], axis=2)
    # the surface's own faces run from a to b, so the new ones run from b to a
    first = np.stack([np.stack([b, a, c], axis=2), np.stack([a, d, c], axis=2)], axis=2)
    second = np.stack([np.stack([b, a, d], axis=2), np.stack([b, d, c], axis=2)], axis=2)
    return np.where(is_first[:, :, None, None], first, second).reshape(-1, 3)


def _beside(faces: np.ndarray, ring: np.ndarray) -> Int[np.ndarray, "l"]:
    """The face at each edge of an opening."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    owner = {tuple(side): k // 3 for k, side in enumerate(sides.tolist())}
    edges = zip(ring.tolist(), np.roll(ring, -1).tolist(), strict=True)
    return np.array([owner[edge] for edge in edges])
