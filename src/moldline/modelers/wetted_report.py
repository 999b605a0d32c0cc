"""What a union made: figures, and the same in sentences."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..mesh import Surface, quality, topology

ALTITUDE = 0.01
"""A face is a sliver if its smallest altitude is below this part of its longest side, unless told
otherwise."""


@dataclass(frozen=True, eq=False)
class WettedReport:
    """The wetted surface in figures."""

    components: dict[str, int]
    """Faces of each component."""
    points: int
    faces: int
    kept: int
    """Points that are points of the components, to the bit."""
    on_edges: int
    """Points where an edge of a component runs through a face of another."""
    on_triples: int
    """Points where faces of three components meet."""
    area: float
    """[m²]"""
    volume: float
    """[m³]; of a half model, that between the surface and the symmetry plane."""
    is_watertight: bool
    """Whether each edge belongs to two faces, or lies in the symmetry plane where there is one."""
    openings: int
    """Loops in the symmetry plane."""
    genus: int
    """Handles of all pieces together; openings count as closed."""
    pieces: int
    """Parts that no edge joins."""
    residual: float
    """How far the formulas are from the boolean's own points at most [m]."""
    cut: int
    """Faces that are no face of a component, but a part of one."""
    slivers: int
    """Those among them whose smallest altitude is below `limit` of their longest side."""
    given_slivers: int
    """As many whole faces of the components, which are as they were given."""
    smallest_altitude: float
    """The least of those parts among the faces that were cut."""
    limit: float = ALTITUDE
    """Below which a face is a sliver."""
    notes: tuple[str, ...] = ()
    """What else was done or seen."""

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self) | {"notes": list(self.notes)}

    def sentences(self) -> list[str]:
        """What was made, and what to look at."""
        names = ", ".join(f"{name} ({count} faces)" for name, count in self.components.items())
        closed = (
            f"open in the symmetry plane only ({self.openings} loops)"
            if self.openings and self.is_watertight
            else "watertight"
            if self.is_watertight
            else "NOT watertight"
        )
        return [
            f"wetted surface of {names}: {self.points} points, {self.kept} of them the "
            f"components' own to the bit, {self.on_edges} where an edge runs through a face, "
            f"{self.on_triples} where three faces meet",
            f"{closed}, {_counted(self.pieces, 'piece')}, genus {self.genus}, area "
            f"{self.area:.8g}, volume {self.volume:.8g}",
            f"formulas and boolean differ by {self.residual:.2g} at most",
            f"of {self.cut} faces that were cut {self.slivers} are slivers, of an altitude below "
            f"{self.limit:g} of the longest side (least {self.smallest_altitude:.2g}); of those "
            f"that were not {self.given_slivers} are",
            *self.notes,
        ]


def reported(
    surface: Surface,
    counts: tuple[int, int, int],
    residual: float,
    is_cut: np.ndarray,
    axis: int | None,
    limit: float,
    notes: tuple[str, ...],
) -> WettedReport:
    """Measure a wetted surface; `counts` are its points of each kind."""
    edges = topology.edges(surface.faces)
    loops = topology.boundary_loops(surface.faces)
    pieces, _ = topology.pieces(surface.faces)
    points = np.asarray(surface.points)
    in_plane = axis is not None and bool(_nearly_zero(points, edges.open, axis))
    is_watertight = (not len(edges.open) or in_plane) and bool(
        np.all(edges.uses <= 2) and not len(edges.misoriented)
    )
    used = len(np.unique(surface.faces))
    euler = used - len(edges.ends) + len(surface.faces) + len(loops)
    shares = altitudes(points, np.asarray(surface.faces))
    tags = np.bincount(np.asarray(surface.tags), minlength=len(surface.components))
    return WettedReport(
        components=dict(zip(surface.components, tags.tolist(), strict=True)),
        points=len(points),
        faces=len(surface.faces),
        kept=counts[0],
        on_edges=counts[1],
        on_triples=counts[2],
        area=quality.area(surface),
        volume=_volume(points, np.asarray(surface.faces)),
        is_watertight=is_watertight,
        openings=len(loops),
        genus=pieces - euler // 2,
        pieces=pieces,
        residual=residual,
        cut=int(is_cut.sum()),
        slivers=int(np.sum(shares[is_cut] < limit)),
        given_slivers=int(np.sum(shares[~is_cut] < limit)),
        smallest_altitude=float(shares[is_cut].min(initial=1.0)),
        limit=limit,
        notes=notes,
    )


def altitudes(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The smallest altitude of each face by its longest side, 0 to sqrt(3)/2; 0 without area."""
    a, b, c = (points[faces[:, i]] for i in range(3))
    longest = np.max([np.einsum("ij,ij->i", s, s) for s in (b - a, c - b, a - c)], axis=0)
    twice_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return twice_area / np.where(longest > 0, longest, 1.0)


def _volume(points: np.ndarray, faces: np.ndarray) -> float:
    """Against the origin, as openings lie in a plane through it."""
    a, b, c = (points[faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def _nearly_zero(points: np.ndarray, ends: np.ndarray, axis: int) -> bool:
    extent = np.linalg.norm(np.ptp(points, axis=0))
    return bool(np.all(np.abs(points[ends, axis]) <= 2e-6 * extent))


def _counted(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
