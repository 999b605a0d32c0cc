"""Faces, edges and vertices of a CAD shape in a fixed order, and whether two shapes are alike."""

import importlib
from typing import Any, NamedTuple

from ..errors import GeometryError, ParameterError


def opencascade() -> Any:
    """OpenCascade's Python module; an error says how to install it where it is absent."""
    try:
        return importlib.import_module("OCP.OCP")
    except ImportError:
        raise ParameterError(
            "CAD shapes need OpenCascade; install it by: pip install 'moldline[step]'"
        ) from None


class Face(NamedTuple):
    """A face with its boundary.

    Attributes
    ----------
    shape
        The face, oriented as its surface is.
    is_reversed
        Whether its outside is on the surface's other side.
    sides
        Number of the edge and the oriented edge, along all of the boundary; a seam comes twice.
    kind
        OpenCascade's word for the surface.
    solid
        Number of the solid (or the shell) that it belongs to.
    """

    shape: Any
    is_reversed: bool
    sides: tuple[tuple[int, Any], ...]
    kind: str
    solid: int


class Edge(NamedTuple):
    """An edge from its first vertex to its last, in the direction of its curve.

    Attributes
    ----------
    shape
        The edge, oriented as its curve is.
    ends
        Numbers of its vertices.
    kind
        OpenCascade's word for the curve; "point" where the edge is collapsed.
    """

    shape: Any
    ends: tuple[int, int]
    kind: str


class Topology(NamedTuple):
    """What a shape consists of, in the order in which OpenCascade goes through it."""

    faces: tuple[Face, ...]
    edges: tuple[Edge, ...]
    vertices: tuple[Any, ...]


def topology(shape: Any) -> Topology:
    """Faces of a shape, with the edges and vertices of these."""
    occ = opencascade()
    kinds = occ.TopAbs.TopAbs_ShapeEnum
    found = _listed(occ, shape, kinds.TopAbs_FACE)
    if not found:
        raise GeometryError("the shape has no faces")
    solids = _owners(occ, shape, found)
    edges = occ.collections.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    vertices = occ.collections.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    faces = []
    for number, one in enumerate(found):
        face = occ.TopoDS.TopoDS.Face(one.Oriented(occ.TopAbs.TopAbs_Orientation.TopAbs_FORWARD))
        kind = _word(occ.BRepAdaptor.BRepAdaptor_Surface(face, False).GetType())
        is_reversed = one.Orientation() == occ.TopAbs.TopAbs_Orientation.TopAbs_REVERSED
        sides = tuple(
            (edges.Add(side) - 1, side)
            for side in map(occ.TopoDS.TopoDS.Edge, _explored(occ, face, kinds.TopAbs_EDGE))
        )
        faces.append(Face(face, is_reversed, sides, kind, solids[number]))
    members = [_edge(occ, edges.FindKey(k), vertices) for k in range(1, edges.Extent() + 1)]
    points = [vertices.FindKey(k) for k in range(1, vertices.Extent() + 1)]
    return Topology(
        tuple(faces), tuple(members), tuple(occ.TopoDS.TopoDS.Vertex(p) for p in points)
    )


def _listed(occ: Any, shape: Any, kind: Any) -> list[Any]:
    """Each part of a kind once."""
    found = occ.collections.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    occ.TopExp.TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(k) for k in range(1, found.Extent() + 1)]


def _explored(occ: Any, shape: Any, kind: Any) -> list[Any]:
    """Parts of a kind, as often as the shape uses them."""
    explorer, found = occ.TopExp.TopExp_Explorer(shape, kind), []
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found


def _owners(occ: Any, shape: Any, faces: list[Any]) -> list[int]:
    """For each face the solid that it belongs to, or where there is none the shell."""
    kinds = occ.TopAbs.TopAbs_ShapeEnum
    owners: dict[Any, int] = {}
    groups = _listed(occ, shape, kinds.TopAbs_SOLID) + _listed(occ, shape, kinds.TopAbs_SHELL)
    for number, group in enumerate(groups):
        for face in _listed(occ, group, kinds.TopAbs_FACE):
            owners.setdefault(face.Oriented(occ.TopAbs.TopAbs_Orientation.TopAbs_FORWARD), number)
    forward = [face.Oriented(occ.TopAbs.TopAbs_Orientation.TopAbs_FORWARD) for face in faces]
    numbers = [owners.get(face, -1) for face in forward]
    order = {number: k for k, number in enumerate(dict.fromkeys(numbers))}
    return [order[number] for number in numbers]


def _edge(occ: Any, shape: Any, vertices: Any) -> Edge:
    edge = occ.TopoDS.TopoDS.Edge(shape.Oriented(occ.TopAbs.TopAbs_Orientation.TopAbs_FORWARD))
    ends = (occ.TopExp.TopExp.FirstVertex_s(edge), occ.TopExp.TopExp.LastVertex_s(edge))
    if any(end.IsNull() for end in ends):
        raise GeometryError("an edge has no vertex at an end; heal the shape first")
    is_collapsed = occ.BRep.BRep_Tool.Degenerated_s(edge)
    kind = "point" if is_collapsed else _word(occ.BRepAdaptor.BRepAdaptor_Curve(edge).GetType())
    first, last = (vertices.Add(end) - 1 for end in ends)
    return Edge(edge, (first, last), kind)


def _word(kind: Any) -> str:
    """OpenCascade's kind of a curve or surface without its prefix."""
    return str(kind.name).removeprefix("GeomAbs_")


def _forward() -> Any:
    return opencascade().TopAbs.TopAbs_Orientation.TopAbs_FORWARD


def difference(base: Topology, other: Topology) -> str:
    """What is not alike in two shapes, as one clause; nothing where they are."""
    for what in ("faces", "edges", "vertices"):
        counts = len(getattr(base, what)), len(getattr(other, what))
        if counts[0] != counts[1]:
            return f"it has {counts[1]} {what} in place of {counts[0]}"
    for number, (one, two) in enumerate(zip(base.faces, other.faces, strict=True), start=1):
        if one.kind != two.kind:
            return f"its face {number} is a {two.kind} in place of a {one.kind}"
        # a plane fitted to a wire looks to either side, which its points do not feel
        is_turned = one.is_reversed != two.is_reversed
        if is_turned and one.kind != "Plane":
            return f"its face {number} is turned inside out"
        sides = [
            [(k, edge.Orientation() == _forward() if turn else edge.Orientation() != _forward())
             for k, edge in face.sides]
            for face, turn in ((one, False), (two, is_turned))
        ]  # fmt: skip
        if sides[0] != sides[1]:
            return f"its face {number} is bounded by other edges"
    for number, (was, now) in enumerate(zip(base.edges, other.edges, strict=True), start=1):
        if was.ends != now.ends:
            return f"its edge {number} joins other vertices"
        if was.kind != now.kind:
            return f"its edge {number} is a {now.kind} in place of a {was.kind}"
    return ""


def open_edges(parts: Topology) -> list[int]:
    """Edges that only one side of one face has, counted from 0."""
    uses = [0] * len(parts.edges)
    for face in parts.faces:
        for edge, _ in face.sides:
            uses[edge] += 1
    return [k for k, n in enumerate(uses) if n == 1 and parts.edges[k].kind != "point"]
