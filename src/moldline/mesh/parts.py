"""The parts of a surface, by component and by piece: area, volume, closedness, side."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from . import quality, topology
from .surface import Surface


@dataclass(frozen=True)
class Part:
    """Some of a surface's faces, taken alone."""

    name: str
    """Of the component, or the number of the piece, from 0."""
    faces: int
    area: float
    """[m²] if the coordinates are in m."""
    is_closed: bool
    """Whether none of its edges belongs to one of its faces only."""
    volume: float | None
    """[m³], negative where faces look inward; None if the part is open or badly oriented."""


def components(surface: Surface) -> tuple[Part, ...]:
    """Each named component taken alone; what another component closes is then open."""
    return _parts(surface, np.asarray(surface.tags), surface.components)


def pieces(surface: Surface) -> tuple[Part, ...]:
    """Each piece that no edge joins to the rest."""
    number, piece = topology.pieces(surface.faces)
    return _parts(surface, piece, tuple(map(str, range(number))))


def inside_out_pieces(surface: Surface) -> Int[np.ndarray, "p"]:
    """Closed pieces whose faces look inward; those that lie inside another are cavities."""
    volumes = np.array([*(part.volume or 0.0 for part in pieces(surface)), 0.0])  # last: no piece
    _, piece = topology.pieces(surface.faces)
    corners = np.asarray(surface.points)[np.asarray(surface.faces)]
    is_closed = volumes[piece] != 0
    walls, owner = corners[is_closed], piece[is_closed]
    low, high = (np.full((len(volumes), 3), end) for end in (np.inf, -np.inf))
    np.minimum.at(low, owner, walls.min(axis=1))
    np.maximum.at(high, owner, walls.max(axis=1))
    found = []
    for number in np.flatnonzero(volumes < 0).tolist():
        place = walls[np.argmax(owner == number), 0]
        is_around = np.all((low <= place) & (place <= high), axis=1)
        is_around[number] = False
        near = np.flatnonzero(is_around[owner])
        windings = np.bincount(owner[near], _angles(place, walls[near])) / (4 * np.pi)
        if np.all(np.abs(windings) < 0.5):
            found.append(number)
    return np.array(found, int)


def _parts(
    surface: Surface, label: Int[np.ndarray, "m"], names: tuple[str, ...]
) -> tuple[Part, ...]:
    is_part = label >= 0
    label, faces = label[is_part].astype(np.int64), np.asarray(surface.faces)[is_part]
    points, count = np.asarray(surface.points), len(names)
    areas = np.bincount(label, quality.face_areas(surface)[is_part], count)
    edges, of_edge = _own_edges(faces, label, len(points))
    opened = np.bincount(of_edge[edges.uses == 1], minlength=count)
    odd = np.bincount(of_edge[edges.uses != 2 * edges.forward], minlength=count)
    origin = np.zeros((count, 3))
    origin[label[::-1]] = points[faces[::-1, 0]]  # near the part, or digits would cancel
    a, b, c = (points[faces[:, i]] - origin[label] for i in range(3))
    volumes = np.bincount(label, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, count)
    sizes = np.bincount(label, minlength=count)
    return tuple(
        Part(name, size, area, not is_open, None if is_odd or not size else volume)
        for name, size, area, is_open, is_odd, volume in zip(
            names,
            sizes.tolist(),
            areas.tolist(),
            (opened > 0).tolist(),
            (odd > 0).tolist(),
            volumes.tolist(),
            strict=True,
        )
    )


def _own_edges(
    faces: np.ndarray, label: np.ndarray, count: int
) -> tuple[topology.Edges, np.ndarray]:
    """Edges of each part as if it had its own points, and the part of each."""
    point, own = np.unique(label[:, None] * count + faces, return_inverse=True)
    edges = topology.edges(own.reshape(-1, 3))
    return edges, point[edges.ends[:, 0]] // max(count, 1)


def _angles(
    place: Float[np.ndarray, "3"], corners: Float[np.ndarray, "m 3 3"]
) -> Float[np.ndarray, "m"]:
    """Solid angles under which triangles are seen; van Oosterom and Strackee, 1983."""
    a, b, c = np.moveaxis(corners - place, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    above = np.einsum("ij,ij->i", a, np.cross(b, c))
    ab, bc, ca = (np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a)))
    return 2 * np.arctan2(above, la * lb * lc + ab * lc + bc * la + ca * lb)
