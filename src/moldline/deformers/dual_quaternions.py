"""Blends of motions: of their matrices, or of their dual quaternions."""

import jax
import jax.numpy as jnp
from jaxtyping import Float

from .._types import Array, Points
from ..numerics.rotation import product


def linear(
    points: Points,
    weights: Float[Array, "n b"],
    matrices: Float[Array, "b 3 3"],
    shifts: Float[Array, "b 3"],
) -> Points:
    """Displacements of points by the weighted mean of affine ones, x -> matrix x + shift."""
    mean = (weights @ matrices.reshape(-1, 9)).reshape(-1, 3, 3)
    return jnp.einsum("nij,nj->ni", mean, points) + weights @ shifts


def dual_quaternion(
    points: Points,
    weights: Float[Array, "n b"],
    rotations: Float[Array, "b 4"],
    shifts: Float[Array, "b 3"],
    grown: Float[Array, "b n 3"],
) -> Points:
    """Displacements of points by the blend of motions x -> rotation (x + grown) + shift.

    Each point's motion is rigid too, what has grown being a translation to it: the weighted sum of
    the motions' dual quaternions, normalised. Of a quaternion and its opposite, which are one
    rotation, that is added which is nearer to the sum so far. A row of weights that sums to less
    than one is filled up by rest.

    Source: Kavan, Collins, Žára and O'Sullivan, Skinning with Dual Quaternions, I3D 2007.
    """
    duals = product(_pure(shifts), rotations) / 2
    rest = (1 - jnp.sum(weights, axis=1, keepdims=True)) * jnp.array([1.0, 0.0, 0.0, 0.0])

    def add(total: tuple[Array, Array], bone: tuple[Array, ...]) -> tuple:
        weight, rotation, dual, growth = bone
        signed = jnp.where(total[0] @ rotation < 0, -weight, weight)[:, None]
        turns = jnp.broadcast_to(rotation, (len(growth), 4))
        own = dual + product(turns, _pure(growth)) / 2
        return (total[0] + signed * rotation, total[1] + signed * own), None

    start = rest, jnp.zeros_like(rest)
    (real, dual), _ = jax.lax.scan(add, start, (weights.T, rotations, duals, grown))
    w, v = real[:, :1], real[:, 1:]
    turned = jnp.cross(v, jnp.cross(v, points) + w * points)
    shifted = w * dual[:, 1:] - dual[:, :1] * v + jnp.cross(v, dual[:, 1:])
    return 2 * (turned + shifted) / jnp.sum(real**2, axis=1, keepdims=True)


def _pure(vectors: Array) -> Array:
    """Quaternions with no real part."""
    return jnp.concatenate([jnp.zeros_like(vectors[..., :1]), vectors], axis=-1)
