"""The planform of a wing, read from its surface."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from ..errors import GeometryError, ParameterError
from . import topology
from .slices import NEAR, section
from .surface import Surface

Places: TypeAlias = Sequence[float] | Float[np.ndarray, "_"]

CLOSE = 1e-6
"""Points of a section this near to each other, in its size, count as one."""

BASE = 0.05
"""Largest height of a blunt trailing edge, in chords."""

BEND = np.radians(45)
"""A section that turns by more than this at a point has a corner there."""

SHARP = np.radians(90)
"""A leading edge at which a section turns by more than this is not round."""

MOST = 1000
"""Stations."""

INSETS = (0.0, 0.005, 0.01, 0.02, 0.03, 0.05)
"""How far from an end, in spans, the outermost section may have to be."""

STEP, MISS = 0.02, 0.02
"""A section belongs to the wing's run, not to a cap or a cut-out, where its chord is that which
those one and two steps further in lead one to expect, but for this part of the largest one."""


@dataclass(frozen=True)
class Planform:
    """Leading and trailing edges of a wing at stations along y; x is streamwise, z up.

    The chord of a section runs from its trailing edge, the middle of the base where that is blunt,
    to the farthest point, the leading edge. Panels lie between neighbouring stations.
    """

    stations: Float[np.ndarray, "s"]
    """Places along y, from the root to the tip [m]."""
    leading: Float[np.ndarray, "s 3"]
    """[m]"""
    trailing: Float[np.ndarray, "s 3"]
    """[m]"""
    low: Float[np.ndarray, "s"]
    """Smallest z of each section [m]."""
    high: Float[np.ndarray, "s"]
    """Largest z of each section [m]."""

    @property
    def chord(self) -> Float[np.ndarray, "s"]:
        """Distance of the trailing from the leading edge [m]."""
        return np.linalg.norm(self.trailing - self.leading, axis=1)

    @property
    def twist(self) -> Float[np.ndarray, "s"]:
        """Angle of the chord to x, positive nose up: a right-handed turn about +y [rad]."""
        run = self.trailing - self.leading
        return np.arctan2(-run[:, 2], run[:, 0])

    @property
    def sweep(self) -> Float[np.ndarray, "p"]:
        """Of each panel's leading edge, positive aft [rad]."""
        return self.sweep_at(0.0)

    @property
    def dihedral(self) -> Float[np.ndarray, "p"]:
        """Of each panel's quarter-chord line, positive up [rad]."""
        return self.dihedral_at(0.25)

    def quarter(self, fraction: float = 0.25) -> Float[np.ndarray, "s 3"]:
        """Points at a fraction of each chord, from the leading edge [m]."""
        return self.leading + fraction * (self.trailing - self.leading)

    def sweep_at(self, fraction: float) -> Float[np.ndarray, "p"]:
        """Of each panel's line at a fraction of the chord, positive aft [rad]."""
        return self._slope(fraction, 0)

    def dihedral_at(self, fraction: float) -> Float[np.ndarray, "p"]:
        """Of each panel's line at a fraction of the chord, positive up [rad]."""
        return self._slope(fraction, 2)

    def _slope(self, fraction: float, axis: int) -> Float[np.ndarray, "p"]:
        run = np.diff(self.quarter(fraction), axis=0)
        return np.arctan2(run[:, axis], np.abs(run[:, 1]))


