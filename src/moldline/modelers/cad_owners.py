"""Where each vertex of a CAD triangulation belongs: to a vertex, an edge's t or a face's (u, v).

Every place along an edge is a fixed fraction of the edge's range and has one owner, so faces
that share the edge share its points to the bit. Inside a face (u, v) follow the boundary: each is
a fixed weighted mean of its neighbours' (mean-value weights, which reproduce linear functions).
Where the boundary's (u, v) stay, so do those inside; where it moves, as that of a plane's part
does when it grows or of a hole, they move along smoothly.
"""

import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from .cad_topology import Edge, Face, Topology, opencascade


class FaceNodes(NamedTuple):
    """A face's triangulation in (u, v): nodes on the boundary first, then those inside.

    Attributes
    ----------
    sides, fractions
        Of each node on the boundary, the place among the face's sides and the part of the edge's
        range, both from 0.
    inner
        Numbers of the points inside.
    uv
        Of all nodes.
    triangles
        Three nodes each.
    """

    sides: np.ndarray
    fractions: np.ndarray
    inner: np.ndarray
    uv: np.ndarray
    triangles: np.ndarray


class EdgeNodes(NamedTuple):
    """An edge's points inside its range: parts of the range, and the points' numbers.

    `lengths` are parts of the edge's length, where these are what stays; else None.
    """

    fractions: np.ndarray
    points: np.ndarray
    lengths: np.ndarray | None = None

    def placed(self, edge: Edge) -> "EdgeNodes":
        """Where the points are on another edge alike."""
        if self.lengths is None:
            return self
        return self._replace(fractions=at_lengths(edge, self.lengths))


class Placed(NamedTuple):
    """Points of a shape, and how many triangles are folded over in their faces' (u, v)."""

    points: np.ndarray
    folded: int


class Owners:
    """Owners of all points; called with a shape alike the first, where they are on it."""

    def __init__(
        self,
        count: int,
        vertices: np.ndarray,
        edges: Sequence[EdgeNodes],
        faces: Sequence[FaceNodes],
    ):
        """`vertices` are the numbers of the points at them, -1 for none."""
        self.count = count
        self.vertices, self.edges, self.faces = vertices, tuple(edges), tuple(faces)
        blocks = [_weights(nodes) for nodes in faces]
        self.size = sum(inner.shape[0] for inner, _ in blocks)
        if self.size:
            self._inner = scipy.sparse.linalg.splu(
                scipy.sparse.block_diag([inner for inner, _ in blocks], "csc")
            )
            self._outer = scipy.sparse.block_diag([outer for _, outer in blocks], "csr")

    def __call__(self, shape: Topology) -> np.ndarray:
        """The points on a shape, in its own unit."""
        return self.placed(shape).points

    def placed(self, shape: Topology) -> "Placed":
        """The points on a shape, and how many triangles are folded there."""
        occ = opencascade()
        points = np.full((self.count, 3), np.nan)
        for number, vertex in zip(self.vertices.tolist(), shape.vertices, strict=True):
            if number >= 0:
                points[number] = occ.BRep.BRep_Tool.Pnt_s(vertex).Coord()
        lines = [own.placed(edge) for own, edge in zip(self.edges, shape.edges, strict=True)]
        for line, edge in zip(lines, shape.edges, strict=True):
            if len(line.points):
                points[line.points] = along(edge, line.fractions)
        folded = 0
        if self.size:
            border = [
                on_border(face, nodes.sides, self._fractions(face, nodes, lines))
                for face, nodes in zip(shape.faces, self.faces, strict=True)
            ]
            uv = self._inner.solve(self._outer @ np.concatenate(border))
            ends = np.cumsum([len(nodes.inner) for nodes in self.faces])[:-1]
            for face, nodes, own in zip(shape.faces, self.faces, np.split(uv, ends), strict=True):
                points[nodes.inner] = on_surface(face, own)
            for nodes, outer, own in zip(self.faces, border, np.split(uv, ends), strict=True):
                if len(own):
                    folded += _turned(nodes, np.concatenate([outer, own]))
        return Placed(points, folded)

    def _fractions(self, face: Face, nodes: FaceNodes, lines: Sequence[EdgeNodes]) -> np.ndarray:
        """Parts of edges' ranges on a face's boundary, moved as the points on the edges are."""
        moved = nodes.fractions.copy()
        for place, (edge, _) in enumerate(face.sides):
            if lines[edge].lengths is not None:
                chosen = nodes.sides == place
                at = [np.array([0.0, *own[edge].fractions, 1.0]) for own in (self.edges, lines)]
                moved[chosen] = at[1][np.searchsorted(at[0], nodes.fractions[chosen])]
        return moved


def at_lengths(edge: Edge, lengths: np.ndarray) -> np.ndarray:
    """Parts of an edge's range at parts of its length."""
    occ = opencascade()
    curve = occ.BRepAdaptor.BRepAdaptor_Curve(edge.shape)
    first, last = occ.BRep.BRep_Tool.Range_s(edge.shape)
    point = occ.GCPnts.GCPnts_AbscissaPoint
    whole = point.Length_s(curve, first, last)
    return np.array(
        [
            (point(1e-10 * whole, curve, part * whole, first).Parameter() - first) / (last - first)
            for part in lengths.tolist()
        ]
    )


