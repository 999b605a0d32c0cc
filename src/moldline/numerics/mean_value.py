"""Mean value coordinates of a closed cage: a closed form, inside and outside."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from . import mean_value_loops
from .kernel import empty
from .mean_value_loops import CLOSE, FLAT, SMALL, STRAIGHT
from .threads import spread

ROOM = 3_000_000
"""Numbers that a batch of points may hold at a time in JAX."""

THREAD_WORTH = 256
"""Points that are worth a thread of their own."""


class MeanValue:
    """Weights of a cage's points that sum to one and reproduce every place.

    They are smooth off the cage, hold inside and outside, and may be negative where the cage is not
    convex. On a face they are linear between its corners. Far away they lose digits with the cube
    of the distance: ten sizes of the cage away some 1e-8.

    Source: Ju, Schaefer and Warren, Mean Value Coordinates for Closed Triangular Meshes, SIGGRAPH
    2005; docs/theory/cage.md says how what is lost near planes and edges is kept.
    """

    def __init__(self, points: Float[np.ndarray, "m 3"], faces: Int[np.ndarray, "t 3"]):
        self.points = np.ascontiguousarray(points, float)
        self.faces = np.ascontiguousarray(faces, np.int64)
        self.size = float(np.ptp(self.points, axis=0).max())
        opposite = np.sort(self.faces[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2)
        self._edges, sides = np.unique(opposite, axis=0, return_inverse=True)
        self._sides = np.ascontiguousarray(sides.reshape(-1, 3))

    def weights(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n m"]:
        """The weights of the cage's points at places."""
        out = empty((len(points), len(self.points)))
        cage = self.points, self.faces, self._sides, self._edges, self.size
        given = np.ascontiguousarray(points, float), *cage, out
        spread(mean_value_loops.weights, len(points), *given, least=THREAD_WORTH)
        return out

    def evaluated(self, points: Float[Array, "n 3"]) -> Float[Array, "n m"]:
        """The same in JAX, differentiable by the places off the cage.

        Where a place is exactly on the line of an edge, beyond it, the slope lacks its two faces.
        """
        batch = max(1, ROOM // (40 * len(self.faces)))
        # what a derivative needs of a place is computed again, not kept
        return jax.lax.map(jax.checkpoint(self._at), jnp.asarray(points), batch_size=batch)

    def _at(self, point: Float[Array, "3"]) -> Float[Array, "m"]:
        away = self.points - point
        length = _length(away)
        at_corner = length <= CLOSE * self.size
        length = jnp.where(at_corner, 1.0, length)
        unit = away / length[:, None]
        u, v = unit[self._edges[:, 0]], unit[self._edges[:, 1]]
        apart, along = _length(u - v), _length(u + v)
        angle = 2 * jnp.arctan2(apart, along)
        sine = 2 * apart * along / (apart**2 + along**2)
        order = (jnp.argmax(angle[self._sides], axis=1)[:, None] + np.arange(3)) % 3
        face = jnp.take_along_axis(jnp.asarray(self.faces), order, axis=1)
        side = jnp.take_along_axis(jnp.asarray(self._sides), order, axis=1)
        share, is_on = _shares(unit[face], length[face], angle[side], sine[side])
        nothing = jnp.zeros(len(self.points))
        first = jnp.argmax(is_on)
        chosen = jnp.where(
            is_on[first], nothing.at[face[first]].add(share[first]), nothing.at[face].add(share)
        )
        chosen = jnp.where(jnp.any(at_corner), at_corner.astype(float), chosen)
        return chosen / jnp.sum(chosen)


def _length(vectors: Float[Array, "k 3"]) -> Float[Array, "k"]:
    """With a slope of zero where it is zero."""
    square = jnp.sum(vectors**2, axis=1)
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


def _shares(unit: Array, length: Array, angle: Array, sine: Array) -> tuple[Array, Array]:
    """What each face adds to its corners' weights (t, 3), and whether the point lies on it.

    The first side, opposite the first corner, is the longest. As the compiled form does it; what
    is not chosen is kept finite, for its slope.
    """
    (a, b, c), half = angle.T, jnp.sum(angle, axis=1) / 2
    at_edge = (a > 2) & (sine[:, 0] < STRAIGHT)
    is_straight = jnp.any(sine < STRAIGHT, axis=1)
    sin_a, sin_b, sin_c = jnp.where(is_straight[:, None], 1.0, sine).T
    volume = jnp.sum(unit[:, 0] * jnp.cross(unit[:, 1], unit[:, 2]), axis=1)
    whole, less_a, less_b, less_c = (jnp.sin(half - x) for x in (0, a, b, c))
    is_near = whole < less_a
    is_on = is_near & (jnp.abs(volume) < FLAT) & ~is_straight

    over_a = 2 * whole * less_a / (sin_b * sin_c) - 1
    over_b = 2 * whole * less_b / (sin_a * sin_c) - 1
    over_c = 2 * whole * less_c / (sin_a * sin_b) - 1
    near = a - b * over_c - c * over_b, b - a * over_c - c * over_a, c - a * over_b - b * over_a

    use = ~is_near & ~is_straight
    beside = volume / jnp.where(use, 4 * whole * less_b * less_c, 1.0)
    x = jnp.where(use, beside * volume, 0.0)
    large = jnp.where(x > SMALL, x, 0.5)
    series = 1 + x * x * (1 / 6 + x * x * (3 / 40))
    ratio = jnp.where(x > SMALL, jnp.arcsin(large) / large, series)
    far = (
        b * less_b / (sin_a * sin_b) + c * less_c / (sin_a * sin_c) - ratio,
        a * less_b / (sin_a * sin_b) - c * whole / (sin_b * sin_c) + ratio,
        a * less_c / (sin_a * sin_c) - b * whole / (sin_b * sin_c) + ratio,
    )

    divided = 1 / (2 * jnp.where(is_near & ~is_on & ~is_straight, volume, 1.0))
    scale = jnp.where(is_near, divided, beside)
    at = jnp.where(is_near, jnp.stack(near), jnp.stack(far)).T
    share = jnp.where(is_straight, 0.0, scale)[:, None] * at * sine / length
    on_edge = jnp.array([0.0, 1.0, 1.0]) / length
    return jnp.where(at_edge[:, None], on_edge, share), is_on | at_edge
