"""Structured patches welded into one triangulated surface."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..errors import GeometryError, ParameterError
from . import topology
from .grid import Grid
from .mend import BULGE, mended
from .surface import Surface

TOLERANCE = 1e-3
"""Points of two borders are one if they are nearer than this part of the cells' shorter sides."""

COLLAPSED = 1e-5
"""A side of a cell that is shorter than this part of the longest at its point is no length to
compare with: the cell has collapsed there."""

SMOOTH_DEG = 40.0
"""Patches meet smoothly if the angle between their faces is smaller along most of their border."""


@dataclass(frozen=True)
class Stitching:
    """How patches became one surface. Blocks are counted from 1."""

    blocks: int
    welded: int
    """Points that became one with an earlier one."""
    largest_gap: float
    """Between points that became one [the points' unit]."""
    dropped: int
    """Triangles of collapsed cells."""
    turned: tuple[int, ...]
    """Blocks that had shown the other side."""
    loops: tuple[np.ndarray, ...]
    """Points around each opening."""
    smooth: tuple[tuple[int, ...], ...]
    """Blocks that meet smoothly: such groups often are the parts of an aircraft."""
    origin: np.ndarray
    """Point of the grid that each point of the surface is: `surface.moved(grid.points[origin])`."""

    def sentences(self) -> list[str]:
        """What was done, and what it suggests."""
        told = [
            f"{self.welded} points welded across gaps of up to {self.largest_gap:.2g}",
            f"{self.dropped} triangles of collapsed cells dropped",
            f"blocks turned over: {listed(self.turned) or 'none'}",
        ]
        if self.loops:
            sizes = ", ".join(str(len(loop)) for loop in self.loops[:10])
            more = ", ..." if len(self.loops) > 10 else ""
            told.append(f"openings left: {len(self.loops)}, of {sizes}{more} points")
        groups = "; ".join(listed(group) for group in self.smooth)
        return [*told, f"blocks that meet smoothly, perhaps your components: {groups}"]


def stitched(
    grid: Grid,
    components: Mapping[str, Sequence[int]] | None = None,
    tolerance: float = TOLERANCE,
) -> tuple[Surface, Stitching]:
    """Weld surface patches into one triangulation that looks outward, and tell what was done.

    Points on the borders of patches become one if they lie within `tolerance` times the shortest
    side of the cells around them. Cells are cut along their shorter diagonal, unless that lies
    outside the cell. Closed surfaces look outward; open ones to the side to which they bulge.
    `components` names blocks, counted from 1; the others are called by their numbers. Stitch once
    and move the surface, rather than stitch again what was moved: the diagonals might change.
    """
    if not 0 <= tolerance < 0.5:
        raise ParameterError(f"a stitch's tolerance is a part of a cell below 0.5, got {tolerance}")
    tags, names = named(len(grid.shapes), components or {})
    numbers = layouts(grid)
    points = np.asarray(grid.points)
    leader = welded(points, numbers, tolerance)
    cells = [_cells(layout) for layout in numbers]
    block = np.repeat(np.arange(len(cells)), [2 * len(quads) for quads in cells])
    faces = leader[_cut(points, np.concatenate(cells))]
    whole = Surface(
        points,
        faces,
        tags[block],
        names,
        {"origin": np.arange(len(points))},
        {"face": np.arange(len(faces))},
    )
    surface, mending = mended(whole)
    origin, remains = surface.point_data["origin"], np.asarray(surface.face_data["face"])
    is_turned = np.isin(remains, mending.turned_faces)
    is_inward = _looks_inward(surface)
    result = np.where(is_inward[:, None], surface.faces[:, [0, 2, 1]], surface.faces)
    surface = Surface(surface.points, result, surface.tags, names)
    report = Stitching(
        blocks=len(numbers),
        welded=int(np.sum(leader != np.arange(len(points)))),
        largest_gap=float(np.linalg.norm(points - points[leader], axis=1).max(initial=0.0)),
        dropped=len(faces) - len(remains),
        turned=tuple((np.unique(block[remains[is_turned ^ is_inward]]) + 1).tolist()),
        loops=tuple(topology.boundary_loops(result)),
        smooth=_smooth_groups(surface, block[remains], len(numbers)),
        origin=np.asarray(origin),
    )
    return surface, report


def listed(numbers: Sequence[int]) -> str:
    """Numbers with runs drawn together: 1-3,7."""
    ordered = sorted(numbers)
    starts = [n for n in ordered if n - 1 not in ordered]
    ends = [n for n in ordered if n + 1 not in ordered]
    runs = zip(starts, ends, strict=True)
    return ",".join(str(a) if a == b else f"{a}-{b}" for a, b in runs)


def named(
    count: int, components: Mapping[str, Sequence[int]]
) -> tuple[Int[np.ndarray, "b"], tuple[str, ...]]:
    """The component of each block, and their names."""
    owner: dict[int, str] = {}
    for name, blocks in components.items():
        if not len(blocks):
            raise ParameterError(f"component {name!r} names no block; give one or more")
        for number in blocks:
            if not 1 <= number <= count:
                raise ParameterError(
                    f"component {name!r} names block {number}; the grid has blocks 1 to {count}"
                )
            if owner.setdefault(number, name) != name:
                raise ParameterError(
                    f"block {number} belongs to {owner[number]!r} and {name!r}; name it once"
                )
    labels = [owner.get(number, str(number)) for number in range(1, count + 1)]
    names = (*components, *(str(n) for n in range(1, count + 1) if n not in owner))
    return np.array([names.index(label) for label in labels]), names


