"""The multipliers of a smallest motion under equations and bounds: a small quadratic programme.

Of all l with l_i >= 0 where i is a bound, the one that least(l) = l · (S l) / 2 - d · l, by Lawson
and Hanson's method (Solving Least Squares Problems, 1974, chapter 23): bounds are taken in one at
a time, the most violated first, and left out again where their multiplier would change its sign.
Where a bound depends on those that hold, multipliers grow along what they have in common, at no
cost, until one of them is zero and left out; where none falls, the bound contradicts them.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from .._types import Array

State = tuple[Any, ...]

RANK = 1e-12
"""Eigenvalues below this part of the largest belong to bounds that depend on others."""

FALLS = 1e-9
"""A multiplier falls where it does by more than this part of the largest change."""


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
    """Solve it; a bound that is missed by no more than `rounding` is kept.

    A bound that equations and bounds before it contradict, or that nothing moves, is left out.
    """
    count = len(is_bound)

    def missed(state: State) -> Array:
        values, active, refused, _ = state
        return jnp.where(active | refused, -jnp.inf, miss - matrix @ values)

    def unfinished(state: State) -> Array:
        return (jnp.max(missed(state)) > rounding) & (state[3] < 3 * count)

    def take_in(state: State) -> State:
        values, active, refused, steps = state
        one = jnp.argmax(missed(state))
        values, active, *_ = jax.lax.while_loop(
            lambda trial: ~trial[2],
            leave_out,
            (values, active.at[one].set(True), jnp.zeros((), bool), one),
        )
        refused = ~active[one] & refused.at[one].set(True)  # until another is taken in
        return values, active, refused, steps + 1

    def leave_out(trial: State) -> State:
        values, active, _, one = trial
        aim, common = _solved(matrix, miss, active)
        depends = jnp.max(jnp.abs(common)) > rounding
        change = jnp.where(depends, common, aim - values)
        falls = jnp.where(depends, common < -FALLS * jnp.max(jnp.abs(common)), aim <= 0)
        wrong = active & is_bound & falls
        steps = jnp.where(wrong, values / jnp.where(wrong & (change < 0), -change, 1.0), jnp.inf)
        contradicts = depends & ~jnp.any(wrong)
        whole = jnp.where(contradicts, 0.0, jnp.where(depends, jnp.inf, 1.0))
        length = jnp.minimum(jnp.min(steps), whole)
        gone = (wrong & (steps <= length)) | (contradicts & (jnp.arange(count) == one))
        moved = jnp.where(gone, 0.0, values + length * change)
        return moved, active & ~gone, ~jnp.any(gone), one

    start = jnp.asarray(~is_bound)
    none = jnp.zeros(count, bool)
    state = (_solved(matrix, miss, start)[0], start, none, jnp.zeros((), int))
    values, active, *_ = jax.lax.while_loop(unfinished, take_in, state)
    return Multipliers(values, active)


def _solved(
    matrix: Float[Array, "k k"], miss: Float[Array, "k"], active: Bool[Array, "k"]
) -> tuple[Float[Array, "k"], Float[Array, "k"]]:
    """The active multipliers, of dependent ones the smallest; and what of the misses none makes."""
    among = jnp.where(active[:, None] & active, matrix, 0.0)
    sizes, vectors = jnp.linalg.eigh(among)
    keeps = sizes > RANK * jnp.max(jnp.abs(sizes))
    inverse = jnp.where(keeps, 1 / jnp.where(keeps, sizes, 1.0), 0.0)
    along = vectors.T @ jnp.where(active, miss, 0.0)
    found = vectors @ (inverse * along)
    # one step of refinement, for the accuracy that a direct solution would have
    left = jnp.where(active, miss - matrix @ found, 0.0)
    found = jnp.where(active, found + vectors @ (inverse * (vectors.T @ left)), 0.0)
    return found, jnp.where(active, vectors @ jnp.where(keeps, 0.0, along), 0.0)