def planform(
    surface: Surface,
    stations: int | Places = 9,
    component: str | None = None,
) -> Planform:
    """Read a wing's planform; x is streamwise, y along the span, z up.

    Half wings (y >= 0 or y <= 0) and whole ones, symmetric about y = 0, whose stations are those of
    y >= 0. A number of stations spreads them evenly over the span, from the first to the last
    section that is a whole one: a rounded or pointed tip lies beyond the last.

    Raises
    ------
    GeometryError
        Where the surface is no wing along y, or has no section at a station.
    """
    wing = _Wing(surface, component)
    if isinstance(stations, int):
        if not 2 <= stations <= MOST:
            raise ParameterError(f"stations are 2 to {MOST}, or places along y, got {stations}")
        places = np.linspace(*wing.ends(), stations)
    else:
        places = wing.side * np.array(stations, float)
        if places.ndim != 1 or not 0 < len(places) <= MOST or not np.all(np.diff(places) > 0):
            raise ParameterError(
                "stations are places along y from the root outwards, got "
                f"{(wing.side * places).tolist()}"
            )
    sections = [wing.section(at) for at in places.tolist()]
    edges = np.array([_edges(lines) for lines in sections])
    heights = [np.concatenate(lines)[:, 2] for lines in sections]
    edges[..., 1] *= wing.side
    return Planform(
        wing.side * places,
        edges[:, 0],
        edges[:, 1],
        np.array([z.min() for z in heights]),
        np.array([z.max() for z in heights]),
    )


class _Wing:
    """The triangles of one side of a wing, mirrored if need be so that its span runs up y."""

    def __init__(self, surface: Surface, component: str | None):
        kept, index = topology.weld(np.asarray(surface.points))
        self.faces = index[np.asarray(surface.faces)]
        self.points = np.array(np.asarray(surface.points)[kept])
        if component is not None:
            surface.component(component)  # refuses an unknown one
            own = np.asarray(surface.tags) == surface.components.index(component)
            self.faces = self.faces[own]
        used = self.points[np.unique(self.faces)]
        if not len(used) or not np.isfinite(used).all():
            raise GeometryError("a planform needs triangles whose points are finite")
        extent = np.ptp(used, axis=0)
        if extent[1] < extent[2] or 8 * extent[1] < extent[0]:
            raise GeometryError(
                f"the wing reaches over {extent[0]:.4g} along x, {extent[1]:.4g} along y and "
                f"{extent[2]:.4g} along z: its span must run along y, with x streamwise and z up"
            )
        self.side = 1.0
        low, high = used[:, 1].min(), used[:, 1].max()
        if high <= NEAR * extent[1]:
            self.side, low, high = -1.0, -high, -low
            self.points[:, 1] *= -1
        if low < -NEAR * extent[1]:
            if abs(low + high) > 0.01 * extent[1]:
                raise GeometryError(
                    f"the wing reaches from y = {low:.6g} to {high:.6g}: it must be a half one or "
                    "symmetric about y = 0"
                )
            low = 0.0
        self.low, self.high = max(float(low), 0.0), float(high)
        self.near = NEAR * (self.high - self.low)

    def section(self, at: float) -> list[np.ndarray]:
        """The polylines of a section."""
        if not self.low - self.near <= at <= self.high + self.near:
            ends = sorted([self.side * self.low, self.side * self.high])
            raise GeometryError(
                f"there is no section at y = {self.side * at:.6g}; the wing reaches from "
                f"y = {ends[0]:.6g} to {ends[1]:.6g}"
            )
        lines = section(self.points, self.faces, "y", at)
        if not lines or not _size(lines) > self.near:
            raise GeometryError(
                f"there is no section at y = {self.side * at:.6g}; the surface has a gap or ends "
                "in a point there"
            )
        return lines

    def ends(self) -> tuple[float, float]:
        """The first and the last place with a whole section."""
        span = self.high - self.low
        return self._end(self.low, span), self._end(self.high, -span)

    def _end(self, end: float, span: float) -> float:
        for inset in INSETS:
            chords = [self._chord(end + (inset + k * STEP) * span) for k in range(3)]
            least = MISS * max(chords)
            if abs(chords[0] - 2 * chords[1] + chords[2]) <= least < chords[0]:
                break
        return end + inset * span

    def _chord(self, at: float) -> float:
        try:
            leading, trailing = _edges(self.section(at))
        except GeometryError:
            return 0.0
        return float(np.linalg.norm(trailing - leading))


def _size(lines: list[np.ndarray]) -> float:
    return float(np.ptp(np.concatenate(lines), axis=0).max())


