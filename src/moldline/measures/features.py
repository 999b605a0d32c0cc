"""Distances from the corner, the edge or the plane of a triangle, whichever is nearest."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._types import Array

KINDS = {"corner": 1, "edge": 2, "plane": 3}
"""How many corners of a triangle bear its nearest point."""


def ordered(
    corners: Int[np.ndarray, "k 3"], weights: Float[np.ndarray, "k 3"]
) -> tuple[Int[np.ndarray, "k 3"], Int[np.ndarray, "k"]]:
    """Corners turned so that those that bear the nearest point come first, and how many do."""
    bears = weights > 1e-12
    count = bears.sum(axis=1)
    # a turn keeps the face's sense, and any two corners follow each other
    alone = np.argmax(bears, axis=1)
    first = np.where(count == 2, (np.argmin(bears, axis=1) + 1) % 3, np.where(count == 1, alone, 0))
    turn = (first[:, None] + np.arange(3)) % 3
    return np.take_along_axis(corners, turn, axis=1), count


def offset(
    places: Float[Array, "k 3"],
    triangles: Float[Array, "k 3 3"],
    count: Int[Array, "k"],
    side: Float[Array, "k"],
) -> Float[Array, "k"]:
    """Distance of places from what bears the nearest point [m], behind it positive.

    Of planes the sign is their own, of corners and edges `side`. The distance of a place on a
    corner or an edge has no derivative; zero is given.
    """
    a, b, c = (triangles[:, i] for i in range(3))
    run, far = b - a, a - places
    normal = jnp.cross(run, c - a)
    plane = _dot(normal, far) / _length(normal)
    share = _dot(run, far) / jnp.where(_dot(run, run) > 0, _dot(run, run), 1.0)
    edge = _length(far - share[:, None] * run)
    return jnp.where(count == 3, plane, side * jnp.where(count == 2, edge, _length(far)))


def _dot(one: Float[Array, "k 3"], other: Float[Array, "k 3"]) -> Float[Array, "k"]:
    return jnp.sum(one * other, axis=1)


def _length(vectors: Float[Array, "k 3"]) -> Float[Array, "k"]:
    square = _dot(vectors, vectors)
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)
