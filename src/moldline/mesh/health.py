"""What is wrong with a surface: counts, places and sentences."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._types import Array
from . import quality, topology
from .surface import Surface


@dataclass(frozen=True)
class Health:
    """What a surface is made of and what is wrong with it.

    Places are numbers of points or faces, from 0.
    """

    points: int
    faces: int
    components: tuple[str, ...]
    pieces: int
    """Parts that no edge joins."""
    open_edges: np.ndarray
    holes: tuple[np.ndarray, ...]
    """The loops of open edges, as points in order."""
    nonmanifold_edges: np.ndarray
    nonmanifold_vertices: np.ndarray
    misoriented_edges: np.ndarray
    duplicate_vertices: np.ndarray
    duplicate_faces: np.ndarray
    degenerate_faces: np.ndarray
    unused_vertices: np.ndarray
    smallest_angle: float
    """Of all faces [rad]."""
    area: float
    """[m²] if the coordinates are in m."""
    volume: float | None
    """[m³], negative where faces look inward; None if the surface is open or badly oriented."""
    box: tuple[tuple[float, ...], tuple[float, ...]]

    @property
    def is_closed(self) -> bool:
        """Whether no edge belongs to one face only."""
        return len(self.open_edges) == 0

    @property
    def is_manifold(self) -> bool:
        """Whether the faces around every point form one fan, and no edge has three."""
        return len(self.nonmanifold_edges) == 0 and len(self.nonmanifold_vertices) == 0

    @property
    def is_oriented(self) -> bool:
        """Whether neighbouring faces show the same side."""
        return len(self.misoriented_edges) == 0

    @property
    def is_inside_out(self) -> bool:
        """Whether the faces of a closed surface look inward."""
        return self.volume is not None and self.volume < 0

    @property
    def is_sound(self) -> bool:
        """Whether there is nothing to complain of."""
        return not self.sentences()

    def as_dict(self, places: int = 10) -> dict[str, Any]:
        """Plain values for JSON: every count, and up to `places` places of each kind."""
        faults = {name: getattr(self, name) for name in _FAULTS}
        return {
            "points": self.points,
            "faces": self.faces,
            "components": list(self.components),
            "pieces": self.pieces,
            "is_closed": self.is_closed,
            "is_manifold": self.is_manifold,
            "is_oriented": self.is_oriented,
            "is_inside_out": self.is_inside_out,
            "holes": len(self.holes),
            "counts": {name: len(found) for name, found in faults.items()},
            "places": {name: found[:places].tolist() for name, found in faults.items()},
            "smallest_angle_deg": float(np.degrees(self.smallest_angle)),
            "area": self.area,
            "volume": self.volume,
            "box": [list(corner) for corner in self.box],
        }

    def sentences(self) -> list[str]:
        """Each complaint as a sentence, with its first place; empty if there is none."""
        found = [_sentence(name, getattr(self, name)) for name in _FAULTS]
        told = [sentence for sentence in found if sentence]
        if self.is_inside_out:
            told.append(f"the faces look inward: the volume is {self.volume:.6g}")
        return told


_FAULTS = {
    "open_edges": "edge{s} belong{v} to one face only; the surface is open",
    "nonmanifold_edges": "edge{s} belong{v} to more than two faces",
    "nonmanifold_vertices": "point{s} join{v} fans of faces that share no edge",
    "misoriented_edges": "edge{s} separate{v} faces that show different sides",
    "duplicate_vertices": "point{s} lie{v} where an earlier one does",
    "duplicate_faces": "face{s} repeat{v} an earlier one",
    "degenerate_faces": "face{s} ha{h} no area",
    "unused_vertices": "point{s} belong{v} to no face",
}


def health(surface: Surface) -> Health:
    """Look for everything that could trouble a flow solver."""
    faces, points = np.asarray(surface.faces), np.asarray(surface.points)
    edges = topology.edges(faces)
    odd = edges.uses != 2 * edges.forward  # for closed surfaces: both directions equally often
    low, high = quality.bounding_box(points).tolist()
    return Health(
        points=len(points),
        faces=len(faces),
        components=surface.components,
        pieces=topology.pieces(faces)[0],
        open_edges=edges.open,
        holes=tuple(topology.boundary_loops(faces)),
        nonmanifold_edges=edges.nonmanifold,
        nonmanifold_vertices=topology.nonmanifold_vertices(faces),
        misoriented_edges=edges.misoriented,
        duplicate_vertices=topology.duplicate_points(points),
        duplicate_faces=topology.duplicate_faces(faces),
        degenerate_faces=quality.degenerate_faces(surface),
        unused_vertices=_unused(faces, len(points)),
        smallest_angle=float(quality.smallest_angles(surface).min(initial=np.pi / 3)),
        area=quality.area(surface),
        volume=None if odd.any() or not len(faces) else quality.signed_volume(surface),
        box=(tuple(low), tuple(high)),
    )


def _unused(faces: Array, count: int) -> np.ndarray:
    is_used = np.zeros(count, bool)
    is_used[np.ravel(faces)] = True
    return np.flatnonzero(~is_used)


def _sentence(name: str, found: np.ndarray) -> str:
    if not len(found):
        return ""
    one = len(found) == 1
    text = _FAULTS[name].format(s="" if one else "s", v="s" if one else "", h="s" if one else "ve")
    first = np.ravel(found[0]).tolist()
    return f"{len(found)} {text} (first: {' and '.join(map(str, first))})"
