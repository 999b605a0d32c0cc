"""A Cartesian grid fitted to a cage: what is inside, its links, and what is near it outside.

Lengths are in units of the grid's spacing, which each axis has its own of; node (i, j, k) is at
(i, j, k). No node may lie on the cage. Whether a node is inside is counted along all three axes,
which must agree; where they do not, the grid is moved and tried again.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..errors import GeometryError, ParameterError
from . import cage_grid_loops as loops
from .multigrid import Hits, Links

SHIFTS = ((0.5, 0.5, 0.5), (0.382, 0.414, 0.449), (0.618, 0.146, 0.303), (0.236, 0.732, 0.568))
"""Where the first node lies before the cage's lowest point; the first one keeps mirror symmetry."""

NEAR = 1e-11
"""Corners this near to a grid line are on it, nodes this near to the cage on that."""

PAD = 2
"""Further nodes around the cage, so that a look-up never leaves the grid."""

PROBE = 32
"""Cells along each axis of the grid that measures the cage."""

ACROSS = 6
"""Cells that the thin places of a cage get by default."""

THIN = 0.05
"""Part of the volume, or of the unknowns, that may lie in still thinner places."""

WANTED = 30_000
"""Inside nodes of the default grid where the thin places do not need more."""

MOST = 200_000
"""Inside nodes of the default grid."""

MOST_NODES = 50_000_000
"""Nodes of any grid, inside or not."""


class Cut(NamedTuple):
    """Grid lines of one axis against the cage, sorted: line n has the hits start[n] : start[n+1].

    `place` is the hits' coordinate along the axis, `face` the triangle, `shares` its corners'.
    """

    start: np.ndarray
    place: np.ndarray
    face: np.ndarray
    shares: np.ndarray


class Grid(NamedTuple):
    """A grid around a cage with `corners`; `number` counts the inside nodes, -1 elsewhere.

    `shift` is the number of that among `SHIFTS` which it took.
    """

    origin: np.ndarray
    spacing: np.ndarray
    corners: np.ndarray
    faces: np.ndarray
    cuts: tuple[Cut, Cut, Cut]
    number: Int[np.ndarray, "nx ny nz"]
    shift: int

    @property
    def size(self) -> int:
        """The number of inside nodes."""
        return int(self.number.max()) + 1

    @property
    def nodes(self) -> Int[np.ndarray, "n 3"]:
        """Integer places of the inside nodes."""
        return np.argwhere(self.number >= 0)


def fitted(
    points: Float[np.ndarray, "m 3"],
    faces: Int[np.ndarray, "t 3"],
    cells: Sequence[int],
    shift: int | None = None,
) -> Grid:
    """The grid with so many cells over the cage's extent along each axis.

    It takes the first of the shifts with which all lines agree, or only that of the given number.
    """
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    shape = np.asarray(cells, np.int64) + 2 * PAD + 1
    if np.prod(shape.astype(float)) > MOST_NODES:
        raise ParameterError(
            f"a cage's grid of {' x '.join(map(str, cells))} cells has more than {MOST_NODES:,} "
            "nodes; give fewer cells"
        )
    spacing = extent / np.asarray(cells)
    for number in range(len(SHIFTS)) if shift is None else [shift]:
        origin = low - (PAD - 1 + np.array(SHIFTS[number])) * spacing
        corners = _snapped((points - origin) / spacing)
        cuts = tuple(_cut(corners, faces, axis, shape) for axis in range(3))
        inside = _inside(cuts, shape)
        if inside is not None:
            index = np.where(inside, np.cumsum(inside).reshape(shape) - 1, -1).astype(np.int32)
            return Grid(origin, spacing, corners, faces, cuts, index, number)  # type: ignore[arg-type]
    if shift is not None:
        raise GeometryError(
            f"nodes of the grid of {' x '.join(map(str, cells))} cells lie on the cage; give one "
            "cell more or less"
        )
    raise GeometryError(
        f"lines along x, y and z through the cage of {len(points)} points and {len(faces)} "
        "triangles disagree on what is inside; a cage must be closed and must not cross itself"
    )


