"""What is wrong with a surface: counts, places and sentences."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._types import Array
from . import parts, quality, topology
from .intersections import MOST, self_intersections
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
    by_component: tuple[parts.Part, ...]
    by_piece: tuple[parts.Part, ...]
    open_edges: np.ndarray
    holes: tuple[np.ndarray, ...]
    """The loops of open edges, as points in order."""
    nonmanifold_edges: np.ndarray
    nonmanifold_vertices: np.ndarray
    misoriented_edges: np.ndarray
    inside_out_pieces: np.ndarray
    """Closed pieces whose faces look inward, but for those inside another, which are cavities."""
    self_intersections: np.ndarray
    """Pairs of faces that cross, overlap, or touch inside at least one of them."""
    folded_faces: np.ndarray
    """Faces of which all neighbours face the other way."""
    duplicate_vertices: np.ndarray
    duplicate_faces: np.ndarray
    """Faces that repeat an earlier one in the same sense."""
    back_to_back_faces: np.ndarray
    """Faces that lie on an earlier one in the other sense."""
    degenerate_faces: np.ndarray
    unused_vertices: np.ndarray
    infinite_vertices: np.ndarray
    """Points with a coordinate that is no finite number."""
    slivers: np.ndarray
    """Faces with an angle below 1 degree; flow meshes have them on purpose, so no fault."""
    places: dict[str, np.ndarray]
    """Coordinates of each fault, by the name of its kind."""
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
        """Whether the faces of a closed piece look inward that is no cavity."""
        return len(self.inside_out_pieces) > 0

    @property
    def is_sound(self) -> bool:
        """Whether there is nothing to complain of."""
        return not self.sentences()

    def as_dict(self, places: int = 10) -> dict[str, Any]:
        """Plain values for JSON: every count, and up to `places` places of each kind."""
        found = {name: getattr(self, name) for name in (*_FAULTS, *_REMARKS)}
        largest = sorted(self.by_piece, key=lambda piece: -piece.area)[:places]
        return {
            "points": self.points,
            "faces": self.faces,
            "components": list(self.components),
            "by_component": [vars(part) for part in self.by_component],
            "pieces": self.pieces,
            "largest_pieces": [vars(part) for part in largest],
            "is_closed": self.is_closed,
            "is_manifold": self.is_manifold,
            "is_oriented": self.is_oriented,
            "is_inside_out": self.is_inside_out,
            "holes": len(self.holes),
            "counts": {name: len(numbers) for name, numbers in found.items()},
            "places": {name: numbers[:places].tolist() for name, numbers in found.items()},
            "near": {name: near[:places].tolist() for name, near in self.places.items()},
            "smallest_angle_deg": float(np.degrees(self.smallest_angle)),
            "area": self.area,
            "volume": self.volume,
            "box": [list(corner) for corner in self.box],
        }

    def sentences(self) -> list[str]:
        """Each complaint as a sentence, with its first place; empty if there is none."""
        return self._told(_FAULTS)

    def remarks(self) -> list[str]:
        """What may be on purpose, in sentences of the same form."""
        return self._told(_REMARKS)

    def _told(self, kinds: dict[str, str]) -> list[str]:
        told = []
        for name, text in kinds.items():
            sentence = numbered(text, getattr(self, name), self.places[name])
            if name == "self_intersections" and len(self.self_intersections) >= MOST:
                sentence = f"at least {sentence}"  # there the search stopped
            told.append(sentence)
        return [sentence for sentence in told if sentence]


_FAULTS = {
    "open_edges": "edge{s} belong{v} to one face only; the surface is open",
    "nonmanifold_edges": "edge{s} belong{v} to more than two faces",
    "nonmanifold_vertices": "point{s} join{v} fans of faces that share no edge",
    "misoriented_edges": "edge{s} separate{v} faces that show different sides",
    "inside_out_pieces": "closed piece{s} look{v} inward",
    "self_intersections": "pair{s} of faces cross{es} or overlap{v}",
    "folded_faces": "face{s} lie{v} folded over: all neighbours face the other way",
    "duplicate_vertices": "point{s} lie{v} where an earlier one does",
    "duplicate_faces": "face{s} repeat{v} an earlier one",
    "back_to_back_faces": "face{s} lie{v} back to back with an earlier one",
    "degenerate_faces": "face{s} ha{h} no area",
    "unused_vertices": "point{s} belong{v} to no face",
    "infinite_vertices": "point{s} ha{h} a coordinate that is not finite",
}

_REMARKS = {"slivers": "face{s} ha{h} an angle below 1 degree"}


@np.errstate(invalid="ignore", over="ignore")  # coordinates may be infinite, which is told
def health(surface: Surface) -> Health:
    """Look for everything that could trouble a flow solver."""
    faces, points = np.asarray(surface.faces), np.asarray(surface.points)
    edges = topology.edges(faces)
    by_piece = parts.pieces(surface)
    volumes = [piece.volume for piece in by_piece]
    low, high = quality.bounding_box(points).tolist()
    crossing = self_intersections(points, faces)
    back_to_back = topology.back_to_back_faces(faces)
    found = {
        "open_edges": edges.open,
        "nonmanifold_edges": edges.nonmanifold,
        "nonmanifold_vertices": topology.nonmanifold_vertices(faces),
        "misoriented_edges": edges.misoriented,
        "inside_out_pieces": parts.inside_out_pieces(surface),
        "self_intersections": crossing.pairs,
        "folded_faces": quality.folded_faces(surface),
        "duplicate_vertices": topology.duplicate_points(points),
        "duplicate_faces": np.setdiff1d(topology.duplicate_faces(faces), back_to_back),
        "back_to_back_faces": back_to_back,
        "degenerate_faces": quality.degenerate_faces(surface),
        "unused_vertices": _unused(faces, len(points)),
        "infinite_vertices": np.flatnonzero(~np.isfinite(points).all(axis=1)),
        "slivers": quality.slivers(surface),
    }
    return Health(
        points=len(points),
        faces=len(faces),
        components=surface.components,
        pieces=len(by_piece),
        by_component=parts.components(surface),
        by_piece=by_piece,
        holes=tuple(topology.boundary_loops(faces)),
        **found,
        places=_places(surface, found) | {"self_intersections": crossing.places},
        smallest_angle=float(quality.smallest_angles(surface).min(initial=np.pi / 3)),
        area=quality.area(surface),
        volume=None if None in volumes or not volumes else quality.signed_volume(surface),
        box=(tuple(low), tuple(high)),
    )


def numbered(text: str, found: np.ndarray, places: np.ndarray | None = None) -> str:
    """A sentence that begins with a count and ends with the first place; empty if none is found."""
    if not len(found):
        return ""
    endings = ("", "s", "s", "es") if len(found) == 1 else ("s", "", "ve", "")
    text = text.format(**dict(zip(("s", "v", "h", "es"), endings, strict=True)))
    first = " and ".join(map(str, np.ravel(found[0]).tolist()))
    near = "" if places is None else " near ({:.6g}, {:.6g}, {:.6g})".format(*places[0])
    return f"{len(found)} {text} (first: {first}){near}"


def _places(surface: Surface, found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Coordinates of points, middles of edges and faces, the first corner of pieces."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    _, piece = topology.pieces(faces)
    first = np.unique(piece[piece >= 0], return_index=True)[1]
    places = {}
    for name, numbers in found.items():
        if name.endswith("vertices"):
            places[name] = points[numbers]
        elif name.endswith("edges"):
            places[name] = points[numbers].mean(axis=1)
        elif name == "inside_out_pieces":
            places[name] = points[faces[piece >= 0][first[numbers], 0]]
        elif name != "self_intersections":
            places[name] = points[faces[numbers]].mean(axis=1)
    return places


def _unused(faces: Array, count: int) -> np.ndarray:
    is_used = np.zeros(count, bool)
    is_used[np.ravel(faces)] = True
    return np.flatnonzero(~is_used)
