"""Closed coarse surfaces around a geometry: cages."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy.sparse
from jaxtyping import Float
from scipy import ndimage
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from ..errors import GeometryError, ParameterError
from ..numerics.nearest import nearest
from ..numerics.winding import winding
from .intersections import self_intersections
from .surface import Surface
from .symmetric import FLIP, evened, joined, with_image
from .topology import edges, is_closed, nonmanifold_vertices

CELLS = 2
"""Of the grid on which distances are sampled, in the offset."""

MOST_CELLS = 4_000_000
"""Of that grid; a smaller offset needs more."""

FINE = 0.6
"""Edges of the surface at the offset from which a cage's points are chosen, in the offset."""

ROUNDS = 8
"""In which the points of a cage spread out evenly."""

PUSHES = 60
"""In which a cage is moved outwards until it encloses."""

NEAREST = 0.4
"""Of the offset, how near the cage may come."""

GROWTH = 1.3
"""Of the number of faces, where as many as asked for cannot enclose."""

SAMPLES, SAMPLED = 20_000, 200
"""Points of the geometry whose distances from the cage are measured, and how many along it."""


Denser = tuple[tuple[float, float, float], float, float]
"""A place, a radius and a factor."""


class Enclosure(NamedTuple):
    """A closed surface around a geometry.

    Attributes
    ----------
    surface
        The cage.
    clearance
        How near it comes to the geometry [m].
    """

    surface: Surface
    clearance: float


