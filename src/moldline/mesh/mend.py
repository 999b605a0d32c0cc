"""Mending of what can be mended without guessing."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._types import Array
from ..errors import GeometryError
from . import quality, topology
from .health import numbered
from .parts import inside_out_pieces
from .surface import Surface


@dataclass(frozen=True)
class Mending:
    """What was done to a surface, and what was left because it would have been a guess.

    Numbers of points and faces are those before the mending, from 0.
    """

    welded_points: np.ndarray
    """Merged into an earlier point."""
    collapsed_faces: np.ndarray
    """Dropped because they use a point twice."""
    flat_faces: np.ndarray
    """Dropped with their piece, of which no face has area."""
    duplicate_faces: np.ndarray
    """Dropped because an earlier face has the same points in the same sense."""
    turned_faces: np.ndarray
    """Turned over."""
    unused_points: np.ndarray
    """Dropped because no face uses them."""
    left_flat_faces: np.ndarray
    """Without area, but without them their neighbours would come apart."""
    left_back_to_back_faces: np.ndarray
    """On an earlier face, in the other sense: a wall, a thin plate, or a mistake."""
    left_unorientable_faces: np.ndarray
    """On a strip that has but one side, such as Moebius's."""

    @property
    def is_change(self) -> bool:
        """Whether anything was done."""
        return any(len(getattr(self, name)) for name in _DONE)

    def sentences(self) -> list[str]:
        """What was done."""
        return _told(self, _DONE)

    def left(self) -> list[str]:
        """What was not, and why."""
        return _told(self, _LEFT)

    def as_dict(self, places: int = 10) -> dict[str, Any]:
        """Plain values for JSON: every count, and up to `places` numbers of each kind."""
        found = {name: getattr(self, name) for name in (*_DONE, *_LEFT)}
        return {
            "is_change": self.is_change,
            "counts": {name: len(numbers) for name, numbers in found.items()},
            "places": {name: numbers[:places].tolist() for name, numbers in found.items()},
        }


BULGE = 1e-3
"""A patch is nearly flat if it encloses less than this times its area to the power 3/2; a thin wing
without its root encloses 5e-3 or more."""

_REASONS = ("collapsed_faces", "duplicate_faces", "flat_faces")

_DONE = {
    "welded_points": "point{s} welded to an earlier one",
    "collapsed_faces": "face{s} dropped that used a point twice",
    "flat_faces": "face{s} dropped with a piece without area",
    "duplicate_faces": "face{s} dropped that repeated an earlier one",
    "turned_faces": "face{s} turned over",
    "unused_points": "point{s} dropped that belonged to no face",
}

_LEFT = {
    "left_flat_faces": "face{s} without area left, for the neighbours would come apart",
    "left_back_to_back_faces": "face{s} left that lie{v} back to back with an earlier one",
    "left_unorientable_faces": "face{s} left on a strip that has only one side",
}


def mended(surface: Surface, weld: float = 0.0) -> tuple[Surface, Mending]:
    """The surface without those faults that can be mended without guessing, and what was done.

    Points in one place, or within `weld` of each other [the points' unit], become one; faces that
    use a point twice or repeat another go, and points that no face uses. Neighbours that show
    different sides are made to agree on the outer one; where the surface is open that is the side
    to which it bulges, or if it is nearly flat the side of most faces. Closed pieces are made to
    look outward unless they lie inside another.

    Data, tags and components are carried along. Holes, intersections and edges of more than two
    faces stay as they are, and a sound surface comes back itself. Mending a second time changes
    nothing.
    """
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise GeometryError(
            f"{len(bad)} of {len(points)} points are not finite (first: {bad[0]}); "
            "a surface is mended only when all its points are known"
        )
    kept, index = topology.weld(points, weld)
    faces = kept[index[faces]]
    remains, dropped, is_turned, unorientable = _sorted_out(points, faces)
    faces = _turned(faces, is_turned)[remains]
    used = np.unique(faces)
    report = Mending(
        welded_points=np.setdiff1d(np.arange(len(points)), kept),
        **dropped,
        turned_faces=remains[is_turned[remains]],
        unused_points=np.setdiff1d(kept, used),
        left_flat_faces=remains[quality.degenerate_faces(Surface(points, faces))],
        left_back_to_back_faces=remains[topology.back_to_back_faces(faces)],
        left_unorientable_faces=unorientable,
    )
    if not report.is_change:
        return surface, report
    result = Surface(
        points[used],
        np.searchsorted(used, faces),
        np.asarray(surface.tags)[remains],
        surface.components,
        _rows(surface.point_data, used),
        _rows(surface.face_data, remains),
    )
    return result, report


