"""Fixed points in a cage: their weights, found in parts or read from where they are kept."""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse
from tqdm import tqdm

from ..errors import FileError
from ..mesh.io.files import replacing
from ..numerics.harmonic import Harmonic
from ..numerics.nearest import nearest
from ..numerics.winding import winding
from .cage_shape import check_finite, check_inside
from .embedding import AbstractEmbedding
from .table import KINDS, NOTHING, SPARSE, DenseTable, SparseTable, blocked, put

if TYPE_CHECKING:
    from .cage import Cage

PART = 1 << 16
"""Points whose weights are found together."""

TOUCHING = 1e-6
"""Points this near to a harmonic cage, in its size, are on it."""

TRIED = 2000
"""Points that tell whether a sparse table is worth it."""

FORMAT = 2
"""Of the kept weights; others are made anew."""


def embedded(cage: "Cage", points: np.ndarray, refuse: bool) -> AbstractEmbedding:
    """Points with their weights; those outside a harmonic cage are refused, or get none.

    Weights that are not refused are for points that move: used once, so in double precision.
    """
    if refuse:
        check_finite(points)
    kept = _kept(cage, points) if refuse else None
    if kept is not None:
        return kept
    rows = np.random.default_rng(0).choice(len(points), min(TRIED, len(points)), replace=False)
    tried = _weights(cage, points, np.sort(rows), False)
    sparse = np.count_nonzero(np.abs(tried) > NOTHING) < SPARSE * tried.size
    parts = _parts(cage, points, refuse)
    kind = KINDS[cage.precision] if refuse else np.float64
    if sparse:
        pieces = [scipy.sparse.csr_array(np.where(np.abs(w) > NOTHING, w, 0.0)) for _, w in parts]
        whole = scipy.sparse.vstack(pieces, format="csr", dtype=kind)
        table: AbstractEmbedding = SparseTable(points, whole)
    else:
        blocks = blocked(len(points), len(cage.rest), kind)
        for first, weights in parts:
            put(blocks, first, weights)
        table = DenseTable(points, blocks)
    if refuse and cage.store is not None:
        _keep(table, _place(cage, points))
    return table


def _parts(cage: "Cage", points: np.ndarray, refuse: bool) -> Iterator[tuple[int, np.ndarray]]:
    with tqdm(total=len(points), desc="embedding", delay=2, leave=False) as bar:
        for first in range(0, len(points), PART):
            rows = np.arange(first, min(first + PART, len(points)))
            yield first, _weights(cage, points, rows, refuse)
            bar.update(len(rows))


def _weights(cage: "Cage", points: np.ndarray, rows: np.ndarray, refuse: bool) -> np.ndarray:
    solved, places = cage.solved, points[rows]
    if not isinstance(solved, Harmonic):
        return solved.weights(places)
    weights, kinds = solved.traced(places)
    near = np.flatnonzero(kinds > 0)  # others are among the grid's inside nodes alone
    faces = cage.shape.faces
    outside = near[winding(places[near], cage.rest, faces) <= 0.5]
    weights[outside] = 0.0
    if refuse and len(near):
        found = np.full(len(points), np.inf)
        found[rows[near]] = nearest(places[near], cage.rest, faces).distances
        size = float(np.ptp(cage.rest, axis=0).max())
        touching = near[found[rows[near]] <= TOUCHING * size]
        check_inside(points, rows[outside], rows[touching], found)
    return weights


def _place(cage: "Cage", points: np.ndarray) -> Path:
    """The file that keeps the weights, named by all that they depend on."""
    options = cage.coordinates, cage.cells, cage.shift, cage.precision
    digest = hashlib.sha256(f"{FORMAT} {options}".encode())
    for array in (cage.rest, cage.shape.faces, points):
        digest.update(str(array.shape).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    assert cage.store is not None
    return cage.store / f"cage-{digest.hexdigest()[:32]}.npz"


def _kept(cage: "Cage", points: np.ndarray) -> AbstractEmbedding | None:
    """The table in the store; None where there is none, or a damaged one."""
    if cage.store is None:
        return None
    try:
        with _place(cage, points).open("rb") as file, np.load(file) as found:
            if "blocks" in found:
                return DenseTable(points, found["blocks"])
            entries = found["data"], found["indices"], found["indptr"]
            shape = (len(points), len(cage.rest))
            return SparseTable(points, scipy.sparse.csr_array(entries, shape=shape))
    except Exception:  # whatever a damaged file makes of itself, it is made anew
        return None


def _keep(table: AbstractEmbedding, path: Path) -> None:
    """Write the table; where the folder cannot be written to, the next run finds it anew."""
    try:
        path.parent.mkdir(exist_ok=True)
        with replacing(path) as file:
            if isinstance(table, DenseTable):
                np.savez(file, blocks=table.blocks)
            elif isinstance(table, SparseTable):
                entries = table.weights
                np.savez(file, data=entries.data, indices=entries.indices, indptr=entries.indptr)
    except (OSError, FileError):
        return