def layouts(grid: Grid) -> list[Int[np.ndarray, "ni nj"]]:
    """Numbers of each patch's points, as rows and columns."""
    layouts, start = [], 0
    for number, (ni, nj, nk) in enumerate(grid.shapes, start=1):
        size = ni * nj * nk
        sides = [length for length in (ni, nj, nk) if length > 1]
        if len(sides) != 2:
            raise GeometryError(
                f"block {number} has {ni} x {nj} x {nk} points, expected a surface patch, with one "
                "of these 1 and the others more; leave such blocks out"
            )
        layouts.append((start + np.arange(size)).reshape(sides[1], sides[0]).T)
        start += size
    return layouts


def _cells(layout: Int[np.ndarray, "ni nj"]) -> Int[np.ndarray, "q 4"]:
    corners = [layout[:-1, :-1], layout[1:, :-1], layout[1:, 1:], layout[:-1, 1:]]
    return np.stack([corner.ravel() for corner in corners], axis=1)


def welded(points: np.ndarray, layouts: list[np.ndarray], tolerance: float) -> Int[np.ndarray, "n"]:
    """For each point the first one that lies in the same place; borders need only be near."""
    kept, index = topology.weld(points)
    leader = kept[index]
    reach = tolerance * _spacing(points, layouts)
    border = [np.r_[a[0], a[-1], a[1:-1, 0], a[1:-1, -1]] for a in layouts]
    lone = np.unique(leader[np.concatenate(border)])
    near = cKDTree(points[lone]).query_ball_point(points[lone], reach[lone])
    one = np.repeat(np.arange(len(lone)), [len(others) for others in near])
    other = np.concatenate([np.array(others, int) for others in near])
    gap = np.linalg.norm(points[lone[one]] - points[lone[other]], axis=1)
    is_mutual = gap <= reach[lone[other]]
    pairs = (np.ones(is_mutual.sum(), bool), (one[is_mutual], other[is_mutual]))
    _, group = connected_components(coo_array(pairs, (len(lone), len(lone))), directed=False)
    _, first = np.unique(group, return_index=True)
    merged = np.arange(len(points))
    merged[lone] = lone[first[group]]
    return merged[leader]


def _spacing(points: np.ndarray, layouts: list[np.ndarray]) -> Float[np.ndarray, "n"]:
    """The shortest side of the cells at each point that has not collapsed."""
    pairs = [
        np.stack([a.ravel(), b.ravel()], axis=1)
        for layout in layouts
        for a, b in ((layout[1:], layout[:-1]), (layout[:, 1:], layout[:, :-1]))
    ]
    sides = np.concatenate(pairs)
    length = np.linalg.norm(points[sides[:, 0]] - points[sides[:, 1]], axis=1)
    longest, shortest = np.zeros(len(points)), np.full(len(points), np.inf)
    for end in sides.T:
        np.maximum.at(longest, end, length)
    for end in sides.T:
        is_proper = length > COLLAPSED * longest[end]
        np.minimum.at(shortest, end[is_proper], length[is_proper])
    return np.where(np.isfinite(shortest), shortest, 0.0)


def _cut(points: np.ndarray, cells: Int[np.ndarray, "q 4"]) -> Int[np.ndarray, "m 3"]:
    """Two triangles of each cell, on one side of it."""
    a, b, c, d = (points[cells[:, k]] for k in range(4))
    first, second = np.linalg.norm(c - a, axis=1), np.linalg.norm(d - b, axis=1)
    is_first = first <= second
    along = np.einsum("ij,ij->i", np.cross(b - a, c - a), np.cross(c - a, d - a))
    across = np.einsum("ij,ij->i", np.cross(b - a, d - a), np.cross(c - b, d - b))
    is_first = np.where((along < 0) != (across < 0), across < 0, is_first)
    one = np.where(is_first[:, None], cells[:, [0, 1, 2]], cells[:, [0, 1, 3]])
    other = np.where(is_first[:, None], cells[:, [0, 2, 3]], cells[:, [1, 2, 3]])
    return np.stack([one, other], axis=1).reshape(-1, 3)


def _looks_inward(surface: Surface) -> np.ndarray:
    """Faces of open pieces that bulge inward, seen from the middle of their border."""
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    number, piece = topology.pieces(faces)
    is_inward = np.zeros(len(faces), bool)
    for own in (piece == k for k in range(number)):
        border = np.unique(topology.edges(faces[own]).open)
        if not len(border):
            continue  # mending has turned closed ones outward
        a, b, c = np.moveaxis((points - points[border].mean(axis=0))[faces[own]], 1, 0)
        volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
        is_inward[own] = volume < -BULGE * area**1.5
    return is_inward


def _smooth_groups(
    surface: Surface, block: Int[np.ndarray, "m"], count: int
) -> tuple[tuple[int, ...], ...]:
    """Blocks, from 1, joined by borders of which most is smooth."""
    a, b, c = (np.asarray(surface.points)[np.asarray(surface.faces)[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    sizes = np.linalg.norm(normals, axis=1)
    near = topology.neighbours(surface.faces)
    is_border = (block[near.one] != block[near.other]) & (sizes[near.one] * sizes[near.other] > 0)
    one, other = near.one[is_border], near.other[is_border]
    cosine = np.einsum("ij,ij->i", normals[one], normals[other]) / (sizes[one] * sizes[other])
    is_smooth = cosine > np.cos(np.radians(SMOOTH_DEG))
    pair = np.minimum(block[one], block[other]) * count + np.maximum(block[one], block[other])
    most = 2 * np.bincount(pair[is_smooth], minlength=count**2) > np.bincount(
        pair, minlength=count**2
    )
    joined = np.flatnonzero(most)
    links = (np.ones(len(joined), bool), (joined // count, joined % count))
    number, group = connected_components(coo_array(links, (count, count)), directed=False)
    return tuple(tuple((np.flatnonzero(group == k) + 1).tolist()) for k in range(number))
