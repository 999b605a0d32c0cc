"""The smallest motion that meets some conditions, and its derivatives.

Of all x with f(x) = wanted, the one that least(x) = x · (weights x) / 2. At it, with multipliers l,

    weights x + (f'(x))ᵀ l = 0,    f(x) = wanted,

and it is these that are differentiated, with the curvature of f.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._types import Array

RANK = 1e-9
"""Singular values below this part of the largest are those of dependent conditions."""

LIMIT = 60
"""Steps."""

HALVINGS = 25
"""Of a step that makes it no better."""

Unknown = Float[Array, "n"]
Misses = Float[Array, "r"]
Both = Float[Array, "both"]
Conditions = Callable[[Unknown], Misses]

Slopes = Callable[[Unknown], tuple[Misses, Float[Array, "r n"]]]
"""Values and slopes of conditions."""


class Solution(NamedTuple):
    """What was found.

    Attributes
    ----------
    x
        The smallest motion.
    iterations
        Steps taken.
    size
        Largest of the last step, relative to x.
    """

    x: Float[Array, "n"]
    iterations: Int[Array, ""]
    size: Float[Array, ""]


def independent(slopes: Float[np.ndarray, "k n"], weights: Float[np.ndarray, "n"]) -> np.ndarray:
    """Combinations (r, k) of conditions that are independent; as many as there are, themselves."""
    left, sizes, _ = np.linalg.svd(slopes / np.sqrt(weights), full_matrices=False)
    rank = int(np.sum(sizes > RANK * sizes.max(initial=0.0)))
    return np.eye(len(slopes)) if rank == len(slopes) else left[:, :rank].T


def least_norm(
    conditions: Conditions,
    wanted: Misses,
    weights: Unknown,
    tolerance: float,
    rounding: float,
    slopes: Slopes | None = None,
    damping: Misses | float = 1.0,
) -> Solution:
    """Solve from zero for independent conditions; x is differentiable in all that they close over.

    Newton's method, each step to the least x of the linearised conditions (a Gauss-Newton step in
    its curvature), halved until the conditions' misses and the length together get less.
    It ends where a step is below `tolerance`, relative to x, and at once where zero misses by no
    more than `rounding`. `slopes` gives values and slopes where there is a faster way than one
    reverse derivative of all conditions for each; `damping` is the part of each miss that a step
    makes good.
    """
    known = slopes or (lambda x: (conditions(x), jax.jacrev(conditions)(x)))

    def missing(x: Unknown) -> Misses:
        return conditions(x) - wanted

    def evaluated(x: Unknown) -> tuple[Misses, Float[Array, "r n"]]:
        values, rows = known(x)
        return values - wanted, rows

    found = _search(missing, evaluated, weights, tolerance, rounding, damping)
    x = _differentiable(missing, evaluated, weights, found.x)
    return Solution(x, found.iterations, found.size)


def _search(
    missing: Conditions,
    evaluated: Slopes,
    weights: Unknown,
    tolerance: float,
    rounding: float,
    damping: Misses | float,
) -> Solution:
    def target(x: Unknown) -> tuple[Unknown, Misses]:
        """Of the linearised conditions the least x, and its multipliers."""
        miss, slopes = evaluated(x)
        spread = slopes / weights
        multipliers = jnp.linalg.solve(spread @ slopes.T, damping * miss - slopes @ x)
        return -(multipliers @ spread), multipliers

    def merit(x: Unknown, price: Float[Array, ""]) -> Float[Array, ""]:
        return 0.5 * x @ (weights * x) + price * jnp.sum(jnp.abs(missing(x)))

    def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
        x, count, _ = state
        aim, multipliers = target(x)
        price = 2 * jnp.max(jnp.abs(multipliers)) + 1e-300
        before = merit(x, price)

        def worse(trial: tuple[Array, Array]) -> Array:
            length, halvings = trial
            after = merit(x + length * (aim - x), price)
            return (after > before * (1 + 1e-12)) & (halvings < HALVINGS)

        whole = (jnp.ones(()), jnp.zeros((), int))
        length, _ = jax.lax.while_loop(worse, lambda t: (t[0] / 2, t[1] + 1), whole)
        new = x + length * (aim - x)
        size = jnp.max(jnp.abs(new - x)) / (jnp.max(jnp.abs(new)) + 1e-300)
        return new, count + 1, size

    def unfinished(state: tuple[Array, ...]) -> Array:
        _, count, size = state
        return (count < LIMIT) & (size > tolerance)

    start = jnp.zeros(weights.shape)
    begun = jnp.where(jnp.max(jnp.abs(missing(start))) > rounding, jnp.inf, 0.0)
    state: tuple[Array, ...] = (start, jnp.zeros((), int), begun)
    return Solution(*jax.lax.while_loop(unfinished, step, state))


def _differentiable(
    missing: Conditions, evaluated: Slopes, weights: Unknown, found: Unknown
) -> Unknown:
    """The solution with the derivatives of the conditions that it meets."""
    count = len(weights)

    def balance(unknown: Both) -> Both:
        x, multipliers = unknown[:count], unknown[count:]
        miss, pull = jax.vjp(missing, x)
        return jnp.concatenate([weights * x + pull(multipliers)[0], miss])

    x = jax.lax.stop_gradient(found)
    slopes = jax.lax.stop_gradient(evaluated(x)[1])
    spread = slopes / weights
    small = spread @ slopes.T
    multipliers = jnp.linalg.solve(small, -(slopes @ x))

    def flat(vector: Both) -> Both:
        """The inverse where the conditions have no curvature."""
        one, other = vector[:count], vector[count:]
        inner = jnp.linalg.solve(small, spread @ one - other)
        return jnp.concatenate([(one - slopes.T @ inner) / weights, inner])

    def solve(matvec: Callable[[Both], Both], right: Both) -> Both:
        return _refined(matvec, flat, right)

    def tangent(linear: Callable[[Both], Both], right: Both) -> Both:
        return jax.lax.custom_linear_solve(linear, right, solve, symmetric=True)

    unknown = jnp.concatenate([x, multipliers])
    root = jax.lax.custom_root(balance, unknown, lambda _, guess: guess, tangent)
    return root[:count]


def _refined(matvec: Callable[[Both], Both], flat: Callable[[Both], Both], right: Both) -> Both:
    """Solve by GMRES, begun and preconditioned by the flat inverse."""
    solution, _ = jax.scipy.sparse.linalg.gmres(
        matvec, right, x0=flat(right), M=flat, tol=1e-13, atol=0.0, restart=30, maxiter=10
    )
    return solution
