"""Harmonic coordinates of a closed cage: how much each of its vertices moves a point inside.

The weights of a vertex are the harmonic function inside the cage that is linear on each of its
triangles, 1 at the vertex and 0 at all others. They are solved once at the nodes of a grid that is
fitted to the cage, and looked up from there by a smooth, positive rule that keeps their sum and
their mean: the weights of a point sum to one, and the vertices so weighted give the point.

Sources: Joshi, Meyer, DeRose, Green and Sanocki, Harmonic Coordinates for Character Articulation,
SIGGRAPH 2007; Shortley and Weller, J. Appl. Phys. 9, 1938. docs/theory/cage.md derives it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from ..errors import GeometryError, ParameterError
from . import cage_grid, harmonic_loops, multigrid
from .harmonic_plain import Tables, looked_up, sliver_slopes
from .kernel import empty
from .threads import spread

PROOF = 1e-10
"""What the weights at the nodes may miss them by, in extents of the cage."""

MOST_VALUES = 500_000_000
"""Numbers in the table of weights: 4 GB."""

THREAD_WORTH = 4096
"""Points that are worth a thread of their own."""


class Report(NamedTuple):
    """What the solution took and how good it is.

    `cells` are those over the cage's extent, `unknowns` the nodes inside, `cycles` those of the
    multigrid method and `change` the largest of a weight in the last one; `precision` is by how
    much the weights at the nodes miss them, in extents of the cage; `shift` is where the grid lies.
    """

    cells: tuple[int, int, int]
    unknowns: int
    cycles: int
    change: float
    precision: float
    shift: int


class Harmonic:
    """Harmonic coordinates inside a cage of triangles, closed and not crossing itself.

    The cage may have several components, or holes inside. `cells` are those of the grid over its
    extent, for all axes or each; by default thin places get six across. Weights then err by the
    square of the cells' size, and most near edges of the cage. `shift` puts the grid where another
    one's report says it was.

    Attributes
    ----------
    report
        What the solution took and how good it is.
    """

    def __init__(
        self,
        points: Float[np.ndarray, "m 3"],
        faces: Int[np.ndarray, "t 3"],
        cells: float | Sequence[float] | None = None,
        progress: bool = False,
        shift: int | None = None,
    ):
        points, faces = np.asarray(points, float), np.ascontiguousarray(faces, np.int64)
        if not np.all(np.ptp(points, axis=0) > 0):
            raise GeometryError(
                f"the cage must extend along x, y and z, its points cover {np.ptp(points, axis=0)}"
            )
        counts = cage_grid.suitable(points, faces) if cells is None else _counted(cells)
        grid = cage_grid.fitted(points, faces, counts, shift)
        if grid.size == 0:
            raise GeometryError(
                f"no node of a grid of {_product(counts)} cells lies inside the cage; give more"
            )
        if grid.size * len(points) > MOST_VALUES:
            raise ParameterError(
                f"the weights of {len(points)} points of the cage at {grid.size} nodes "
                f"({_product(counts)} cells) need {8e-9 * grid.size * len(points):.0f} GB; give "
                "fewer cells"
            )
        links, hits = cage_grid.linked(grid)
        solved = multigrid.solved(links, hits, len(points), progress)
        missed = np.abs(solved.values @ grid.corners - grid.nodes) / counts
        change, precision = solved.change, float(missed.max())
        self.report = Report(counts, grid.size, solved.cycles, change, precision, grid.shift)
        if not self.report.precision < PROOF:
            raise GeometryError(
                f"weights of a node miss it by {self.report.precision:.1e} of the cage's extent "
                f"after {solved.cycles} cycles; give other cells than {_product(counts)}"
            )
        self._tables = _tabled(grid, solved.values)
        self._jax_tables: Tables | None = None

    def weights(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n m"]:
        """The weights of the cage's points at points inside; NaN for those far outside."""
        return self.traced(points)[0]

    def traced(
        self, points: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n m"], Int[np.ndarray, "n"]]:
        """The weights, and how each point's were found.

        0: from nodes alone; 1: from nodes and places on the cage; 2: from the cage alone, in
        slivers that the grid's nodes and their nearest places on the cage do not enclose.
        """
        points = np.ascontiguousarray(points, float)
        out, kind = empty((len(points), self._tables.values.shape[1])), np.empty(len(points), int)
        spread(
            harmonic_loops.look_up, len(points), points, *self._tables, out, kind,
            least=THREAD_WORTH,
        )  # fmt: skip
        return out, kind

    def evaluated(
        self, points: Float[Array, "n 3"], of: Float[Array, "m c"] | None = None
    ) -> Float[Array, "n c"]:
        """The same in JAX, differentiable by the points; first derivatives are exact.

        With `of`, what belongs to each of the cage's points, its sums by the weights.
        """
        if self._jax_tables is None:
            with jax.ensure_compile_time_eval():
                self._jax_tables = Tables(*map(jax.numpy.asarray, self._tables))
        return looked_up(self._jax_tables, jax.numpy.asarray(points), of)

    def slopes(
        self, points: Float[np.ndarray, "n 3"], of: Float[np.ndarray, "m c"]
    ) -> tuple[Float[np.ndarray, "n c 3"], Int[np.ndarray, "n"]]:
        """Derivatives by the points of the sums of `of` by the weights, and `traced`'s kinds."""
        points = np.ascontiguousarray(points, float)
        tables = self._tables._replace(values=self._tables.values @ of)
        out, kind = np.empty((len(points), of.shape[1], 3)), np.empty(len(points), int)
        spread(
            harmonic_loops.slopes, len(points), points, *tables, out, kind, least=THREAD_WORTH
        )  # fmt: skip
        slivers = kind == 2
        if slivers.any():
            out[slivers] = sliver_slopes(self._tables, points[slivers], of)
        return out, kind


def _counted(cells: float | Sequence[float]) -> tuple[int, int, int]:
    counts = tuple(cells) if isinstance(cells, Sequence) else (cells,) * 3
    if len(counts) != 3 or not all(float(n).is_integer() and n >= 2 for n in counts):
        raise ParameterError(f"cells must be a whole number or three, at least 2, got {cells}")
    return tuple(map(int, counts))  # type: ignore[return-value]


def _product(counts: Sequence[int]) -> str:
    return " x ".join(map(str, counts))


def _tabled(grid: cage_grid.Grid, values: np.ndarray) -> Tables:
    """What a look-up needs: the inside nodes come first, then those that lie just outside."""
    nodes, hits = cage_grid.approached(grid)
    site = grid.number.copy()
    site[tuple(nodes.T)] = grid.size + np.arange(len(nodes))
    table = np.zeros((grid.size + len(nodes), values.shape[1]))
    table[: grid.size] = values
    np.put_along_axis(table[grid.size :], hits.corners, hits.shares, axis=1)
    on_cage = np.einsum("kc,kcd->kd", hits.shares, grid.corners[hits.corners])
    return Tables(
        grid.origin,
        grid.spacing,
        site,
        np.concatenate([grid.nodes.astype(float), on_cage]),
        grid.size,
        table,
        grid.corners,
        grid.faces,
    )