def lengths_at(edge: Edge, fractions: np.ndarray) -> np.ndarray:
    """Parts of an edge's length at parts of its range."""
    occ = opencascade()
    curve = occ.BRepAdaptor.BRepAdaptor_Curve(edge.shape)
    first, last = occ.BRep.BRep_Tool.Range_s(edge.shape)
    places = [first, *(first + (last - first) * fractions).tolist(), last]
    length = occ.GCPnts.GCPnts_AbscissaPoint.Length_s
    steps = [length(curve, *ends) for ends in itertools.pairwise(places)]
    return np.cumsum(steps)[:-1] / np.sum(steps)


def is_marched(parts: Topology, number: int) -> bool:
    """Whether an edge is a free curve on all its faces, as those that booleans find are.

    Their parametrisation is whatever the search for them gave, so that only lengths along them
    mean the same in another shape.
    """
    if parts.edges[number].kind not in ("BSplineCurve", "OtherCurve"):
        return False
    sides = np.linspace(0.0, 1.0, 9)
    for face in parts.faces:
        for edge, oriented in face.sides:
            if edge == number and face.kind != "Plane":
                spread = np.ptp(along_side(face, oriented, sides), axis=0)
                if spread.min() < 1e-6 * spread.max():
                    return False
    return True


def along(edge: Edge, fractions: np.ndarray) -> np.ndarray:
    """Points of an edge at parts of its range."""
    occ = opencascade()
    curve = occ.BRepAdaptor.BRepAdaptor_Curve(edge.shape)
    first, last = occ.BRep.BRep_Tool.Range_s(edge.shape)
    places = (first + (last - first) * fractions).tolist()
    return np.array([curve.Value(t).Coord() for t in places]).reshape(-1, 3)


def on_border(face: Face, sides: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """(u, v) of places on a face's boundary."""
    uv = np.empty((len(sides), 2))
    for number, (_, edge) in enumerate(face.sides):
        chosen = np.flatnonzero(sides == number)
        if len(chosen):
            uv[chosen] = along_side(face, edge, fractions[chosen])
    return uv


def along_side(face: Face, edge: Any, fractions: np.ndarray) -> np.ndarray:
    """(u, v) of one side of a face at parts of its edge's range."""
    occ = opencascade()
    curve = occ.BRepAdaptor.BRepAdaptor_Curve2d(edge, face.shape)
    first, last = occ.BRep.BRep_Tool.Range_s(edge, face.shape)
    places = (first + (last - first) * fractions).tolist()
    return np.array([curve.Value(t).Coord() for t in places]).reshape(-1, 2)


def on_surface(face: Face, uv: np.ndarray) -> np.ndarray:
    """Points of a face's surface."""
    surface = opencascade().BRepAdaptor.BRepAdaptor_Surface(face.shape, False)
    return np.array([surface.Value(u, v).Coord() for u, v in uv.tolist()]).reshape(-1, 3)


def _turned(nodes: FaceNodes, uv: np.ndarray) -> int:
    """Triangles that are turned over, where others of their face are not."""
    before, now = _areas(nodes.uv, nodes.triangles), _areas(uv, nodes.triangles)
    is_other = before * now < 0
    return int(min(is_other.sum(), (~is_other).sum()))  # a plane may be seen from its other side


def _areas(uv: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b = (uv[triangles[:, k]] - uv[triangles[:, 0]] for k in (1, 2))
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _weights(nodes: FaceNodes) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
    """Equations of the nodes inside: what multiplies them, and what the boundary gives.

    Source: Floater, Mean value coordinates, Computer Aided Geometric Design 20 (1), 2003.
    """
    border, count = len(nodes.sides), len(nodes.uv)
    corners = zip(*_corners(nodes), strict=True)
    rows, columns, values = (np.concatenate(list(part)) for part in corners)
    chosen = rows >= border
    shape = (count - border, count)
    matrix = scipy.sparse.csr_array(
        (values[chosen], (rows[chosen] - border, columns[chosen])), shape=shape
    )
    total = np.asarray(matrix.sum(axis=1)).ravel()
    scaled = scipy.sparse.diags_array(1 / np.where(total == 0, 1.0, total)) @ matrix
    inner = scipy.sparse.eye_array(count - border) - scaled[:, border:]
    return scipy.sparse.csr_array(inner), scipy.sparse.csr_array(scaled[:, :border])


def _corners(nodes: FaceNodes) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Of each corner the node, each neighbour, and the tangent of half the angle by its length."""
    for k in range(3):
        at, one, other = (nodes.triangles[:, (k + j) % 3] for j in range(3))
        a, b = nodes.uv[one] - nodes.uv[at], nodes.uv[other] - nodes.uv[at]
        lengths = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
        sine = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        cosine = np.sum(a * b, axis=1)
        half = sine / np.maximum(lengths[0] * lengths[1] + cosine, 1e-300)
        for neighbour, length in zip((one, other), lengths, strict=True):
            yield at, neighbour, half / np.maximum(length, 1e-300)
