"""Unit quaternions (w, x, y, z) from rotation vectors, and what they turn."""

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array

SERIES = 10
"""Terms of the series about no rotation; the last one is below rounding where they are used."""


def quaternion(vectors: Float[Array, "*rows 3"]) -> Float[Array, "*rows 4"]:
    """Unit quaternions of rotations by vectors along their axes, as long as the angles [rad].

    All derivatives exist at zero too: cos and sinc of half the angle are taken as functions of its
    square, by their series where it is below 1.
    """
    square = jnp.sum(jnp.square(vectors), axis=-1, keepdims=True) / 4
    is_small = square < 1.0
    half = jnp.sqrt(jnp.where(is_small, 1.0, square))  # no infinite slope at 0
    small = jnp.where(is_small, square, 0.0)
    cosine = jnp.where(is_small, _series(small, 0), jnp.cos(half))
    sinc = jnp.where(is_small, _series(small, 1), jnp.sin(half) / half)
    return jnp.concatenate([cosine, jnp.asarray(vectors) * sinc / 2], axis=-1)


def _series(square: Array, odd: int) -> Array:
    """Sum of (-square)^k / (2k + odd)!, by Horner's rule."""
    total: Array = jnp.zeros_like(square)
    for k in reversed(range(SERIES)):
        total = 1 / math.factorial(2 * k + odd) - square * total
    return total


def product(
    later: Float[Array, "*rows 4"], first: Float[Array, "*rows 4"]
) -> Float[Array, "*rows 4"]:
    """The rotation that turns by the one, then by the other."""
    a, b = later[..., :1], first[..., :1]
    u, v = later[..., 1:], first[..., 1:]
    scalar = a * b - jnp.sum(u * v, axis=-1, keepdims=True)
    return jnp.concatenate([scalar, a * v + b * u + jnp.cross(u, v)], axis=-1)


def turn(
    quaternions: Float[Array, "*rows 4"], places: Float[Array, "*others 3"]
) -> Float[Array, "*all 3"]:
    """By how much rotations displace places; exactly zero for no rotation. Rows broadcast."""
    w, v = quaternions[..., :1], quaternions[..., 1:]
    return 2 * jnp.cross(v, jnp.cross(v, places) + w * places)


def increments(quaternions: Float[Array, "*rows 4"]) -> Float[Array, "*rows 3 3"]:
    """Matrices of the rotations, less the unit matrix."""
    turned = turn(quaternions[..., None, :], np.eye(3))  # a row for each unit vector
    return jnp.swapaxes(turned, -1, -2)
