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
) -> Points:
    """Displacements of points by the blend of rigid motions x -> rotation x + shift.

    Each point's motion is rigid too: the weighted sum of the motions' dual quaternions, normalised.
    Of a quaternion and its opposite, which are one rotation, that is added which is nearer to the
    sum so far. A row of weights that sums to less than one is filled up by rest.

    Source: Kavan, Collins, Žára and O'Sullivan, Skinning with Dual Quaternions, I3D 2007.
    """
    moved = jnp.concatenate([jnp.zeros_like(shifts[:, :1]), shifts], axis=1)
    duals = product(moved, rotations) / 2
    rest = (1 - jnp.sum(weights, axis=1, keepdims=True)) * jnp.array([1.0, 0.0, 0.0, 0.0])

    def add(total: tuple[Array, Array], bone: tuple[Array, Array, Array]) -> tuple:
        weight, rotation, dual = bone
        signed = jnp.where(total[0] @ rotation < 0, -weight, weight)[:, None]
        return (total[0] + signed * rotation, total[1] + signed * dual), None

    start = rest, jnp.zeros_like(rest)
    (real, dual), _ = jax.lax.scan(add, start, (weights.T, rotations, duals))
    w, v = real[:, :1], real[:, 1:]
    turned = jnp.cross(v, jnp.cross(v, points) + w * points)
    shifted = w * dual[:, 1:] - dual[:, :1] * v + jnp.cross(v, dual[:, 1:])
    return 2 * (turned + shifted) / jnp.sum(real**2, axis=1, keepdims=True)
