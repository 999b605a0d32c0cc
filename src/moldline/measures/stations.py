"""Places of a wing's section at a station, or of an airfoil, by side and fraction of the chord."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from jaxtyping import Float, Int

from ..errors import GeometryError, ParameterError
from ..mesh import Geometry, Section, Surface, planform, slices
from ..numerics.nearest import nearest
from .needs import faces_of, surface_of

Side: TypeAlias = Literal["upper", "lower"]
Foot: TypeAlias = tuple[tuple[int, ...], tuple[float, ...]]
"""Numbers of points, and their weights."""

SAME = 1e-6
"""Places this near to each other, in chords, are one."""


@dataclass(frozen=True)
class Station:
    """A section, with the chord line from its leading to its trailing edge.

    Attributes
    ----------
    points, cells
        All points, and the faces or segments that the section runs through.
    pieces
        Its pieces of line, from end to end [m].
    leading, trailing
        Ends of the chord [m]; of a blunt trailing edge, the middle of the base.
    up
        Across the chord, in the plane of the section.
    """

    points: Float[np.ndarray, "n 3"]
    cells: Int[np.ndarray, "m c"]
    pieces: Float[np.ndarray, "p 2 3"]
    leading: Float[np.ndarray, "3"]
    trailing: Float[np.ndarray, "3"]
    up: Float[np.ndarray, "3"]

    def foot(self, fraction: float, side: str) -> Foot:
        """What of which points lies at a fraction of the chord on a side."""
        return foot(self.points, self.cells, self.place(fraction, side))

    def place(self, fraction: float, side: str) -> Float[np.ndarray, "3"]:
        """Where it is [m]; 0 is the leading edge, 1 the trailing edge or a corner of its base."""
        if side not in ("upper", "lower"):
            raise ParameterError(f"a side is upper or lower, got {side!r}")
        if not 0 <= fraction <= 1:
            raise ParameterError(f"a fraction of the chord lies in 0 to 1, got {fraction}")
        if fraction == 0:
            return self._nose()
        sign = 1.0 if side == "upper" else -1.0
        if fraction == 1:
            corners = self._corners()
            return corners[int(np.argmax(sign * (corners @ self.up)))]
        run = self.trailing - self.leading
        ahead = (self.pieces - self.leading) @ run / (run @ run) - fraction
        crosses = (ahead[:, 0] > 0) != (ahead[:, 1] > 0)
        if not crosses.any():
            raise ParameterError(
                f"the section has no {side} side at {fraction} of the chord from "
                f"{self.leading.tolist()} to {self.trailing.tolist()}"
            )
        start, end = ahead[crosses].T
        share = (start / (start - end))[:, None]
        places = (1 - share) * self.pieces[crosses, 0] + share * self.pieces[crosses, 1]
        return places[int(np.argmax(sign * (places @ self.up)))]

    def _nose(self) -> Float[np.ndarray, "3"]:
        """The place of the section that is nearest to its leading edge, which may lie before it."""
        start, run = self.pieces[:, 0], self.pieces[:, 1] - self.pieces[:, 0]
        square = np.sum(run**2, axis=1)
        share = np.sum((self.leading - start) * run, axis=1) / np.where(square > 0, square, 1.0)
        places = start + np.clip(share, 0.0, 1.0)[:, None] * run
        return places[int(np.linalg.norm(places - self.leading, axis=1).argmin())]

    def _corners(self) -> Float[np.ndarray, "c 3"]:
        """Both of a blunt base, which lie opposite each other about its middle; else the edge."""
        chord = float(np.linalg.norm(self.trailing - self.leading))
        ends = self.pieces.reshape(-1, 3)
        gaps = np.linalg.norm(ends - self.trailing, axis=1)
        near = ends[gaps <= planform.BASE * chord]
        misses = np.linalg.norm(near[:, None] + near - 2 * self.trailing, axis=2)
        one, other = np.nonzero(misses <= SAME * chord)
        if not len(one):
            return self.trailing[None]
        widest = int(np.linalg.norm(near[one] - near[other], axis=1).argmax())
        return near[[one[widest], other[widest]]]


def station(
    geometry: Geometry, at: float | None = None, component: str | None = None, what: str = "a chord"
) -> Station:
    """The section of a wing at y = `at`, or an airfoil itself."""
    if isinstance(geometry, Section):
        if at is not None or component is not None:
            raise ParameterError(f"a section has no stations and no components, got at = {at}")
        points, cells = np.asarray(geometry.points, float), geometry.segments
        lines = [points[np.append(cells[:, 0], cells[-1, 1])]]
        leading, trailing = planform._edges(lines)
        return _station(points, cells, lines, leading, trailing)
    if at is None:
        raise ParameterError(f"{what} of a wing needs the station: say at which y, with `at`")
    surface = surface_of(geometry, what)
    points = np.asarray(surface.points, float)
    faces = np.asarray(faces_of(surface, component, what))
    leading, trailing = _edges(surface, at, component)
    height = points[faces, 1] - at
    close = slices.NEAR * float(np.ptp(points[faces, 1]))
    cells = faces[(height.min(axis=1) <= close) & (height.max(axis=1) >= -close)]
    lines = slices.section(points, faces, "y", at)
    return _station(points, cells, lines, leading, trailing)


def foot(
    points: Float[np.ndarray, "n 3"],
    cells: Int[np.ndarray, "m c"],
    place: Float[np.ndarray, "3"],
) -> Foot:
    """The nearest point of faces or segments to a place."""
    if cells.shape[1] == 3:
        found = nearest(place[None], points, cells)
        corners, weights = cells[found.faces[0]], found.weights[0]
    else:
        start, end = points[cells[:, 0]], points[cells[:, 1]]
        run = end - start
        square = np.sum(run**2, axis=1)
        share = np.sum((place - start) * run, axis=1) / np.where(square > 0, square, 1.0)
        share = np.clip(share, 0.0, 1.0)
        best = int(np.linalg.norm(start + share[:, None] * run - place, axis=1).argmin())
        corners, weights = cells[best], np.array([1 - share[best], share[best]])
    weights = np.where(weights > 1e-12, weights, 0.0)
    own = weights > 0
    weights = weights[own] / weights.sum()
    return tuple(corners[own].tolist()), tuple(weights.tolist())


def _station(
    points: np.ndarray,
    cells: np.ndarray,
    lines: list[np.ndarray],
    leading: np.ndarray,
    trailing: np.ndarray,
) -> Station:
    pieces = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    plane = int(np.argmin(np.ptp(pieces.reshape(-1, 3), axis=0)))  # the section lies across it
    run = trailing - leading
    up = np.zeros(3)
    up[0], up[3 - plane] = -run[3 - plane], run[0]
    return Station(points, cells, pieces, leading, trailing, up / np.linalg.norm(up))


def _edges(surface: Surface, at: float, component: str | None) -> tuple[np.ndarray, np.ndarray]:
    """Leading and trailing edge; the left side of a whole wing is read as a right one."""
    side = -1.0 if at < 0 else 1.0
    mirrored = Surface(
        np.asarray(surface.points) * np.array([1.0, side, 1.0]),
        surface.faces,
        surface.tags,
        surface.components,
    )
    try:
        found = planform.planform(mirrored if side < 0 else surface, [abs(at)], component)
    except GeometryError as problem:
        raise ParameterError(f"no chord at y = {at:g}: {problem}") from None
    return tuple(edge[0] * np.array([1.0, side, 1.0]) for edge in (found.leading, found.trailing))
