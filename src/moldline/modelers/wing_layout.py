"""The points of a wing in their order, and the triangles between them."""

from itertools import pairwise
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from .._types import Array, Points
from .skin import between_lines, between_rows, mirrored

Tip = Literal["round", "flat", "closed"]
Root = Literal["closed", "open"]


class WingLayout(eqx.Module):
    """Rows of two sides from root to tip, then the points inside of the caps.

    A row has the upper side from the nose to the trailing edge, the lower side without what it
    shares, and points inside of a blunt base. A cap joins the points of the two sides that face
    each other by columns, each of as many edges as keep its triangles well shaped.

    Attributes
    ----------
    rows, side
        How many rows, and points on each side of a row.
    base
        Points inside of the base in each row; none where it is sharp.
    is_blunt
        Whether there is a base.
    tip, root
        How the ends are closed; a whole wing's root is "open".
    tip_edges, root_edges
        Edges in each column of a cap.
    is_whole
        Whether the mirror image at y = 0 belongs to it.
    """

    rows: int = eqx.field(static=True)
    side: int = eqx.field(static=True)
    base: int = eqx.field(static=True)
    is_blunt: bool = eqx.field(static=True)
    tip: str = eqx.field(static=True)
    root: str = eqx.field(static=True)
    tip_edges: tuple[int, ...] = eqx.field(static=True)
    root_edges: tuple[int, ...] = eqx.field(static=True)
    is_whole: bool = eqx.field(static=True)

    def points(self, upper: Array, lower: Array, slopes: Array) -> Points:
        """All points.

        The sides have the shape (rows, side, 3); `slopes` are what both sides' last points move
        by for each metre along the span, shape (2, side, 3).
        """
        last = self.side if self.is_blunt else self.side - 1
        share = jnp.linspace(0, 1, self.base + 2)[1:-1, None]
        ends = (upper[:, -1:], lower[:, -1:])
        base = (1 - share) * ends[0] + share * ends[1]
        rows: list[Array] = [upper, lower[:, 1:last], base]
        if self.tip == "closed":
            rows = [part[:-1] for part in rows]
        parts: list[Array] = [jnp.concatenate(rows, axis=1).reshape(-1, 3)]
        if self.tip == "closed":
            parts.append(upper[-1])
        else:
            parts.append(self._cap(upper[-1], lower[-1], slopes, self.tip_edges, self.tip))
        if self.root == "closed":
            parts.append(self._cap(upper[0], lower[0], slopes, self.root_edges, "flat"))
        found = jnp.concatenate(parts)
        if not self.is_whole:
            return found
        image = found[np.flatnonzero(~self._is_shared(len(found)))] * np.array([1.0, -1.0, 1.0])
        return jnp.concatenate([found, image])

    def _cap(
        self, upper: Array, lower: Array, slopes: Array, edges: tuple[int, ...], kind: str
    ) -> Points:
        """The points inside of the columns."""
        own = [(i, k / count) for i, count in enumerate(edges) for k in range(1, count)]
        if not own:
            return jnp.zeros((0, 3))
        column = np.array([i for i, _ in own])
        share = np.array([part for _, part in own])[:, None]
        a, b = upper[column], lower[column]
        if kind == "flat":
            return (1 - share) * a + share * b
        half = (a - b) / 2
        radius = jnp.sqrt(jnp.sum(half**2, axis=1, keepdims=True))
        outward = jnp.cos(np.pi / 2 * share) ** 2 * slopes[0][column]
        outward = outward + jnp.sin(np.pi / 2 * share) ** 2 * slopes[1][column]
        return (
            (a + b) / 2 + jnp.cos(np.pi * share) * half + jnp.sin(np.pi * share) * radius * outward
        )

    @property
    def _row(self) -> int:
        """Points in a row."""
        return 2 * self.side - (1 if self.is_blunt else 2) + self.base

    def sides(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers of the points of the upper and the lower side and of the base, row by row.

        The base runs from the upper to the lower side.
        """
        is_closed = self.tip == "closed"
        count = (self.rows - is_closed) * self._row
        number = np.arange(count, dtype=np.int32).reshape(-1, self._row)
        upper, rest = number[:, : self.side], number[:, self.side :]
        own = rest if self.is_blunt else np.concatenate([rest, upper[:, -1:]], axis=1)
        lower = np.concatenate([upper[:, :1], own[:, : self.side - 1]], axis=1)
        base = np.concatenate([upper[:, -1:], own[:, self.side - 1 :], lower[:, -1:]], axis=1)
        if is_closed:
            edge = number.size + np.arange(self.side, dtype=np.int32)
            upper, lower = np.vstack([upper, edge]), np.vstack([lower, edge])
            base = np.vstack([base, np.full(base.shape[1], edge[-1], np.int32)])
        return upper, lower, base

    def faces(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Triangles, and for each 0, 1 where it closes the tip, or 2 where it closes the root.

        Diagonals are the shorter ones between the given points.
        """
        upper, lower, base = self.sides()
        edge = np.zeros(len(points), bool)
        edge[upper[upper == lower]] = True
        parts = [
            between_rows(upper, points, edge),
            between_rows(lower, points, edge)[:, ::-1],
            between_rows(base, points),
        ]
        counts = [sum(map(len, parts))]
        first = self.rows * self._row
        if self.tip == "closed":
            first = (self.rows - 1) * self._row + self.side
        else:
            columns, first = self._columns(self.tip_edges, -1, first, self.tip == "flat")
            parts += [between_lines(a, b)[:, ::-1] for a, b in _neighbours(columns)]
            if self.is_blunt and self.tip == "round":
                parts.append(between_lines(base[-1], columns[-1]))
        counts.append(sum(map(len, parts)))
        if self.root == "closed":
            columns, first = self._columns(self.root_edges, 0, first, True)
            parts += [between_lines(a, b) for a, b in _neighbours(columns)]
        faces = np.concatenate(parts)
        tags = np.zeros(len(faces), np.int32)
        for count in counts:
            tags[count:] += 1
        if not self.is_whole:
            return faces, tags
        image, _ = mirrored(faces, self._is_shared(first))
        return np.concatenate([faces, image]), np.concatenate([tags, tags])

    def _columns(
        self, edges: tuple[int, ...], row: int, first: int, is_flat: bool
    ) -> tuple[list[np.ndarray], int]:
        """Points of a cap from the upper to the lower side, and the number after its last."""
        upper, lower, base = self.sides()
        columns = []
        for a, b, count in zip(upper[row], lower[row], edges, strict=True):
            inner = first + np.arange(count - 1, dtype=np.int32)
            columns.append(
                np.array([a]) if a == b else np.concatenate([[a], inner, [b]], dtype=np.int32)
            )
            first += count - 1
        if is_flat:
            columns[-1] = base[row] if self.is_blunt else columns[-1]
        return columns, first

    def _is_shared(self, count: int) -> np.ndarray:
        """Points of the root's row, which both halves of a whole wing have."""
        is_shared = np.zeros(count, bool)
        is_shared[: self._row] = True
        return is_shared


def cap_edges(outline: np.ndarray, kind: str, is_blunt: bool) -> tuple[int, ...]:
    """How many edges lead across a cap at each station of a section, shape (2, side, 2).

    As many as are about as long as those along the sides there.
    """
    upper, lower = outline
    height = np.linalg.norm(upper - lower, axis=1) * (np.pi / 2 if kind == "round" else 1.0)
    steps = np.linalg.norm(np.diff(upper, axis=0), axis=1)
    width = np.convolve(steps, [0.5, 0.5])
    width[[0, -1]] = steps[[0, -1]]
    edges = np.maximum(np.rint(height / width).astype(int), 1)
    edges[0] = 1
    if kind == "flat" or not is_blunt:
        edges[-1] = 1  # the base's own points are there, or a sharp edge
    else:
        edges[-1] = max(edges[-1], 2)
    return tuple(edges.tolist())


def _neighbours(columns: list[np.ndarray]) -> list[tuple[np.ndarray, np.ndarray]]:
    return list(pairwise(columns))