def _edges(lines: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Leading and trailing edge of a section.

    They are its farthest pair of points, found in steps; then the trailing edge is the middle of a
    blunt base, and the leading edge the point of a round nose that is farthest from there. What
    turns and scales a section turns and scales them.
    """
    places, before, after = _linked(lines)
    aft = int(np.argmax(places[:, 0]))
    for _ in range(4):
        fore = _farthest(places, places[aft])
        aft = _farthest(places, places[fore])
    if places[fore, 0] > places[aft, 0]:
        fore, aft = aft, fore
    trailing = _base(places, before, after, fore, aft)
    fore = _farthest(places, trailing)
    if _bend(places, before, after)[fore] > SHARP:
        return places[fore], trailing
    ways = (before, after)
    # at the same distance to both sides: a cut has points where it crosses diagonals of the mesh
    length = max(float(np.linalg.norm(places[way[fore]] - places[fore])) for way in ways)
    one, other = (_walked(places, way, fore, length) for way in ways)
    return _nose(one, places[fore], other, trailing), trailing


def _linked(lines: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of polylines, each (p, 3), and the number before and after each; an end is its own."""
    close = CLOSE * _size(lines)
    places, before, after, count = [], [], [], 0
    for line in lines:
        is_new = np.linalg.norm(np.diff(line, axis=0), axis=1) > close
        line = line[np.concatenate([[True], is_new])]
        is_closed = len(line) > 2 and np.linalg.norm(line[0] - line[-1]) <= close
        line = line[:-1] if is_closed else line
        number = count + np.arange(len(line))
        ends = number[[-1, 0]] if is_closed else number[[0, -1]]
        places.append(line)
        before.append(np.concatenate([ends[:1], number[:-1]]))
        after.append(np.concatenate([number[1:], ends[1:]]))
        count += len(line)
    return np.concatenate(places), np.concatenate(before), np.concatenate(after)


def _walked(places: np.ndarray, way: np.ndarray, start: int, length: float) -> np.ndarray:
    """The place at a distance along a polyline, or where that ends."""
    here = start
    while way[here] not in (here, start):
        step = float(np.linalg.norm(places[way[here]] - places[here]))
        if step >= length:
            return places[here] + length / step * (places[way[here]] - places[here])
        here, length = way[here], length - step
    return places[here]


def _farthest(places: np.ndarray, place: np.ndarray) -> int:
    return int(np.argmax(np.linalg.norm(places - place, axis=1)))


def _bend(places: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """By how much a section turns at each point [rad]; it turns back where it ends."""
    one, other = places - places[before], places[after] - places
    lengths = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    cosine = np.einsum("ij,ij->i", one, other) / np.where(lengths > 0, lengths, 1.0)
    return np.arccos(np.clip(np.where(lengths > 0, cosine, -1.0), -1, 1))


def _base(
    places: np.ndarray, before: np.ndarray, after: np.ndarray, fore: int, aft: int
) -> np.ndarray:
    """The middle of a blunt base, from one corner to the other; a sharp edge is its own."""
    gap = np.linalg.norm(places - places[aft], axis=1)
    chord = np.linalg.norm(places[aft] - places[fore])
    gap[(_bend(places, before, after) < BEND) | (gap > BASE * chord)] = 0.0
    return (places[aft] + places[np.argmax(gap)]) / 2 if gap.any() else places[aft]


def _nose(
    one: np.ndarray, middle: np.ndarray, other: np.ndarray, trailing: np.ndarray
) -> np.ndarray:
    """The point, farthest from the trailing edge, of the circle through three."""
    a, b = one - middle, other - middle
    normal = np.cross(a, b)
    if not normal @ normal > 1e-12 * (a @ a) * (b @ b):
        return middle
    away = np.cross((a @ a) * b - (b @ b) * a, normal) / (2 * normal @ normal)
    centre = middle + away
    axis = centre - trailing
    return centre + np.linalg.norm(away) * axis / np.linalg.norm(axis)
