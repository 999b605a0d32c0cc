"""Harmonic functions on a grid with cut links, for many boundary data at once.

Each node is the average of its six neighbours, or of the boundary's values where a link is cut.
The grids are coarsened along one axis at a time, always the one whose links are shortest, by
leaving out every second node; the links of the coarser grid follow from those of the finer one
alone. Sweeps of averaging and corrections from the coarser grids (V-cycles) then converge at a
rate that does not depend on the number of nodes.
"""

from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from . import multigrid_loops as loops
from .threads import cores, spread

TOLERANCE = 1e-13
"""Largest change of a value in the last cycle."""

LIMIT = 200
"""V-cycles at most."""

COARSEST = 64
"""A grid of fewer nodes is not coarsened."""


class Links(NamedTuple):
    """The six neighbours of each node, below and above along each axis.

    `near` holds their rows, -1 - hit where the boundary comes first, `gap` their distances and
    `node` the nodes' integer places on the grid.
    """

    near: np.ndarray
    gap: np.ndarray
    node: np.ndarray


class Hits(NamedTuple):
    """Where the boundary cuts links: three vertices and their barycentric weights each."""

    corners: np.ndarray
    shares: np.ndarray


class Solved(NamedTuple):
    """Values (nodes, columns), the cycles they took, and the last one's largest change."""

    values: np.ndarray
    cycles: int
    change: float


def solved(links: Links, hits: Hits, columns: int, progress: bool = False) -> Solved:
    """The harmonic functions that are 1 at one vertex of the boundary and linear between them."""
    levels, axes, coarse = _levels(links)
    near, gap = (np.concatenate(part) for part in zip(*levels, strict=True))
    share, stiffness = np.empty_like(gap), np.empty(len(gap))
    loops.average(near, gap, share, stiffness)
    start = np.cumsum([0, *(len(level[0]) for level in levels)])
    blocks = -(-columns // loops.WIDTH)
    values, changes = np.empty((len(links.near), columns)), np.zeros(blocks)
    tables = start, axes, near, share, stiffness, coarse, hits.corners, hits.shares
    cycles = 0
    quiet = not progress or blocks <= cores()
    for first in tqdm(
        range(0, blocks, cores()), desc="harmonic weights", delay=2, leave=False, disable=quiet
    ):
        last = min(first + cores(), blocks)
        columns_here = values[:, first * loops.WIDTH : last * loops.WIDTH]
        local = hits.corners - first * loops.WIDTH
        found = spread(
            loops.solve, last - first, *tables[:6], local, hits.shares, TOLERANCE, LIMIT,
            columns_here, changes[first:last],
        )  # fmt: skip
        cycles = max(cycles, *found)
    return Solved(values, cycles, float(changes.max()))


def _levels(links: Links) -> tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray, np.ndarray]:
    """Neighbours and distances of each grid, the axis of each coarsening, and what remains."""
    near, gap, node = links
    levels, axes, coarse = [(near, gap)], [], []
    spacing = np.array([gap[:, 2 * a : 2 * a + 2].max() for a in range(3)])
    while len(node) > COARSEST:
        axis = int(np.argmin(np.where(np.ptp(node, axis=0) > 1, spacing, np.inf)))
        remains = node[:, axis] % 2 == 0
        if remains.all() or not remains.any():
            break
        row = np.where(remains, np.cumsum(remains) - 1, -1).astype(np.int32)
        count = int(remains.sum())
        finer, near, gap = (near, gap), np.empty((count, 6), np.int32), np.empty((count, 6))
        loops.coarsen(*finer, axis, row, near, gap)
        node = node[remains].copy()
        node[:, axis] //= 2
        spacing[axis] *= 2
        levels.append((near, gap))
        axes.append(axis)
        coarse.append(row)
    coarse.append(np.full(len(node), -1, np.int32))
    return levels, np.array(axes, np.int64), np.concatenate(coarse)
