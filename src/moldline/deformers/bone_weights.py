"""Shares of bones in the motion of points."""

from functools import partial
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array, ArrayLike, Points
from ..errors import ParameterError
from .bones import Bones

Weights = Literal["distance", "envelope"]

LEAST = 1e-4
"""Points whose weights sum to no more than this stay, as in Blender."""


@partial(jax.jit, static_argnums=0)
def by_distance(bones: Bones, points: Points) -> Float[Array, "n b"]:
    """Shares by the inverse fourth power of the distance from each bone; once differentiable.

    With the distance d of a point from the bone, the bone's radius r there and its reach R it is
    (1/(d² + r²) - 1/(R² + r²))² within the reach, over the sum for all bones. The radius goes from
    head to tail with no slope at either, so that the shares have no kinks.
    """
    square, along = _distances(bones, points)
    fade = along**2 * (3 - 2 * along)
    rounding = _radii(bones, fade) ** 2
    reach = np.array([bone.reach for bone in bones])
    excess = jnp.maximum(1 / (square + rounding) - 1 / (reach**2 + rounding), 0.0)
    return _shares(excess**2, 0.0)


def by_envelope(bones: Bones, points: Points) -> Float[Array, "n b"]:
    """Shares by Blender's envelopes.

    Within its radius, straight from head to tail, a bone weighs its strength; beyond, it falls as a
    parabola that is zero at `distance` from there.
    """
    square, along = _distances(bones, points)
    beyond = jnp.maximum(jnp.sqrt(square) - _radii(bones, along), 0.0)
    distance = np.array([bone.distance for bone in bones])
    share = beyond / np.where(distance > 0, distance, 1.0)
    inside = (beyond == 0) | ((distance > 0) & (share < 1))
    strength = np.array([bone.strength for bone in bones])
    return _shares(strength * jnp.where(inside, 1 - share**2, 0.0), LEAST)


def by_hand(given: ArrayLike, count: int, bones: Bones) -> Float[Array, "n b"]:
    """Shares from weights that are given, one row for each of `count` points."""
    weights = np.asarray(given, float)
    if weights.shape != (count, len(bones)):
        raise ParameterError(
            f"weights by hand are a row of {len(bones)} for each of {count} control points, got "
            f"an array of shape {weights.shape}"
        )
    wrong = np.argwhere(~((weights >= 0) & (weights < np.inf)))
    if len(wrong):
        point, bone = wrong[0]
        raise ParameterError(
            f"weights are 0 or more, got {weights[point, bone]:g} for control point {point} and "
            f"bone {bones[bone].name!r}"
        )
    return _shares(weights, LEAST)


def _shares(weights: Array, least: float) -> Array:
    """Rows that sum to one, or to zero where no bone acts."""
    total = jnp.sum(weights, axis=1, keepdims=True)
    acts = total > least
    return jnp.where(acts, weights / jnp.where(acts, total, 1.0), 0.0)


def _distances(bones: Bones, points: Points) -> tuple[Array, Array]:
    """Squared distance from each bone, and where the nearest place is, from head 0 to tail 1."""
    spans = bones.tails - bones.heads
    offsets = jnp.asarray(points)[:, None] - bones.heads
    along = jnp.clip(jnp.sum(offsets * spans, axis=2) / np.sum(spans**2, axis=1), 0.0, 1.0)
    return jnp.sum((offsets - along[..., None] * spans) ** 2, axis=2), along


def _radii(bones: Bones, along: Array) -> Array:
    head, tail = np.array([bone.radii for bone in bones]).T
    return head + along * (tail - head)
