"""What OpenCascade's mesher makes of a shape: lines along its edges, and patches of its faces."""

from typing import Any

import numpy as np

from ..errors import GeometryError
from .cad_grids import lay_grids
from .cad_owners import along, along_side, on_surface
from .cad_topology import Topology, opencascade


class Line:
    """An edge's points while it is refined: parts of its range, numbers, and places."""

    def __init__(self, fractions: np.ndarray, numbers: np.ndarray, points: np.ndarray):
        self.fractions, self.numbers, self.points = fractions, numbers, points


class Patch:
    """A face's nodes while it is refined.

    `numbers` are those of the points; `sides` have nodes along each side, in their edge's
    direction.
    """

    def __init__(
        self,
        numbers: np.ndarray,
        uv: np.ndarray,
        points: np.ndarray,
        triangles: np.ndarray,
        sides: list[np.ndarray],
    ):
        self.numbers, self.uv, self.points = numbers, uv, points
        self.triangles, self.sides = triangles, sides

    def added(self, numbers: np.ndarray, uv: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Append nodes; theirs are the numbers returned."""
        start = len(self.numbers)
        self.numbers = np.concatenate([self.numbers, numbers])
        self.uv = np.concatenate([self.uv, uv])
        self.points = np.concatenate([self.points, points])
        return np.arange(start, len(self.numbers))


class Meshed:
    """Lines of all edges and patches of all faces, and how many points they have.

    Points at the vertices come first.
    """

    def __init__(self, shape: Any, parts: Topology, max_edge: float, sag: float, angle: float):
        """Distances in the shape's unit, angles in radians."""
        self.parts, self.count = parts, len(parts.vertices)
        self.lines: dict[int, Line] = {}
        self.gridded = _mesh(shape, parts, max_edge, sag, angle)
        self.patches = [self._patch(number) for number in range(len(parts.faces))]

    def numbered(self, count: int) -> np.ndarray:
        """Numbers of so many new points."""
        self.count += count
        return np.arange(self.count - count, self.count)

    def _patch(self, number: int) -> Patch:
        """What OpenCascade's mesher made of a face, with points numbered over all faces."""
        occ, face = opencascade(), self.parts.faces[number]
        place = occ.TopLoc.TopLoc_Location()
        mesh = occ.BRep.BRep_Tool.Triangulation_s(face.shape, place)
        if mesh is None or not mesh.NbTriangles():
            raise GeometryError(
                f"OpenCascade makes no triangles of face {number + 1} ({face.kind}); heal the shape"
            )
        uv = np.array([mesh.UVNode(k).Coord() for k in range(1, mesh.NbNodes() + 1)])
        triangles = np.array([mesh.Triangle(k).Get() for k in range(1, mesh.NbTriangles() + 1)]) - 1
        numbers = np.full(len(uv), -1)
        sides = []
        for edge, oriented in face.sides:
            nodes = self._side(number, edge, oriented, mesh, place, uv)
            line = self.lines[edge]
            numbers[nodes] = line.numbers
            uv[nodes] = along_side(face, oriented, line.fractions)
            sides.append(nodes)
        inner = np.flatnonzero(numbers < 0)
        numbers[inner] = self.numbered(len(inner))
        points = np.empty((len(uv), 3))
        points[inner] = on_surface(face, uv[inner])
        for (edge, _), nodes in zip(face.sides, sides, strict=True):
            points[nodes] = self.lines[edge].points
        patch = Patch(numbers, uv, points, triangles, sides)
        self._gather(number, patch)
        return patch

    def _gather(self, number: int, patch: Patch) -> None:
        """Make one node of those along a collapsed side."""
        for place, (edge, _) in enumerate(self.parts.faces[number].sides):
            if self.parts.edges[edge].kind == "point":
                nodes = patch.sides[place].copy()
                for own in (patch.triangles, *patch.sides):
                    own[np.isin(own, nodes)] = nodes[0]
                t = patch.triangles
                patch.triangles = t[(t != np.roll(t, 1, axis=1)).all(axis=1)]

    def _side(
        self, number: int, edge: int, oriented: Any, mesh: Any, place: Any, uv: np.ndarray
    ) -> np.ndarray:
        """Nodes of a face along one side; its edge's line is made when it is met first."""
        occ, face = opencascade(), self.parts.faces[number]
        choices = []
        for way in (oriented, occ.TopoDS.TopoDS.Edge(oriented.Reversed())):
            polygon = occ.BRep.BRep_Tool.PolygonOnTriangulation_s(way, mesh, place)
            if polygon is None:
                raise GeometryError(
                    f"OpenCascade's mesh of face {number + 1} lacks edge {edge + 1}; heal the shape"
                )
            range_ = range(1, polygon.NbNodes() + 1)
            nodes = np.array([polygon.Node(k) for k in range_]) - 1
            if edge not in self.lines:
                self._line(edge, np.array([polygon.Parameter(k) for k in range_]))
            there = along_side(face, oriented, self.lines[edge].fractions)
            if len(nodes) == len(there):
                choices.append((float(np.abs(uv[nodes] - there).max()), nodes))
        if not choices:
            raise GeometryError(
                f"faces at edge {edge + 1} have other numbers of points on it; heal the shape"
            )
        return min(choices, key=lambda choice: choice[0])[1]  # a seam has two, in no fixed order

    def _line(self, edge: int, places: np.ndarray) -> None:
        own = self.parts.edges[edge]
        first, last = opencascade().BRep.BRep_Tool.Range_s(own.shape)
        fractions = (places - first) / (last - first)
        fractions[[0, -1]] = 0.0, 1.0
        inner = len(places) - 2
        if own.kind == "point":
            numbers = np.full(len(places), own.ends[0])
        else:
            numbers = np.array([own.ends[0], *self.numbered(inner), own.ends[1]])
        self.lines[edge] = Line(fractions, numbers, self.on_line(edge, fractions))

    def on_line(self, edge: int, fractions: np.ndarray) -> np.ndarray:
        """Points of an edge at parts of its range, also of one that is collapsed."""
        own = self.parts.edges[edge]
        if own.kind != "point":
            return along(own, fractions)
        point = opencascade().BRep.BRep_Tool.Pnt_s(self.parts.vertices[own.ends[0]]).Coord()
        return np.tile(point, (len(fractions), 1))


def _mesh(shape: Any, parts: Topology, max_edge: float, sag: float, angle: float) -> set[int]:
    """Mesh all faces; which of them have a grid."""
    occ = opencascade()
    occ.BRepTools.BRepTools.Clean_s(shape)  # a coarser mesh would be kept
    gridded = lay_grids(parts, max_edge, sag, angle)
    asked = occ.IMeshTools.IMeshTools_Parameters()
    asked.Deflection = asked.DeflectionInterior = sag
    asked.Angle, asked.AngleInterior = angle, 2 * angle  # the same crowds free-form faces
    asked.MinSize = sag
    asked.InParallel = False
    occ.BRepMesh.BRepMesh_IncrementalMesh(shape, asked)
    return gridded