def _sorted_out(
    points: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Faces that remain, those dropped by reason, which are turned over, which cannot be told.

    A face turned over may repeat another, and without that one neighbours may show different
    sides: it goes on until nothing is dropped.
    """
    remains = np.arange(len(faces))
    dropped = {name: np.empty(0, int) for name in _REASONS}
    is_turned = np.zeros(len(faces), bool)
    while True:
        now = Surface(points, _turned(faces, is_turned)[remains])
        unneeded = _unneeded(now)
        for name, numbers in unneeded.items():
            dropped[name] = np.union1d(dropped[name], remains[numbers])
        remains = np.delete(remains, np.concatenate([*unneeded.values()]))
        turns, is_over = _turns(points, _turned(faces, is_turned)[remains])
        is_turned[remains] ^= is_over
        if not is_over.any():
            return remains, dropped, is_turned, remains[~turns.is_orientable[turns.patch]]


def _unneeded(surface: Surface) -> dict[str, np.ndarray]:
    """Faces to drop, each for one reason."""
    faces = np.asarray(surface.faces)
    a, b, c = faces.T
    is_collapsed = (a == b) | (b == c) | (c == a)
    is_double = np.zeros(len(faces), bool)
    is_double[topology.duplicate_faces(faces)] = True
    is_double[topology.back_to_back_faces(faces)] = False
    is_flat = np.zeros(len(faces), bool)
    is_flat[quality.degenerate_faces(surface)] = True
    _, piece = topology.pieces(faces)
    has_area = np.bincount(piece[~is_flat & ~is_collapsed], minlength=len(faces) + 1) > 0
    found = (is_collapsed, is_double & ~is_collapsed)
    rest = is_flat & ~has_area[piece] & ~is_double & ~is_collapsed
    return dict(zip(_REASONS, map(np.flatnonzero, (*found, rest)), strict=True))


def _turns(points: np.ndarray, faces: np.ndarray) -> tuple[topology.Turns, np.ndarray]:
    """How to make neighbours agree, and which faces to turn so that pieces look outward too."""
    turns = topology.turns(faces)
    patch, is_turned = turns.patch, turns.is_turned
    is_odd = np.zeros(len(turns.is_orientable), bool)
    is_odd[patch[is_turned]] = True
    is_turned = is_turned ^ (is_odd & _looks_inward(points, faces, turns))[patch]
    there = Surface(points, _turned(faces, is_turned))
    _, piece = topology.pieces(faces)
    return turns, is_turned ^ np.isin(piece, inside_out_pieces(there))


def _looks_inward(points: np.ndarray, faces: np.ndarray, turns: topology.Turns) -> np.ndarray:
    """Whether each patch, turned to the side of its first face, had better show the other.

    It had if it bulges inward, seen from the middle of its border; where that says little, because
    the patch is nearly flat, if most of its faces show the other side.
    """
    patch = turns.patch
    edges = topology.edges(faces)
    is_border = np.zeros(len(points), bool)
    is_border[edges.ends[edges.uses != 2]] = True
    weight = is_border[faces].astype(float)
    weight[(np.bincount(patch, weight.sum(axis=1)) == 0)[patch]] = 1.0
    corners = points[_turned(faces, turns.is_turned)]
    sums = [np.bincount(patch, (weight * corners[..., axis]).sum(axis=1)) for axis in range(3)]
    middle = np.stack(sums, axis=1) / np.bincount(patch, weight.sum(axis=1))[:, None]
    a, b, c = np.moveaxis(corners - middle[patch][:, None], 1, 0)
    volume = np.bincount(patch, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6)
    area = np.bincount(patch, np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)
    most_differ = 2 * np.bincount(patch, turns.is_turned) > np.bincount(patch)
    return np.where(np.abs(volume) > BULGE * area**1.5, volume < 0, most_differ)


def _turned(faces: np.ndarray, is_turned: np.ndarray) -> np.ndarray:
    return np.where(is_turned[:, None], faces[:, [0, 2, 1]], faces)


def _rows(data: Mapping[str, Array], rows: np.ndarray) -> dict[str, Array]:
    return {name: np.asarray(array)[rows] for name, array in data.items()}


def _told(report: Mending, kinds: Mapping[str, str]) -> list[str]:
    found = [numbered(text, getattr(report, name)) for name, text in kinds.items()]
    return [sentence for sentence in found if sentence]
