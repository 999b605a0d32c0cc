"""One step of Loop's subdivision: four triangles for one, and the matrix that places the points."""

from typing import NamedTuple

import numpy as np
import scipy.sparse
from jaxtyping import Bool, Int


class Step(NamedTuple):
    """A refined triangulation.

    Attributes
    ----------
    faces
        The children of face k are 4k to 4k + 3: at its three corners in turn, and amidst.
    matrix
        New points from old ones: first those of the old points, then one for each edge.
    creases
        Both halves of each crease.
    """

    faces: Int[np.ndarray, "m 3"]
    matrix: scipy.sparse.csr_array
    creases: Int[np.ndarray, "c 2"]


class Edges(NamedTuple):
    """Each edge once, where each side of a face finds it, and whether it stays sharp."""

    ends: Int[np.ndarray, "e 2"]
    of_sides: Int[np.ndarray, "m 3"]
    is_sharp: Bool[np.ndarray, "e"]


class Entries(NamedTuple):
    """Entries of a sparse matrix."""

    weights: np.ndarray
    rows: np.ndarray
    columns: np.ndarray


def step(faces: np.ndarray, count: int, creases: np.ndarray, corners: np.ndarray) -> Step:
    """Refine once.

    Creases are pairs of points; edges of one face, or of more than two, are creases too. A point
    where three or more of these meet stays, as do the `corners`; where only one ends, it is as
    if there was none.
    """
    edges = sharpened(faces, count, creases)
    entries = _of_points(edges, count, corners), _of_edges(edges, faces, count)
    weights, rows, columns = (np.concatenate(both) for both in zip(*entries, strict=True))
    shape = (count + len(edges.ends), count)
    matrix = scipy.sparse.coo_array((weights, (rows, columns)), shape=shape).tocsr()
    a, b, c = np.asarray(faces).T
    ab, bc, ca = edges.of_sides.T + count
    children = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    middle = count + np.flatnonzero(edges.is_sharp)
    ends = edges.ends[edges.is_sharp]
    halves = [np.stack([ends[:, 0], middle], axis=1), np.stack([middle, ends[:, 1]], axis=1)]
    return Step(children, matrix, np.concatenate(halves))


def sharpened(faces: np.ndarray, count: int, creases: np.ndarray) -> Edges:
    """The edges of a triangulation, with creases and borders marked."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2).astype(np.int64)
    keys, place, uses = np.unique(_keys(sides, count), return_inverse=True, return_counts=True)
    ends = np.stack([keys // count, keys % count], axis=1)
    is_sharp = uses != 2
    wanted = _keys(creases, count)
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    is_sharp[at[keys[at] == wanted]] = True
    return Edges(ends, place.reshape(-1, 3), is_sharp)


def missing(faces: np.ndarray, count: int, creases: np.ndarray) -> np.ndarray:
    """Those of the pairs that no face has as an edge."""
    if not len(creases):
        return creases
    edges = sharpened(faces, count, np.empty((0, 2), np.int64))
    return creases[~np.isin(_keys(creases, count), _keys(edges.ends, count))]


def _keys(pairs: np.ndarray, count: int) -> np.ndarray:
    pairs = np.asarray(pairs, np.int64)
    return pairs.min(axis=1, initial=count) * count + pairs.max(axis=1, initial=0)


def _of_edges(edges: Edges, faces: np.ndarray, count: int) -> Entries:
    """3/8 of both ends and 1/8 of the points across; halfway where it is sharp."""
    number = np.arange(count, count + len(edges.ends), dtype=np.int32)
    across = np.roll(faces, 1, axis=1).ravel()  # of the side from corner k to corner k + 1
    side = edges.of_sides.ravel()
    is_smooth = ~edges.is_sharp[side]
    share = np.where(edges.is_sharp, 0.5, 0.375)
    return Entries(
        np.concatenate([share, share, np.full(is_smooth.sum(), 0.125)]),
        np.concatenate([number, number, number[side[is_smooth]]]),
        np.concatenate([*edges.ends.T, across[is_smooth]]).astype(np.int32),
    )


def _of_points(edges: Edges, count: int, corners: np.ndarray) -> Entries:
    """What each old point becomes, by how many sharp edges meet there."""
    start, end = np.concatenate([edges.ends, edges.ends[:, ::-1]]).T
    is_sharp = np.tile(edges.is_sharp, 2)
    valence = np.bincount(start, minlength=count)
    sharp = np.bincount(start[is_sharp], minlength=count)
    is_fixed = (sharp > 2) | (valence == 0)
    is_fixed[corners] = True
    is_crease = (sharp == 2) & ~is_fixed
    neighbours = np.maximum(valence, 1)
    smooth = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / neighbours) / 4) ** 2) / neighbours
    of_smooth = np.where(is_fixed | is_crease, 0.0, smooth)
    share = np.where(is_sharp & is_crease[start], 1 / 8, of_smooth[start])
    used = share > 0
    own = np.where(is_fixed, 1.0, np.where(is_crease, 0.75, 1 - valence * smooth))
    point = np.arange(count, dtype=np.int32)
    return Entries(
        np.concatenate([own, share[used]]),
        np.concatenate([point, start[used]]).astype(np.int32),
        np.concatenate([point, end[used]]).astype(np.int32),
    )
