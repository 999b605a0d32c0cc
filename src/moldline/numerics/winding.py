"""Winding numbers: which points a closed triangulation encloses."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from . import winding_loops
from .threads import spread

THREAD_WORTH = 1024
"""Points that are worth a thread of their own."""


def winding(
    points: Float[np.ndarray, "n 3"],
    corners: Float[np.ndarray, "m 3"],
    faces: Int[np.ndarray, "t 3"],
) -> Float[np.ndarray, "n"]:
    """How often triangles go around each point: 1 inside, 0 outside, 1/2 on a face."""
    out = np.empty(len(points))
    given = np.ascontiguousarray(points, float), np.ascontiguousarray(corners[faces]), out
    spread(winding_loops.winding, len(points), *given, least=THREAD_WORTH)
    return out


def winding_in_jax(
    points: Float[Array, "n 3"], corners: Float[Array, "m 3"], faces: Int[Array, "t 3"]
) -> Float[Array, "n"]:
    """The same for traced points."""
    a, b, c = (corners[faces[:, i]] - points[:, None] for i in range(3))
    x, y, z = (jnp.linalg.norm(v, axis=-1) for v in (a, b, c))
    volume = jnp.sum(a * jnp.cross(b, c), axis=-1)
    ab, bc, ca = (jnp.sum(p * q, axis=-1) for p, q in ((a, b), (b, c), (c, a)))
    angles = jnp.arctan2(volume, x * y * z + ab * z + bc * x + ca * y)
    return jnp.sum(angles, axis=-1) / (2 * jnp.pi)
