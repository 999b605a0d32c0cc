"""Tensor-product splines in plain JAX: the definition that the compiled loops are equal to."""

import jax
import jax.numpy as jnp
from jaxtyping import Float

from .._types import Array, Points
from .bspline import Axis


def evaluated(
    axes: tuple[Axis, Axis, Axis], u: Points, controls: Float[Array, "nu nv nw 3"]
) -> Points:
    """Sum of the control values, each with its weight at box coordinates u."""
    powers = [axis.powers for axis in axes]
    table = jnp.einsum("iau,jbv,kcw,uvwd->ijkdabc", *powers, controls, optimize="optimal")
    table = table.reshape(-1, *table.shape[3:])
    found = [_located(axis, u[:, i]) for i, axis in enumerate(axes)]
    cells, local = zip(*found, strict=True)
    lengths = [len(axis.starts) for axis in axes]
    row = (cells[0] * lengths[1] + cells[1]) * lengths[2] + cells[2]
    return _polynomial(table[row], *local)


def _located(axis: Axis, u: Array) -> tuple[Array, Array]:
    cell = jnp.searchsorted(axis.starts, jax.lax.stop_gradient(u), side="right") - 1
    return cell, (u - jnp.asarray(axis.offsets)[cell]) * jnp.asarray(axis.scales)[cell]


def _polynomial(c: Array, x: Array, y: Array, z: Array) -> Array:
    """Nested Horner scheme; c has the shape (n, 3, P, Q, R)."""
    for t in (z, y, x):
        value = c[..., -1]
        weight = t.reshape(-1, *(1,) * (value.ndim - 1))
        for power in range(c.shape[-1] - 2, -1, -1):
            value = value * weight + c[..., power]
        c = value
    return c