def _snapped(corners: np.ndarray) -> np.ndarray:
    """Corners that rounding put beside a grid line are on it: what is left of what is exact."""
    lines = np.rint(corners)
    return np.ascontiguousarray(np.where(np.abs(corners - lines) <= NEAR, lines, corners))


def _cut(corners: np.ndarray, faces: np.ndarray, axis: int, shape: np.ndarray) -> Cut:
    room = 0
    for _ in range(2):  # count, then fill in
        line, face = np.empty(room, np.int64), np.empty(room, np.int32)
        shares = np.empty((room, 3))
        room = loops.hits(corners, faces, axis, shape, line, face, shares)
    place = np.einsum("hk,hk->h", shares, corners[faces[face], axis])
    order = np.lexsort((place, line))
    lines = int(shape[(axis + 1) % 3] * shape[(axis + 2) % 3])
    start = np.searchsorted(line[order], np.arange(lines + 1))
    return Cut(start, place[order], face[order], shares[order])


def _inside(cuts: tuple[Cut, ...], shape: np.ndarray) -> np.ndarray | None:
    """Which nodes are inside; None if the three axes do not agree, or a node is on the cage."""
    votes = np.zeros(shape, np.uint8)
    for axis, cut in enumerate(cuts):
        is_on = np.abs(cut.place - np.rint(cut.place)) <= NEAR
        if np.any(np.diff(cut.start) % 2) or np.any(is_on):
            return None
        loops.vote(axis, shape, cut.start, cut.place, votes)
    return votes == 3 if np.all(votes % 3 == 0) else None


def linked(grid: Grid) -> tuple[Links, Hits]:
    """The links of the inside nodes, their distances in true lengths, and where the cage cuts."""
    near, gap = np.empty((grid.size, 6), np.int32), np.empty((grid.size, 6))
    shape, first = np.array(grid.number.shape), 0
    for axis, cut in enumerate(grid.cuts):
        loops.link(axis, shape, cut.start, cut.place, first, grid.number, near, gap)
        first += len(cut.place)
    faces, shares = (
        np.concatenate([getattr(cut, name) for cut in grid.cuts]) for name in ("face", "shares")
    )
    links = Links(near, gap * np.repeat(grid.spacing, 2), grid.nodes)
    return links, Hits(grid.faces[faces], shares)


def approached(grid: Grid) -> tuple[np.ndarray, Hits]:
    """The outside nodes that a look-up may touch, as places (k, 3), and the nearest on the cage."""
    distance = np.full(grid.number.shape, np.inf)
    face = np.full(grid.number.shape, -1, np.int32)
    shares = np.empty((*grid.number.shape, 3))
    loops.approach(grid.corners, grid.faces, grid.number, distance, face, shares)
    near = face >= 0
    return np.argwhere(near), Hits(grid.faces[face[near]], shares[near])


def suitable(points: np.ndarray, faces: np.ndarray) -> tuple[int, int, int]:
    """Cells along each axis that resolve the cage's thin places, from lines through it."""
    probe = fitted(points, faces, (PROBE,) * 3)
    cells = np.empty(3)
    for axis, cut in enumerate(probe.cuts):
        length = np.sort(cut.place[1::2] - cut.place[::2]) / PROBE
        thin = np.searchsorted(np.cumsum(length), THIN * length.sum())
        cells[axis] = ACROSS / length[thin]
    lines = probe.cuts[0]
    volume = np.sum(lines.place[1::2] - lines.place[::2]) / PROBE**3
    unknowns = volume * np.prod(cells)
    cells *= (np.clip(unknowns, WANTED, MOST) / unknowns) ** (1 / 3)
    return tuple(int(2 * np.ceil(n / 2)) for n in cells)  # type: ignore[return-value]