def enclosure(
    geometry: Surface,
    faces: int = 200,
    offset: float = 0.05,
    component: str | None = None,
    denser: Sequence[Denser] = (),
    symmetric: bool = False,
) -> Enclosure:
    """A closed, even triangulation of about `faces` triangles around a surface or a part of it.

    `offset` is about its distance, as a part of the diagonal of what it encloses. Each of `denser`,
    a place, a radius [m] and a factor, makes edges within that radius about as many times shorter.
    There are more faces than asked for where fewer cannot enclose it at that distance. Where it is
    `symmetric` a half model and its mirror image about y = 0 are enclosed, by a surface that is
    symmetric to the bit.

    Raises
    ------
    GeometryError
        Where no such surface encloses it.
    """
    if faces < 20 or not 0 < offset <= 1:
        raise ParameterError(
            f"a cage has 20 faces or more and an offset of 0 to 1, got {faces} and {offset}"
        )
    points, triangles = part_of(geometry, component)
    whole = with_image(points, triangles) if symmetric else (points, triangles)
    diagonal = float(np.linalg.norm(np.ptp(whole[0], axis=0)))
    if not np.isfinite(diagonal) or diagonal == 0:
        raise GeometryError("a cage needs a geometry of finite size, got one without extent")
    reach = offset * diagonal
    fine = _at_distance(*whole, reach)
    count = faces
    while count < len(fine.faces) / 4:
        cage = _half(fine, count, denser) if symmetric else _coarse(fine, count // 2 + 2, denser)
        if cage is not None and _is_whole(cage):
            cage = _pushed(cage, points, triangles, reach, symmetric)
            clearance = clear_of(cage, points, triangles)
            if clearance > 0:
                return Enclosure(cage, clearance)
        count = int(GROWTH * count) + 2
    raise GeometryError(
        f"no cage of {faces} faces or some more encloses this geometry at {reach:.3g}; ask for a "
        "larger offset"
    )


def clear_of(cage: Surface, points: np.ndarray, triangles: np.ndarray) -> float:
    """How near a cage comes to triangles inside it [m]; 0 where it does not enclose them."""
    around, faces = np.asarray(cage.points), np.asarray(cage.faces)
    used = points[np.unique(triangles)]
    if not is_closed(faces) or np.any(winding(used, around, faces) < 0.99):
        return 0.0
    joined = np.concatenate([around, points])
    crossing = self_intersections(joined, np.concatenate([faces, triangles + len(around)]))
    count = len(faces)
    mine, other = crossing.pairs[:, 0] < count, crossing.pairs[:, 1] < count
    if np.any(mine != other) or np.any(mine & other):
        return 0.0
    places = _sampled(points, triangles, float(np.ptp(used, axis=0).max()) / SAMPLED)
    return float(nearest(places[:: len(places) // SAMPLES + 1], around, faces).distances.min())


def part_of(geometry: Surface, component: str | None) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a surface, or of one component."""
    points, triangles = np.asarray(geometry.points), np.asarray(geometry.faces)
    if component is not None:
        geometry.component(component)  # refuses an unknown one
        own = np.asarray(geometry.tags) == geometry.components.index(component)
        triangles = triangles[own]
    if not len(triangles):
        raise GeometryError("a cage needs a geometry of triangles, got none")
    used, index = np.unique(triangles, return_inverse=True)
    return points[used], index.reshape(-1, 3)


def _at_distance(points: np.ndarray, triangles: np.ndarray, reach: float) -> Surface:
    """The surface at a distance from triangles, what it encloses filled."""
    from manifold3d import Manifold

    depth, bounds = _depth(points, triangles, reach)
    mesh = Manifold.level_set(depth, bounds, FINE * reach).to_mesh64()
    return Surface(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))


def _half(fine: Surface, count: int, denser: Sequence[Denser]) -> Surface | None:
    """About `count` triangles, half of them on each side of y = 0."""
    points, faces = np.asarray(fine.points), np.asarray(fine.faces)
    faces = faces[np.all(points[faces, 1] >= 0, axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    points, faces = points[used], faces.reshape(-1, 3)
    a, b, c = (points[faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    found = edges(faces)
    border = points[found.ends[found.uses == 1]]
    length = np.linalg.norm(border[:, 0] - border[:, 1], axis=1).sum()
    on_plane = length / np.sqrt(4 / np.sqrt(3) * area / (count / 2))  # edges of even triangles
    cage = _coarse(Surface(points, faces), int(count / 2 + on_plane + 2) // 2, denser)
    return None if cage is None else joined(np.asarray(cage.points), np.asarray(cage.faces))


def _is_whole(cage: Surface) -> bool:
    faces = np.asarray(cage.faces)
    every_point = len(np.unique(faces)) == len(cage.points)
    is_closed_once = bool(np.all(edges(faces).uses == 2))
    return every_point and is_closed_once and not len(nonmanifold_vertices(faces))


def _coarse(fine: Surface, count: int, denser: Sequence[Denser]) -> Surface | None:
    """As many of a surface's points, evenly spread, joined where their regions meet.

    Source: Valette and Chassery, Approximated Centroidal Voronoi Diagrams for Uniform Polygonal
    Mesh Coarsening, Computer Graphics Forum 23, 2004, with distances along edges.
    """
    points, faces = np.asarray(fine.points), np.asarray(fine.faces)
    ends = edges(faces).ends
    lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    middle = points[ends].mean(axis=1)
    for place, radius, factor in denser:
        lengths[np.linalg.norm(middle - np.asarray(place), axis=1) < radius] *= factor
    graph = scipy.sparse.csr_array((lengths, tuple(ends.T)), shape=(len(points),) * 2)
    seeds = [int(points[:, 0].argmin())]
    far = dijkstra(graph, directed=False, indices=seeds[0])
    for _ in range(count - 1):
        seeds.append(int(far.argmax()))
        far = np.minimum(far, dijkstra(graph, directed=False, indices=seeds[-1], limit=far.max()))
    for _ in range(ROUNDS):
        owner = _owners(graph, seeds)
        totals = np.stack([np.bincount(owner, x, count) for x in points.T], axis=1)
        middles = totals / np.bincount(owner, minlength=count)[:, None]
        gaps = np.linalg.norm(points - middles[owner], axis=1)
        order = np.lexsort((gaps, owner))
        seeds = order[np.searchsorted(owner[order], np.arange(count))].tolist()
    corners = _owners(graph, seeds)[faces]
    met = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    return Surface(points[seeds], met) if len(met) else None


def _owners(graph: scipy.sparse.csr_array, seeds: list[int]) -> np.ndarray:
    """Which seed is nearest to each point."""
    _, _, sources = dijkstra(
        graph, directed=False, indices=seeds, min_only=True, return_predecessors=True
    )
    number = np.zeros(graph.shape[0], int)
    number[seeds] = np.arange(len(seeds))
    return number[sources]


def _pushed(
    cage: Surface, points: np.ndarray, triangles: np.ndarray, reach: float, symmetric: bool
) -> Surface:
    """The cage with its points moved outwards until it is far enough from all triangles."""
    places = _sampled(points, triangles, reach)
    around, faces = np.array(cage.points), np.asarray(cage.faces)
    image = evened(around)[1] if symmetric else np.arange(len(around))
    for _ in range(PUSHES):
        found = nearest(places, around, faces)
        inside = winding(places, around, faces) > 0.5
        lacking = NEAREST * reach - np.where(inside, found.distances, -found.distances)
        short = np.zeros(len(faces))
        np.maximum.at(short, found.faces, lacking)
        if short.max() <= 0:
            break
        push = np.zeros(len(around))
        for corner in faces.T:
            np.maximum.at(push, corner, short)
        around += 1.1 * np.maximum(push, push[image])[:, None] * _normals(around, faces)
        if symmetric:
            around = (around + FLIP * around[image]) / 2
    return Surface(around, faces)


def _normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (points[faces[:, i]] for i in range(3))
    total = np.zeros_like(points)
    for corner in faces.T:
        np.add.at(total, corner, np.cross(b - a, c - a))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return total / np.where(length > 0, length, 1.0)  # none where its faces fold onto each other


def _depth(
    points: np.ndarray, triangles: np.ndarray, reach: float
) -> tuple[Callable[[float, float, float], float], list[float]]:
    """How deep places are below the surface at a distance, what it encloses filled; and where."""
    step = reach / CELLS
    low = points.min(axis=0) - 2.5 * reach
    counts = np.ceil((points.max(axis=0) + 2.5 * reach - low) / step).astype(int) + 1
    if counts.prod() > MOST_CELLS:
        raise GeometryError(
            f"an offset of {reach:.3g} is too small for a geometry of "
            f"{np.ptp(points, axis=0).round(3).tolist()}: ask for a larger one"
        )
    axes = [low[d] + step * np.arange(counts[d]) for d in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    tree = KDTree(_sampled(points, triangles, step / 2))
    far = tree.query(nodes, distance_upper_bound=2 * reach, workers=-1)[0]
    depth = reach - np.minimum(far, 2 * reach)
    pieces, _ = ndimage.label(depth < 0)
    depth[(depth < 0) & (pieces != pieces[0, 0, 0])] = reach  # what it encloses is inside
    table, last = depth.tolist(), (counts - 2).tolist()

    def deep(x: float, y: float, z: float) -> float:
        u, v, w = (x - low[0]) / step, (y - low[1]) / step, (z - low[2]) / step
        i, j, k = (min(max(int(n), 0), m) for n, m in zip((u, v, w), last, strict=True))
        a, b, c = u - i, v - j, w - k  # beyond the grid it goes on as at its border
        value = 0.0
        for p, s in ((0, 1 - a), (1, a)):
            for q, t in ((0, 1 - b), (1, b)):
                row = table[i + p][j + q]
                value += s * t * ((1 - c) * row[k] + c * row[k + 1])
        return value

    inset = 0.5 * step
    ends = [axis[-1] - inset for axis in axes]
    return deep, [*(low + inset).tolist(), *ends]


def _sampled(points: np.ndarray, triangles: np.ndarray, spacing: float) -> Float[np.ndarray, "s 3"]:
    """Points on triangles, no place farther from the next than the spacing."""
    corners = points[triangles]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(np.ceil(sides / spacing).astype(int), 1)
    found = [points]
    for count in np.unique(parts[parts > 1]):
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        inside = i + j <= count
        weights = np.stack([i, j, count - i - j], axis=-1)[inside] / count
        found.append((weights @ corners[parts == count]).reshape(-1, 3))
    return np.concatenate(found)
