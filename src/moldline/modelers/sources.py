"""Tracing of a union's new points to the edges and faces that made them."""

from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..errors import GeometryError
from .formulas import edge_through_triangle, three_planes

NEAR = 1e-9
"""A point is what a formula gives if it is no farther off than this part of the extent."""

INSIDE = 1e-7
"""Shares of an edge or a triangle may be below 0 by this, where rounding was large."""


class Sources(NamedTuple):
    """All solids with common numbers: nodes, faces, the input of each face."""

    nodes: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]
    surface: Int[np.ndarray, "m"]
    points: int
    """How many nodes are points of inputs; others follow them beyond the symmetry plane."""


class Traced(NamedTuple):
    """What new points are made of, as in `Provenance`, and which points they are."""

    on_edges: Int[np.ndarray, "e"]
    edges: Int[np.ndarray, "e 5"]
    on_triples: Int[np.ndarray, "t"]
    triples: Int[np.ndarray, "t 9"]
    residual: float


def traced(
    sources: Sources,
    places: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    face: Int[np.ndarray, "f"],
    fresh: Int[np.ndarray, "x"],
) -> Traced:
    """Trace the points `fresh` of a union; each of its faces is a part of a source's `face`.

    Around a point on an edge lie two faces of one solid, which have the edge in common, and one of
    another; around a point of three triangles lie these. What does not fit, since edge meets edge
    or points were merged, is tried in all ways.
    """
    near = NEAR * float(np.linalg.norm(np.ptp(sources.nodes, axis=0)))
    around, start = _around(faces, face, fresh, len(places))
    count = np.diff(start)
    three = np.flatnonzero(count == 3)
    triangles = around[start[three][:, None] + np.arange(3)]
    edges, edge_rows = _edges_of(sources, triangles)
    is_triple = (np.diff(np.sort(sources.surface[triangles], axis=1), axis=1) > 0).all(axis=1)
    triples = sources.faces[triangles[is_triple]].reshape(-1, 9)
    rows = np.full((len(fresh), 9), -1)
    rows[three[edge_rows], :5] = edges
    rows[three[is_triple]] = triples
    off = _misses(sources.nodes, rows, places[fresh])
    rows[off > near] = -1
    for k in np.flatnonzero(rows[:, 0] < 0).tolist():
        candidates = around[start[k] : start[k + 1]]
        rows[k] = _searched(sources, candidates, places[fresh[k]], near)
    on_triple = rows[:, 5] >= 0
    off = _misses(sources.nodes, rows, places[fresh])
    return Traced(
        fresh[~on_triple],
        rows[~on_triple, :5],
        fresh[on_triple],
        rows[on_triple],
        float(off.max(initial=0.0)),
    )


def _around(
    faces: np.ndarray, face: np.ndarray, fresh: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """The source faces around each of some points, ascending, and where each list starts."""
    place = np.full(count, -1)
    place[fresh] = np.arange(len(fresh))
    corner = place[faces]
    row, _ = np.nonzero(corner >= 0)
    pairs = np.unique(np.stack([corner[corner >= 0], face[row]], axis=1), axis=0)
    return pairs[:, 1], np.searchsorted(pairs[:, 0], np.arange(len(fresh) + 1))


def _edges_of(sources: Sources, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edge and triangle where two of three faces are neighbours, and the rows where they are."""
    surface = sources.surface[triangles]
    found, rows = [np.empty((0, 5), np.int64)], [np.empty(0, np.int64)]
    for one, other, third in ((0, 1, 2), (1, 2, 0)):
        row = np.flatnonzero(
            (surface[:, one] == surface[:, other]) & (surface[:, third] != surface[:, one])
        )
        a, b = (sources.faces[triangles[row, k]] for k in (one, other))
        is_shared = (a[:, :, None] == b[:, None, :]).any(axis=2)
        # beyond the plane lie extensions, whose own edges end in it and cross nothing there
        is_shared &= a < sources.points
        fits = is_shared.sum(axis=1) == 2
        ends = np.sort(a[fits][is_shared[fits]].reshape(-1, 2), axis=1)
        found.append(np.concatenate([ends, sources.faces[triangles[row[fits], third]]], axis=1))
        rows.append(row[fits])
    return np.concatenate(found), np.concatenate(rows)


def _misses(nodes: np.ndarray, rows: np.ndarray, places: np.ndarray) -> np.ndarray:
    """How far each point is from what its nodes make of it; infinite where they do not."""
    off = np.full(len(rows), np.inf)
    on_edge = (rows[:, 0] >= 0) & (rows[:, 5] < 0)
    on_triple = rows[:, 5] >= 0
    kinds = (on_edge, edge_through_triangle, 5), (on_triple, three_planes, 9)
    for mask, formula, width in kinds:
        with np.errstate(divide="ignore", invalid="ignore"):  # parallel ones have no point
            made, shares = formula(nodes[rows[mask, :width]])
            distance = np.linalg.norm(made - places[mask], axis=1)
            is_inside = (shares >= -INSIDE).all(axis=1)
        off[mask] = np.where(is_inside & np.isfinite(distance), distance, np.inf)
    return off


def _searched(
    sources: Sources, candidates: np.ndarray, place: np.ndarray, near: float
) -> np.ndarray:
    """The best of all edges and triangles of the faces around a point.

    Where several fit, as edge meets edge, the sharpest edge is taken: a point may leave an edge
    between faces in one plane, but not a sharp one.
    """
    surface = sources.surface[candidates]
    rows: list[list[int]] = []
    sharpness: list[float] = []
    for k in np.unique(surface).tolist():
        own, others = candidates[surface == k], candidates[surface != k]
        for ends, crease in _creases(sources, own).items():
            for other in others.tolist():
                rows.append([*ends, *sources.faces[other].tolist(), -1, -1, -1, -1])
                sharpness.append(crease)
    groups = [candidates[surface == k].tolist() for k in np.unique(surface)]
    for three in combinations(groups, 3):
        for choice in product(*three):
            rows.append(sources.faces[list(choice)].ravel().tolist())
            sharpness.append(-1.0)
    table = np.array(rows, np.int64).reshape(-1, 9)
    off = _misses(sources.nodes, table, np.broadcast_to(place, (len(table), 3)))
    fits = np.flatnonzero(off <= near)
    if not len(fits):
        raise GeometryError(
            "the union has a point near ({:.6g}, {:.6g}, {:.6g}) that belongs to no edge and face "
            "of the components; do they touch there without running through each other? move one "
            "of them a little".format(*place)
        )
    best = fits[np.lexsort([off[fits], -np.round(np.array(sharpness)[fits], 6)])[0]]
    return table[best]


def _creases(sources: Sources, faces: np.ndarray) -> dict[tuple[int, int], float]:
    """Edges of some faces of a solid, and how far the normals on both sides differ, 0 to 2.

    An edge of only one of the faces counts as if it were between faces in one plane.
    """
    sides: dict[tuple[int, int], list[np.ndarray]] = {}
    for f in faces.tolist():
        a, b, c = sources.nodes[sources.faces[f]]
        normal = np.cross(b - a, c - a)
        normal = normal / max(float(np.linalg.norm(normal)), 1e-300)
        for i, j in ((0, 1), (1, 2), (2, 0)):
            one, other = sorted((int(sources.faces[f, i]), int(sources.faces[f, j])))
            if other < sources.points:
                sides.setdefault((one, other), []).append(normal)
    return {
        ends: float(np.linalg.norm(both[0] - both[1])) if len(both) == 2 else 0.0
        for ends, both in sides.items()
    }
