"""Where an edge runs through a triangle and where three planes meet, by NumPy or by JAX."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array


def edge_through_triangle(
    corners: Float[Array, "c five xyz"],
) -> tuple[Float[Array, "c xyz"], Float[Array, "c five"]]:
    """Points on edges (two ends) in the planes of triangles (three corners), and shares.

    With the ends p, the corners q, d = p1 - p0 and n = (q1 - q0) x (q2 - q0), the point is
    p0 + t d with t = n.(q0 - p0) / (n.d). The shares are t, 1 - t and the barycentric coordinates
    in the triangle; none is below 0 where the edge runs through it.
    """
    p0, p1, q0, q1, q2 = (corners[:, i] for i in range(5))
    normal, along = _cross(q1 - q0, q2 - q0), p1 - p0
    t = _dot(normal, q0 - p0) / _dot(normal, along)
    places = p0 + t * along
    return places, _beside([t, 1 - t, *_barycentric(places, q0, q1, q2, normal)])


def three_planes(
    corners: Float[Array, "c nine xyz"],
) -> tuple[Float[Array, "c xyz"], Float[Array, "c nine"]]:
    """Points common to the planes of three triangles each, and barycentric coordinates in them."""
    triangles = [(corners[:, k], corners[:, k + 1], corners[:, k + 2]) for k in (0, 3, 6)]
    n = [_cross(b - a, c - a) for a, b, c in triangles]
    origin = triangles[0][0]  # near by, or digits would cancel
    across = [_cross(n[(k + 1) % 3], n[(k + 2) % 3]) for k in range(3)]
    total = sum(_dot(n[k], triangles[k][0] - origin) * across[k] for k in range(3))
    places = origin + total / _dot(n[0], across[0])
    shares = [_barycentric(places, *q, m) for q, m in zip(triangles, n, strict=True)]
    return places, _beside([s for three in shares for s in three])


def _barycentric(x: Any, a: Any, b: Any, c: Any, normal: Any) -> list[Any]:
    square = _dot(normal, normal)
    sides = ((b, c), (c, a), (a, b))
    return [_dot(_cross(end - start, x - start), normal) / square for start, end in sides]


def _cross(a: Any, b: Any) -> Any:
    return jnp.cross(a, b) if isinstance(a, jax.Array) else np.cross(a, b)


def _dot(a: Any, b: Any) -> Any:
    return (a * b).sum(axis=1, keepdims=True)


def _beside(columns: list[Any]) -> Any:
    first = columns[0]
    together = jnp.concatenate if isinstance(first, jax.Array) else np.concatenate
    return together(columns, axis=1)
