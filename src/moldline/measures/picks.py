"""Places and regions of a geometry, as case files name them."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int
from typing_extensions import TypedDict

from ..errors import ParameterError
from ..mesh import Geometry
from .needs import faces_of
from .spot import Spot
from .stations import Side, Station, station

Point = tuple[float, float, float]


class Place(TypedDict, total=False):
    """One place: a vertex, the nearest point to coordinates, or by chord fraction and side."""

    __pydantic_config__ = {"extra": "forbid"}  # type: ignore[misc]  # noqa: RUF012

    vertex: int
    near: Point
    chord: float
    side: Side
    at: float
    component: str


class Region(TypedDict, total=False):
    """Vertices for which all holds that is said: numbers, in a box, in a ball, in a component."""

    __pydantic_config__ = {"extra": "forbid"}  # type: ignore[misc]  # noqa: RUF012

    vertices: list[int]
    inside: tuple[Point, Point]
    near: Point
    radius: float
    component: str


_GOES_WITH = {"vertex": (), "near": ("component",), "chord": ("side", "at", "component")}


def spot(geometry: Geometry, place: Place) -> Spot:
    """The spot that a place names."""
    ways = [key for key in _GOES_WITH if key in place]
    if len(ways) != 1:
        raise ParameterError(
            f"a place is one of vertex, near and chord, got {', '.join(place) or 'none of them'}"
        )
    odd = [key for key in place if key not in (ways[0], *_GOES_WITH[ways[0]])]
    if odd:
        raise ParameterError(f"a place by {ways[0]} does not take {', '.join(odd)}")
    if "vertex" in place:
        _check_numbers(geometry, [place["vertex"]])
        return Spot.vertex(place["vertex"])
    if "near" in place:
        return _near(geometry, place["near"], place.get("component"))
    if "side" not in place:
        raise ParameterError("a place by chord needs its side, upper or lower")
    return Spot.at_chord(
        geometry, place["chord"], place["side"], place.get("at"), place.get("component")
    )


def region(geometry: Geometry, where: Region) -> Int[np.ndarray, "v"]:
    """Numbers of the vertices of a region, ascending."""
    odd = [key for key in where if key not in Region.__annotations__]
    if odd or not where:
        raise ParameterError(
            "a region is said by vertices, inside, near and radius, or component, got "
            + (", ".join(odd) or "none of them")
        )
    if ("near" in where) != ("radius" in where):
        raise ParameterError("a region in a ball needs both near and radius")
    points = np.asarray(geometry.points)
    chosen = np.ones(len(points), bool)
    if "component" in where:
        named = faces_of(geometry, where["component"], "a component")
        chosen &= np.isin(np.arange(len(points)), named)
    if "vertices" in where:
        _check_numbers(geometry, where["vertices"])
        chosen &= np.isin(np.arange(len(points)), where["vertices"])
    if "inside" in where:
        low, high = _corners(where["inside"])
        chosen &= np.all((low <= points) & (points <= high), axis=1)
    if "near" in where:
        if not where["radius"] >= 0:
            raise ParameterError(f"a radius is not negative, got {where['radius']}")
        chosen &= np.linalg.norm(points - np.asarray(where["near"]), axis=1) <= where["radius"]
    if not chosen.any():
        raise ParameterError(f"no vertex is in the region {dict(where)}; {reach(geometry)}")
    return np.flatnonzero(chosen)


def spots(
    geometry: Geometry, places: Sequence[Place] | None, where: Region | None, what: str
) -> list[Spot]:
    """Spots at places, then those at all vertices of a region."""
    if places is None and where is None:
        raise ParameterError(f"{what} needs spots, or a region")
    found = [spot(geometry, place) for place in places or ()]
    return found + ([Spot.vertex(n) for n in region(geometry, where)] if where else [])


def row(
    geometry: Geometry, chord: float, side: Side, at: Sequence[float], component: str | None
) -> list[Spot]:
    """Spots at a fraction of the chord at each of some stations."""
    return [Spot(*station(geometry, y, component).foot(chord, side)) for y in at]


def chord_ends(
    geometry: Geometry, at: float | None, component: str | None, what: str
) -> tuple[Spot, Spot]:
    """Leading and trailing edge of a section, of a blunt one the middle of the base."""
    return ends_of(station(geometry, at, component, what))


def ends_of(cut: Station) -> tuple[Spot, Spot]:
    """The same of a section at hand."""
    corners = [Spot(*cut.foot(1.0, side)) for side in ("lower", "upper")]
    return Spot(*cut.foot(0.0, "upper")), Spot.middle(corners)


def reach(geometry: Geometry) -> str:
    """How far a geometry reaches, in words."""
    points = np.asarray(geometry.points)
    low, high = ([f"{x:.6g}" for x in end] for end in (points.min(axis=0), points.max(axis=0)))
    return f"the geometry reaches from ({', '.join(low)}) to ({', '.join(high)})"


def _near(geometry: Geometry, place: Point, component: str | None) -> Spot:
    found, points = Spot.nearest(geometry, place, component), np.asarray(geometry.points)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if np.linalg.norm(found.of(points) - np.asarray(place)) > size:
        raise ParameterError(f"nothing is near {tuple(place)}; {reach(geometry)}")
    return found


def _corners(inside: tuple[Point, Point]) -> tuple[np.ndarray, np.ndarray]:
    low, high = np.asarray(inside[0], float), np.asarray(inside[1], float)
    if not np.all(low <= high):
        raise ParameterError(f"a box is its lowest and its highest corner, got {inside}")
    return low, high


def _check_numbers(geometry: Geometry, numbers: Sequence[int]) -> None:
    count = len(geometry.points)
    for number in numbers:
        if not 0 <= number < count:
            raise ParameterError(
                f"vertex {number} is not there; the geometry has {count}, counted from 0"
            )
