"""Rows of half rings around x, in their order, and the triangles between them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array, Points
from .skin import between_lines, between_rows, mirrored

MIRROR = np.array([1.0, -1.0, 1.0])


class RingLayout(eqx.Module):
    """Half rings from the top to the bottom, at y >= 0, row by row along x.

    A pole is one point. The k-th row from it has 3 k edges, which keeps triangles well shaped,
    until rows have as many as the others. A whole body has the mirror images too, behind all.

    Attributes
    ----------
    rows
        How many, poles included.
    edges
        In a half ring far from the poles.
    is_whole
        Whether the mirror image at y = 0 belongs to it.
    """

    rows: int = eqx.field(static=True)
    edges: int = eqx.field(static=True)
    is_whole: bool = eqx.field(static=True)

    @property
    def counts(self) -> np.ndarray:
        """Edges in each row."""
        k = np.arange(self.rows)
        return np.minimum(np.minimum(3 * k, 3 * k[::-1]), self.edges)

    def points(self, rows: dict[str, Array]) -> Points:
        """All points, from values of the rows.

        Rows have their place `x`, `half_width`, `half_height`, `lift` of their middle [m], and the
        exponents `upper` and `lower` of their super-ellipse.
        """
        counts = self.counts
        full = np.flatnonzero(counts == self.edges)
        ends = [np.arange(self.rows), np.arange(0)]
        if len(full) > 1:
            ends = [np.arange(full[0]), np.arange(full[-1] + 1, self.rows)]
        irregular = [self._flat(rows, counts, own) for own in ends]
        parts = irregular
        if len(full) > 1:
            inner = {name: value[full][:, None] for name, value in rows.items()}
            regular = _ring(inner, np.arange(self.edges + 1) / self.edges).reshape(-1, 3)
            parts = [irregular[0], regular, irregular[1]]
        found = jnp.concatenate(parts)
        if not self.is_whole:
            return found
        return jnp.concatenate([found, found[np.flatnonzero(~self._is_shared())] * MIRROR])

    def _flat(self, rows: dict[str, Array], counts: np.ndarray, own: np.ndarray) -> Points:
        """Points of rows of different numbers."""
        if not len(own):
            return jnp.zeros((0, 3))
        row = np.repeat(own, counts[own] + 1)
        share = np.concatenate([np.arange(n + 1) / max(n, 1) for n in counts[own].tolist()])
        return _ring({name: value[row] for name, value in rows.items()}, share)

    def _starts(self) -> np.ndarray:
        return np.cumsum([0, *(self.counts + 1)], dtype=np.int32)

    def _is_shared(self) -> np.ndarray:
        """Points at y = 0."""
        starts = self._starts()
        is_shared = np.zeros(starts[-1], bool)
        is_shared[starts[:-1]] = is_shared[starts[1:] - 1] = True
        return is_shared

    def faces(self, points: np.ndarray) -> np.ndarray:
        """Triangles, with the shorter diagonals between the given points."""
        counts, starts = self.counts, self._starts()
        breaks = np.flatnonzero(np.diff(counts)) + 1
        parts = []
        for own in np.split(np.arange(self.rows), breaks):
            index = starts[own][:, None] + np.arange(counts[own[0]] + 1, dtype=np.int32)
            parts.append(between_rows(index, points)[:, ::-1])
        for k in breaks.tolist():
            one, other = (np.arange(starts[r], starts[r + 1], dtype=np.int32) for r in (k - 1, k))
            parts.append(between_lines(one, other)[:, ::-1])
        faces = np.concatenate(parts)
        if not self.is_whole:
            return faces
        return np.concatenate([faces, mirrored(faces, self._is_shared())[0]])


def _ring(rows: dict[str, Array], share: Float[np.ndarray, "_"]) -> Array:
    """Points of half super-ellipses, at the parts of the way from the top to the bottom.

    At the angle of the share the ray to |y / b|^n + |z / h|^n = 1 is cut, after y and z are scaled
    to the half width b and the half height h; so the points on the axes are exact.
    """
    across, up = directions(share)
    slim = np.log(np.maximum(np.abs(np.stack([across, up])), 1e-300))  # no infinite derivative
    exponent = jnp.where(up >= 0, rows["upper"], rows["lower"])
    powers = jnp.exp(exponent * slim[0]) + jnp.exp(exponent * slim[1])
    radius = jnp.exp(-jnp.log(powers) / exponent)
    y = rows["half_width"] * (radius * across)
    z = rows["lift"] + rows["half_height"] * (radius * up)
    return jnp.stack([jnp.broadcast_to(rows["x"], y.shape), y, z], axis=-1)


def directions(share: Float[np.ndarray, "_"]) -> tuple[np.ndarray, np.ndarray]:
    """Sine and cosine of shares of half a turn, exact at its ends and in its middle."""
    across, up = np.sin(np.pi * share), np.cos(np.pi * share)
    across[(share == 0) | (share == 1)] = 0.0
    up[share == 0.5] = 0.0
    return across, up
