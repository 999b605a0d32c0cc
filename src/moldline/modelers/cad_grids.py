"""Grids on the faces of a CAD shape that are rectangles in (u, v), such as those of lofts.

Edges opposite to each other across such faces get the same parts of their ranges, close where any
of the lines along them curves, so that points run in rows from one to the other. The mesher takes
what is laid on these faces, and meshes the others to fit.
"""

from typing import Any, NamedTuple

import numpy as np

from .cad_owners import along, along_side, on_surface
from .cad_topology import Face, Topology, opencascade

SAMPLES = 400
"""Places along a line at which it is looked how much it curves."""

INSIDE = (0.25, 0.5, 0.75)
"""Lines across a face that are looked at besides its sides."""

MOST = 4000
"""Points along an edge are no more than these."""


class Rectangle(NamedTuple):
    """A face between two lines of u and two of v.

    Attributes
    ----------
    number
        Of the face.
    low, high
        Its corners in (u, v).
    sides
        Places among the face's sides: at the low and the high v, at the low and the high u.
    is_back
        For each of these whether its edge runs towards lower u or v.
    """

    number: int
    low: np.ndarray
    high: np.ndarray
    sides: tuple[int, int, int, int]
    is_back: tuple[bool, bool, bool, bool]


def lay_grids(parts: Topology, max_edge: float, sag: float, angle: float) -> set[int]:
    """Give each face that is a rectangle a grid as its triangulation; which those are."""
    found = (rectangle(face, number) for number, face in enumerate(parts.faces))
    rectangles = [one for one in found if one is not None]
    places = _places(parts, rectangles, max_edge, sag, angle)
    for one in rectangles:
        edges = [parts.faces[one.number].sides[k][0] for k in one.sides]
        own = [1 - places[e][::-1] if back else places[e] for e, back in zip(edges, one.is_back)]  # noqa: B905
        _lay(parts.faces[one.number], one, own, sag)
    return {one.number for one in rectangles}


def rectangle(face: Face, number: int = 0) -> Rectangle | None:
    """How a face is bounded, if by four lines of constant u or v that are evenly run through."""
    if len(face.sides) != 4:
        return None
    parts = np.linspace(0.0, 1.0, 9)
    lines = np.array([along_side(face, edge, parts) for _, edge in face.sides])
    low, high = lines.min(axis=(0, 1)), lines.max(axis=(0, 1))
    size = high - low
    if not (size > 0).all():
        return None
    scaled = (lines - low) / size
    found: dict[tuple[int, int], tuple[int, bool]] = {}
    for place, line in enumerate(scaled):
        for way in (0, 1):
            at, run = line[:, 1 - way], line[:, way]
            is_back = bool(run[-1] < run[0])
            is_even = np.abs((1 - run if is_back else run) - parts).max() < 1e-6
            if is_even and np.ptp(at) < 1e-9 and min(at[0], 1 - at[0]) < 1e-9:
                found[way, int(at[0] > 0.5)] = place, is_back
    if len(found) < 4:
        return None
    keys = ((0, 0), (0, 1), (1, 0), (1, 1))
    sides = (found[0, 0][0], found[0, 1][0], found[1, 0][0], found[1, 1][0])
    backs = [found[key][1] for key in keys]
    return Rectangle(number, low, high, sides, (backs[0], backs[1], backs[2], backs[3]))


def _places(
    parts: Topology, rectangles: list[Rectangle], max_edge: float, sag: float, angle: float
) -> dict[int, np.ndarray]:
    """Parts of the range of each edge that a rectangle has, alike on opposite ones."""
    fineness = max_edge / np.sqrt(2), sag, angle  # diagonals are longer than sides
    density: dict[int, np.ndarray] = {}
    ties: list[tuple[int, int, bool]] = []
    for one in rectangles:
        face = parts.faces[one.number]
        for way in (0, 1):
            pair = [face.sides[one.sides[2 * way + k]][0] for k in (0, 1)]
            backs = one.is_back[2 * way : 2 * way + 2]
            ties.append((pair[0], pair[1], backs[0] != backs[1]))
            across = np.max([_density(line, fineness) for line in _lines(face, one, way)], axis=0)
            for edge, is_back in zip(pair, backs, strict=True):
                own = across[::-1] if is_back else across
                if parts.edges[edge].kind != "point":
                    curve = along(parts.edges[edge], np.linspace(0, 1, SAMPLES + 1))
                    own = np.maximum(own, _density(curve, fineness))
                density[edge] = np.maximum(density.get(edge, own), own)
    _levelled(density, ties)
    return {edge: _spread(own) for edge, own in density.items()}


def _levelled(density: dict[int, np.ndarray], ties: list[tuple[int, int, bool]]) -> None:
    """Give tied edges the largest of their densities; in place."""
    is_new = True
    while is_new:
        is_new = False
        for one, other, is_turned in ties:
            own, theirs = density[one], density[other]
            theirs = theirs[::-1] if is_turned else theirs
            most = np.maximum(own, theirs)
            if not (np.array_equal(most, own) and np.array_equal(most, theirs)):
                density[one], density[other] = most, most[::-1] if is_turned else most
                is_new = True


