"""The multipliers of a smallest motion under equations and bounds: a small quadratic programme.

Of all l with l_i >= 0 where i is a bound, the one that least(l) = l · (S l) / 2 - d · l, by Lawson
and Hanson's method (Solving Least Squares Problems, 1974, chapter 23): bounds are taken in one at
a time, the most violated first, and left out again where their multiplier would change its sign.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from .._types import Array

State = tuple[Any, Any, Any]

RANK = 1e-12
"""Eigenvalues below this part of the largest belong to bounds that depend on others."""


class Multipliers(NamedTuple):
    """Values, and which of the equations and bounds hold as equations."""

    values: Float[Array, "k"]
    active: Bool[Array, "k"]


def multipliers(
    matrix: Float[Array, "k k"],
    miss: Float[Array, "k"],
    is_bound: Bool[np.ndarray, "k"],
    rounding: float,
) -> Multipliers:
    """Solve it; a bound that is missed by no more than `rounding` is kept."""
    count = len(is_bound)

    def missed(state: State) -> Array:
        values, active, _ = state
        return jnp.where(active, -jnp.inf, miss - matrix @ values)

    def unfinished(state: State) -> Array:
        return (jnp.max(missed(state)) > rounding) & (state[2] < 3 * count)

    def take_in(state: State) -> State:
        values, active, steps = state
        active = active.at[jnp.argmax(missed(state))].set(True)
        values, active, _ = jax.lax.while_loop(
            lambda trial: ~trial[2], leave_out, (values, active, jnp.zeros((), bool))
        )
        return values, active, steps + 1

    def leave_out(trial: State) -> State:
        values, active, _ = trial
        aim = _solved(matrix, miss, active)
        wrong = active & is_bound & (aim <= 0)
        steps = jnp.where(wrong, values / jnp.where(wrong, values - aim, 1.0), jnp.inf)
        length = jnp.minimum(jnp.min(steps), 1.0)
        moved = values + length * (aim - values)
        gone = wrong & (steps <= length)
        return jnp.where(gone, 0.0, moved), active & ~gone, ~jnp.any(wrong)

    start = jnp.asarray(~is_bound)
    state = (_solved(matrix, miss, start), start, jnp.zeros((), int))
    values, active, _ = jax.lax.while_loop(unfinished, take_in, state)
    return Multipliers(values, active)


def _solved(
    matrix: Float[Array, "k k"], miss: Float[Array, "k"], active: Bool[Array, "k"]
) -> Float[Array, "k"]:
    """The active multipliers; of dependent ones the smallest."""
    among = jnp.where(active[:, None] & active, matrix, 0.0)
    sizes, vectors = jnp.linalg.eigh(among)
    keeps = sizes > RANK * jnp.max(jnp.abs(sizes))
    inverse = jnp.where(keeps, 1 / jnp.where(keeps, sizes, 1.0), 0.0)
    found = vectors @ (inverse * (vectors.T @ jnp.where(active, miss, 0.0)))
    # one step of refinement, for the accuracy that a direct solution would have
    left = jnp.where(active, miss - matrix @ found, 0.0)
    return jnp.where(active, found + vectors @ (inverse * (vectors.T @ left)), 0.0)
