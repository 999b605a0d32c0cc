"""Mean value coordinates of a closed cage: a closed form, inside and outside."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from . import mean_value_loops
from .kernel import empty
from .mean_value_loops import CLOSE, FLAT
from .threads import spread

BATCH = 512
"""Points that are looked at together in JAX."""

THREAD_WORTH = 256
"""Points that are worth a thread of their own."""


class MeanValue:
    """Weights of a cage's points that sum to one and reproduce every place.

    They are smooth but on the cage's edges, hold inside and outside, and may be negative where the
    cage is not convex. On a face they are linear between its corners.

    Source: Ju, Schaefer and Warren, Mean Value Coordinates for Closed Triangular Meshes, SIGGRAPH
    2005.
    """

    def __init__(self, points: Float[np.ndarray, "m 3"], faces: Int[np.ndarray, "t 3"]):
        self.points = np.ascontiguousarray(points, float)
        self.faces = np.ascontiguousarray(faces, np.int64)
        self.size = float(np.ptp(self.points, axis=0).max())

    def weights(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n m"]:
        """The weights of the cage's points at places."""
        out = empty((len(points), len(self.points)))
        given = np.ascontiguousarray(points, float), self.points, self.faces, self.size, out
        spread(mean_value_loops.weights, len(points), *given, least=THREAD_WORTH)
        return out

    def evaluated(self, points: Float[Array, "n 3"]) -> Float[Array, "n m"]:
        """The same in JAX, differentiable by the places off the cage."""
        return jax.lax.map(self._at, jnp.asarray(points), batch_size=BATCH)

    def _at(self, point: Float[Array, "3"]) -> Float[Array, "m"]:
        away = self.points - point
        length = jnp.linalg.norm(away, axis=1)
        at_corner = length <= CLOSE * self.size
        length = jnp.where(at_corner, 1.0, length)
        unit = away / length[:, None]
        corners = unit[self.faces]
        edges = jnp.roll(corners, -1, axis=1) - jnp.roll(corners, -2, axis=1)
        angle = 2 * jnp.arcsin(jnp.minimum(jnp.linalg.norm(edges, axis=2) / 2, 1 - 1e-16))
        half = jnp.sum(angle, axis=1, keepdims=True) / 2
        a, b, c = (corners[:, i] for i in range(3))
        volume = jnp.sum(a * jnp.cross(b, c), axis=1, keepdims=True)
        on_face = jnp.pi - half[:, 0] < FLAT
        next_, last = (jnp.roll(jnp.sin(angle), -k, axis=1) for k in (1, 2))
        cosine = 2 * jnp.sin(half) * jnp.sin(half - angle) / (next_ * last) - 1
        square = 1 - cosine**2
        flat = (jnp.abs(volume) < FLAT) | jnp.any(square < FLAT**2, axis=1, keepdims=True)
        sine = jnp.sqrt(jnp.where(flat, 1.0, square)) * jnp.sign(volume)
        one, two = (jnp.roll(angle, -k, axis=1) for k in (1, 2))
        above = angle - jnp.roll(cosine, -1, axis=1) * two - jnp.roll(cosine, -2, axis=1) * one
        below = length[self.faces] * next_ * jnp.roll(sine, -2, axis=1)
        share = jnp.where(flat, 0.0, above / jnp.where(flat, 1.0, below))
        total = jnp.zeros(len(self.points)).at[self.faces].add(share)
        within = (
            jnp.sin(angle)
            * jnp.roll(length[self.faces], -1, 1)
            * jnp.roll(length[self.faces], -2, 1)
        )
        first = jnp.argmax(on_face)
        on_it = jnp.zeros(len(self.points)).at[jnp.asarray(self.faces)[first]].add(within[first])
        chosen = jnp.where(jnp.any(on_face), on_it, total)
        chosen = jnp.where(jnp.any(at_corner), at_corner.astype(float), chosen)
        return chosen / jnp.sum(chosen)