def _lines(face: Face, one: Rectangle, way: int) -> list[np.ndarray]:
    """Points along lines inside a face, those of constant v first."""
    parts = np.linspace(0.0, 1.0, SAMPLES + 1)
    found = []
    for at in INSIDE:
        uv = np.empty((len(parts), 2))
        uv[:, way], uv[:, 1 - way] = parts, at
        found.append(on_surface(face, one.low + uv * (one.high - one.low)))
    return found


def _density(line: np.ndarray, fineness: tuple[float, float, float]) -> np.ndarray:
    """Points by part of the range that are wanted between samples of a line."""
    max_edge, sag, angle = fineness
    steps = np.diff(line, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    if lengths.sum() < 1e-12:
        return np.zeros(len(steps))
    safe = np.maximum(lengths, 1e-9 * lengths.sum())
    turns = _turns(steps / safe[:, None])
    around = np.stack([np.append(0.0, turns), np.append(turns, 0.0)]).max(axis=0)
    curvature = around / safe
    wanted = np.maximum(1 / max_edge, np.sqrt(curvature / (8 * sag)))
    return np.maximum(wanted * lengths, around / angle) * len(steps)


def _turns(ways: np.ndarray) -> np.ndarray:
    """Angles between one unit vector and the next."""
    cross = np.linalg.norm(np.cross(ways[:-1], ways[1:]), axis=1)
    return np.arctan2(cross, np.sum(ways[:-1] * ways[1:], axis=1))


def _spread(density: np.ndarray) -> np.ndarray:
    """Parts of a range that share out a density, which is smoothed so that gaps grow slowly."""
    wide = max(3, len(density) // 40)
    kernel = np.ones(wide) / wide
    padded = np.pad(density, wide, mode="edge")
    smooth = np.maximum(density, np.convolve(padded, kernel, "same")[wide:-wide])
    total = np.concatenate([[0.0], np.cumsum(smooth)]) / len(density)
    count = int(np.clip(np.ceil(total[-1] * (1 - 1e-9)), 1, MOST))
    places = np.linspace(0, 1, len(total))
    found = np.interp(np.linspace(0, total[-1], count + 1), total, places)
    found[[0, -1]] = 0.0, 1.0
    return found


def _lay(face: Face, one: Rectangle, own: list[np.ndarray], sag: float) -> None:
    """Put a grid on a face, and its border on the edges."""
    occ = opencascade()
    u, v = own[0], own[2]
    rows, columns = len(v), len(u)
    uv = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    uv = one.low + uv * (one.high - one.low)
    index = np.arange(rows * columns).reshape(rows, columns)
    triangles = _triangles(index, on_surface(face, uv))
    mesh = occ.Poly.Poly_Triangulation(len(uv), len(triangles), True)
    for k, (first, second) in enumerate(uv.tolist(), start=1):
        mesh.SetUVNode(k, occ.gp.gp_Pnt2d(first, second))
    for k, (a, b, c) in enumerate((triangles + 1).tolist(), start=1):
        mesh.SetTriangle(k, occ.Poly.Poly_Triangle(a, b, c))
    mesh.Deflection(sag / 2)
    builder, place = occ.BRep.BRep_Builder(), face.shape.Location()
    builder.UpdateFace(face.shape, mesh)
    border = (index[0], index[-1], index[:, 0], index[:, -1])
    polygons: dict[int, list[Any]] = {}
    for side, nodes, back in zip(one.sides, border, one.is_back, strict=True):
        edge, oriented = face.sides[side]
        parts = own[one.sides.index(side)]
        polygon = _polygon(
            oriented, nodes[::-1] if back else nodes, 1 - parts[::-1] if back else parts
        )
        polygons.setdefault(edge, []).append((oriented, polygon))
    for pairs in polygons.values():
        builder.UpdateEdge(pairs[0][0], *(polygon for _, polygon in pairs), mesh, place)


def _triangles(index: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Two for each cell of a grid, along its shorter diagonal."""
    a, b, d, c = (
        own.ravel() for own in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:])
    )
    one, other = (np.linalg.norm(points[p] - points[q], axis=1) for p, q in ((a, c), (b, d)))
    is_one = (one <= other * (1 + 1e-9))[:, None]
    first = np.where(is_one, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(is_one, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return np.concatenate([first, second])


def _polygon(edge: Any, nodes: np.ndarray, fractions: np.ndarray) -> Any:
    occ = opencascade()
    first, last = occ.BRep.BRep_Tool.Range_s(edge)
    numbers = occ.collections.Array1_int(1, len(nodes))
    places = occ.collections.Array1_double(1, len(nodes))
    for k, (node, part) in enumerate(zip(nodes.tolist(), fractions.tolist(), strict=True), start=1):
        numbers.SetValue(k, node + 1)
        places.SetValue(k, first + (last - first) * part)
    return occ.Poly.Poly_PolygonOnTriangulation(numbers, places)
