"""A watertight triangulation of a CAD shape, every point of which has one owner.

OpenCascade's mesher sets points by sag and angle: along each edge once, then inside each face, in
its (u, v). Edges that are still too long are halved, again along an edge of the shape for all
faces at it, so that no gap opens.
"""

from typing import Any, NamedTuple

import numpy as np

from ..errors import GeometryError
from .cad_flips import rounder
from .cad_mesher import Line, Meshed, Patch
from .cad_owners import EdgeNodes, FaceNodes, Owners, along_side, is_marched, lengths_at, on_surface
from .cad_splitting import halved
from .cad_topology import Topology

MOST_POINTS = 20_000_000
"""More points than this have no place in memory."""


class Fineness(NamedTuple):
    """How fine a triangulation is, in the shape's unit and radians."""

    max_edge: float
    sag: float
    angle: float


class Tessellation(NamedTuple):
    """Triangles with the face that each is of, and their points' owners."""

    faces: np.ndarray
    of_face: np.ndarray
    owners: Owners


def tessellated(shape: Any, parts: Topology, fineness: Fineness) -> Tessellation:
    """Triangles of a shape no coarser than asked for."""
    return _Refined(shape, parts, fineness).result()


class _Refined:
    """What OpenCascade's mesher made, with long edges halved and triangles made rounder."""

    def __init__(self, shape: Any, parts: Topology, fineness: Fineness):
        self.parts, self.fineness = parts, fineness
        self.meshed = Meshed(shape, parts, *fineness)
        self.lines, self.patches = self.meshed.lines, self.meshed.patches
        self._round()
        while self._refine():
            self._round()
            if self.meshed.count > MOST_POINTS:
                raise GeometryError(
                    f"max_edge = {fineness.max_edge:g} (in the shape's unit) takes more than "
                    f"{MOST_POINTS} points; make it longer"
                )

    def _refine(self) -> bool:
        """Halve what is too long, once; whether anything was."""
        middles = {edge: self._halve_line(edge) for edge in self.lines}
        return bool(
            sum([self._halve_patch(k, middles) for k in range(len(self.patches))])
            + sum(len(segments) for segments, _ in middles.values())
        )

    def _round(self) -> None:
        """Turn edges inside faces; those along sides, at a collapsed one, and of grids stay."""
        for number, patch in enumerate(self.patches):
            if number in self.meshed.gridded:
                continue
            sides = [np.stack([own[:-1], own[1:]], axis=1) for own in patch.sides]
            t, poles = patch.triangles, [patch.sides[k] for k, _ in self._collapsed(number)]
            if poles:
                fan = t[np.isin(t, np.concatenate(poles)).any(axis=1)]
                sides.append(fan[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2))
            kept = np.concatenate(sides)
            patch.triangles = rounder(t, patch.points, patch.uv, kept, self.fineness.sag / 4)

    def _halve_line(self, edge: int) -> tuple[np.ndarray, Line]:
        """Too long segments of an edge, and the points in their middles."""
        line = self.lines[edge]
        lengths = np.linalg.norm(np.diff(line.points, axis=0), axis=1)
        long = np.flatnonzero(lengths > self.fineness.max_edge)
        if self.parts.edges[edge].kind == "point":
            long = long[:0]
        fractions = (line.fractions[long] + line.fractions[long + 1]) / 2
        new = Line(fractions, self.meshed.numbered(len(long)), self.meshed.on_line(edge, fractions))
        line.fractions = np.insert(line.fractions, long + 1, new.fractions)
        line.numbers = np.insert(line.numbers, long + 1, new.numbers)
        line.points = np.insert(line.points, long + 1, new.points, axis=0)
        return long, new

    def _halve_patch(self, number: int, middles: dict[int, tuple[np.ndarray, Line]]) -> int:
        """Halve a face's triangles at the middles of its edges, and at those of long ones."""
        face, patch = self.parts.faces[number], self.patches[number]
        starts, ends, news = [], [], []
        is_side = []
        for place, (edge, oriented) in enumerate(face.sides):
            nodes, (long, new) = patch.sides[place], middles[edge]
            is_side.append(np.sort(np.stack([nodes[:-1], nodes[1:]], axis=1), axis=1))
            uv = along_side(face, oriented, new.fractions)
            news.append(patch.added(new.numbers, uv, new.points))
            starts.append(nodes[long])
            ends.append(nodes[long + 1])
            patch.sides[place] = np.insert(nodes, long + 1, news[-1])
        inner = self._long_inside(patch, np.concatenate(is_side))
        uv = (self._towards(number, inner[:, 0], inner[:, 1])) / 2
        numbers = self.meshed.numbered(len(inner))
        news.append(patch.added(numbers, uv, on_surface(face, uv)))
        marks = np.concatenate(
            [np.stack([np.concatenate(p) for p in (starts, ends)], axis=1), inner]
        )
        if len(marks):
            patch.triangles = halved(patch.triangles, patch.points, marks, np.concatenate(news))
        return len(inner)

    def _long_inside(self, patch: Patch, sides: np.ndarray) -> np.ndarray:
        """Pairs of nodes that long edges of triangles join inside a face."""
        pairs = np.sort(patch.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        count = len(patch.numbers)
        keys = np.setdiff1d(pairs @ [count, 1], sides @ [count, 1])
        pairs = np.stack(np.divmod(keys, count), axis=1)
        lengths = np.linalg.norm(patch.points[pairs[:, 0]] - patch.points[pairs[:, 1]], axis=1)
        return pairs[lengths > self.fineness.max_edge]

    def _towards(self, number: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Sums of two nodes' (u, v); a collapsed side counts where it is nearest to the other."""
        patch = self.patches[number]
        a, b = patch.uv[one], patch.uv[other]
        for place, line in self._collapsed(number):
            is_one, is_other = (np.isin(ends, patch.sides[place]) for ends in (one, other))
            a, b = (
                np.where(is_one[:, None], _nearest(line, b), a),
                np.where(is_other[:, None], _nearest(line, a), b),
            )
        return a + b

    def _collapsed(self, number: int) -> list[tuple[int, np.ndarray]]:
        """Places and (u, v) of the ends of a face's sides that are one point."""
        face, ends = self.parts.faces[number], np.array([0.0, 1.0])
        return [
            (place, along_side(face, oriented, ends))
            for place, (edge, oriented) in enumerate(face.sides)
            if self.parts.edges[edge].kind == "point"
        ]

    def result(self) -> Tessellation:
        """Triangles without those that are collapsed, points that are used, and owners."""
        faces = [patch.numbers[patch.triangles] for patch in self.patches]
        is_sound = [
            (f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0]) for f in faces
        ]
        owned = [self._nodes(k) for k in range(len(faces))]
        faces = [
            f[good][:, ::-1] if face.is_reversed else f[good]
            for f, good, face in zip(faces, is_sound, self.parts.faces, strict=True)
        ]
        of_face = np.repeat(np.arange(len(faces)), [len(f) for f in faces])
        used, joined = np.unique(np.concatenate(faces), return_inverse=True)
        place = np.full(self.meshed.count, -1)
        place[used] = np.arange(len(used))
        vertices = place[: len(self.parts.vertices)]
        edges = [self._edge_nodes(k, place) for k in range(len(self.parts.edges))]
        nodes = [one._replace(inner=place[one.inner]) for one in owned]
        return Tessellation(
            joined.reshape(-1, 3), of_face, Owners(len(used), vertices, edges, nodes)
        )

    def _scale(self, number: int) -> np.ndarray:
        """About the length of the surface by u and by v, which weights take as alike."""
        patch, poles = self.patches[number], [k for k, _ in self._collapsed(number)]
        pairs = patch.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        if poles:
            at = np.concatenate([patch.sides[k] for k in poles])
            pairs = pairs[~np.isin(pairs, at).any(axis=1)]
        change = np.diff(patch.uv[pairs], axis=1)[:, 0] ** 2
        lengths = np.sum(np.diff(patch.points[pairs], axis=1)[:, 0] ** 2, axis=1)
        most = np.maximum(change.max(axis=0, initial=0.0), 1e-300)
        found = np.linalg.lstsq(change / most, lengths, rcond=None)[0]
        return np.sqrt(np.clip(found, 1e-6 * lengths.max(initial=1e-300), None) / most)

    def _edge_nodes(self, edge: int, place: np.ndarray) -> EdgeNodes:
        line = self.lines[edge]
        inner = slice(1, -1) if self.parts.edges[edge].kind != "point" else slice(0, 0)
        nodes = EdgeNodes(line.fractions[inner], place[line.numbers[inner]])
        if not is_marched(self.parts, edge):
            return nodes
        return nodes._replace(lengths=lengths_at(self.parts.edges[edge], nodes.fractions))

    def _nodes(self, number: int) -> FaceNodes:
        """The face in (u, v), where a collapsed side is drawn out to its length."""
        face, patch = self.parts.faces[number], self.patches[number]
        side, fraction = np.full(len(patch.numbers), -1), np.zeros(len(patch.numbers))
        for place, (edge, _) in enumerate(face.sides):
            side[patch.sides[place]] = place
            fraction[patch.sides[place]] = self.lines[edge].fractions
        uv, triangles = patch.uv, patch.triangles
        for place, line in self._collapsed(number):
            ends = patch.sides[place]
            triangles, beside, parts = _drawn_out(triangles, ends, uv, line)
            uv = np.concatenate([uv, beside])
            side = np.append(side, np.full(len(parts), place))
            fraction = np.append(fraction, parts)
        used = np.unique(triangles)
        border = np.count_nonzero(side[used] >= 0)
        order = used[np.argsort(side[used] < 0, kind="stable")]
        place_of = np.empty(len(uv), int)
        place_of[order] = np.arange(len(order))
        scaled = uv * self._scale(number)
        return FaceNodes(
            side[order[:border]],
            fraction[order[:border]],
            patch.numbers[order[border:]],
            scaled[order],
            place_of[triangles],
        )


def _nearest(line: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Places on a straight line between two ends nearest to points."""
    return line[0] + _parts(line, points)[:, None] * (line[1] - line[0])


def _parts(line: np.ndarray, points: np.ndarray) -> np.ndarray:
    way = line[1] - line[0]
    return np.clip((points - line[0]) @ way / (way @ way), 0.0, 1.0)


def _drawn_out(
    triangles: np.ndarray, ends: np.ndarray, uv: np.ndarray, line: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles at a collapsed side made into two each, with nodes on it beside the far corners.

    Also (u, v) of the new nodes, and how far along the side they are.
    """
    at = np.isin(triangles, ends)
    plain, fan = triangles[at.sum(axis=1) == 0], triangles[at.sum(axis=1) == 1]
    turn = np.argmax(np.isin(fan, ends), axis=1)
    fan = np.take_along_axis(fan, (turn[:, None] + np.arange(3)) % 3, axis=1)
    far, place = np.unique(fan[:, 1:], return_inverse=True)
    parts = _parts(line, uv[far])
    one, other = (len(uv) + place.reshape(-1, 2)).T
    quads = np.stack([one, fan[:, 1], fan[:, 2]], axis=1), np.stack([one, fan[:, 2], other], axis=1)
    return np.concatenate([plain, *quads]), _nearest(line, uv[far]), parts
