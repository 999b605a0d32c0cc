"""The smallest motion that meets some conditions, and its derivatives.

Of all x with f(x) = 0, or f(x) <= 0 where a condition is a bound, the one that least(x) =
x · (weights x) / 2. At it, with multipliers l,

    weights x + (f'(x))ᵀ l = 0,    f(x) = 0,

(of bounds only those that are active, whose l is positive), and it is these equations that are
differentiated, with the curvature of f. docs/theory/pilots.md derives it.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from .._types import Array
from .bounded_dual import Multipliers, multipliers

LIMIT = 60
"""Steps by linearised conditions."""

POLISHED = 8
"""Newton steps behind them, where they did not get there."""

ACCURACY, MOST_TURNS = 1e-14, 100
"""Of the solution of the linear equations, and the conjugate directions it may take."""

HALVINGS = 25
"""Of a step that makes it no better."""

Unknown = Float[Array, "n"]
Misses = Float[Array, "k"]
Both = Float[Array, "both"]
Conditions = Callable[[Unknown], Misses]

Slopes = Callable[[Unknown], tuple[Misses, Float[Array, "k n"]]]
"""Values and slopes of conditions."""


class Problem(NamedTuple):
    """What is asked of the smallest motion.

    Attributes
    ----------
    missing
        By how much conditions are missed: zero is asked, of bounds zero or less.
    evaluated
        The same with its slopes, by the fastest way there is.
    weights
        Cost of each unknown.
    is_bound
        Which conditions are bounds.
    rounding
        A miss that is none.
    """

    missing: Conditions
    evaluated: Slopes
    weights: Unknown
    is_bound: Bool[np.ndarray, "k"]
    rounding: float


class Solution(NamedTuple):
    """What was found.

    Attributes
    ----------
    x
        The smallest motion.
    multipliers
        Of the conditions: what one more unit of each would cost.
    active
        Which conditions hold as equations.
    iterations
        Steps taken.
    size
        Largest of the last step, before it is halved, relative to x.
    """

    x: Float[Array, "n"]
    multipliers: Misses
    active: Bool[Array, "k"]
    iterations: Int[Array, ""]
    size: Float[Array, ""]


def least_norm(
    problem: Problem, still: Problem, tolerance: float, damping: Misses | float = 1.0
) -> Solution:
    """Solve from zero for independent conditions; x is differentiable in all that they close over.

    Each step goes to the least x of the linearised conditions, halved until their misses and the
    length together get less. It ends where a step is below `tolerance`, relative to x, and at once
    where zero misses nothing. Where such steps converge too slowly, or make nothing less, Newton's
    on the equations above follow. `still` is the same problem, closed over what is not
    differentiated: the search needs no derivatives. `damping` is the part of each miss that a step
    makes good.
    """
    found = _polished(still, _search(still, tolerance, damping), tolerance)
    return found._replace(x=_differentiable(problem, still, found))


def _search(problem: Problem, tolerance: float, damping: Misses | float) -> Solution:
    weights, is_bound = problem.weights, problem.is_bound

    def merit(x: Unknown, price: Float[Array, ""]) -> Float[Array, ""]:
        return 0.5 * x @ (weights * x) + price * jnp.sum(_violation(problem, problem.missing(x)))

    def step(state: tuple[Solution, jax.Array]) -> tuple[Solution, jax.Array]:
        now, _ = state
        x = now.x
        aim, found = _target(problem, damping, x)
        price = 2 * jnp.max(jnp.abs(found.values)) + 1e-300
        # a merit that grows by what its misses are rounded to does not grow
        most = merit(x, price) * (1 + 1e-12) + price * problem.rounding * len(is_bound)

        def worse(trial: tuple[Array, Array]) -> Array:
            length, halvings = trial
            after = merit(x + length * (aim - x), price)
            return ~(after <= most) & (halvings < HALVINGS)

        whole = (jnp.ones(()), jnp.zeros((), int))
        length, halvings = jax.lax.while_loop(worse, lambda t: (t[0] / 2, t[1] + 1), whole)
        new = x + length * (aim - x)
        size = jnp.max(jnp.abs(aim - x)) / (jnp.max(jnp.abs(new)) + 1e-300)
        steps = now.iterations + 1
        return Solution(new, found.values, found.active, steps, size), halvings < HALVINGS

    def unfinished(state: tuple[Solution, jax.Array]) -> Array:
        now, is_better = state
        return (now.iterations < LIMIT) & ~(now.size <= tolerance) & is_better

    start = jnp.zeros(weights.shape)
    missed = jnp.max(_violation(problem, problem.missing(start)))
    begun = jnp.where(missed <= problem.rounding, 0.0, jnp.inf)  # also where it is no number
    none = jnp.zeros(len(is_bound))
    state = Solution(start, none, jnp.asarray(~is_bound), jnp.zeros((), int), begun)
    return jax.lax.while_loop(unfinished, step, (state, jnp.ones((), bool)))[0]


def _target(problem: Problem, damping: Misses | float, x: Unknown) -> tuple[Unknown, Multipliers]:
    """Of the linearised conditions the least x, and its multipliers."""
    miss, slopes = problem.evaluated(x)
    spread = slopes / problem.weights
    matrix, away = spread @ slopes.T, damping * miss - slopes @ x
    if problem.is_bound.any():
        found = multipliers(matrix, away, problem.is_bound, problem.rounding)
    else:
        found = Multipliers(jnp.linalg.solve(matrix, away), jnp.asarray(~problem.is_bound))
    return -(found.values @ spread), found


def _violation(problem: Problem, miss: Misses) -> Misses:
    return jnp.where(problem.is_bound, jnp.maximum(miss, 0.0), jnp.abs(miss))


def _balance(problem: Problem, active: Bool[Array, "k"], unknown: Both) -> Both:
    """The equations of the solution, by x and its multipliers; those of bounds that rest are 0."""
    count = len(problem.weights)
    x, forces = unknown[:count], unknown[count:]
    miss, pull = jax.vjp(problem.missing, x)
    along = problem.weights * x + pull(jnp.where(active, forces, 0.0))[0]
    return jnp.concatenate([along, jnp.where(active, miss, forces)])


def _flat(problem: Problem, active: Bool[Array, "k"], x: Unknown) -> Callable[[Both], Both]:
    """The inverse of the equations' slopes where the conditions have no curvature."""
    count, weights = len(problem.weights), problem.weights
    slopes = jnp.where(active[:, None], problem.evaluated(x)[1], 0.0)
    spread = slopes / weights
    small = spread @ slopes.T + jnp.diag(jnp.where(active, 0.0, 1.0))
    factors = jax.scipy.linalg.lu_factor(small)

    def inverse(vector: Both) -> Both:
        one, other = vector[:count], vector[count:]
        right = jnp.where(active, spread @ one - other, other)
        inner = jax.scipy.linalg.lu_solve(factors, right)
        return jnp.concatenate([(one - slopes.T @ inner) / weights, inner])

    return inverse


def _polished(problem: Problem, found: Solution, tolerance: float) -> Solution:
    """Newton's steps, while they make it better."""
    count = len(problem.weights)

    def step(state: tuple[Solution, jax.Array]) -> tuple[Solution, jax.Array]:
        now, _ = state
        unknown = jnp.concatenate([now.x, now.multipliers])

        def balance(u: Both) -> Both:
            return _balance(problem, now.active, u)

        value, push = jax.linearize(balance, unknown)
        new = unknown - _refined(push, _flat(problem, now.active, now.x), value)
        size = jnp.max(jnp.abs(new - unknown)[:count]) / (jnp.max(jnp.abs(new[:count])) + 1e-300)
        is_better = jnp.linalg.norm(balance(new)) < jnp.linalg.norm(value)
        kept = jnp.where(is_better, new, unknown)
        steps = now.iterations + 1
        return Solution(kept[:count], kept[count:], now.active, steps, size), is_better

    def unfinished(state: tuple[Solution, jax.Array]) -> Array:
        now, is_better = state
        return (now.iterations < found.iterations + POLISHED) & ~(now.size <= tolerance) & is_better

    return jax.lax.while_loop(unfinished, step, (found, jnp.ones((), bool)))[0]


def _differentiable(problem: Problem, still: Problem, found: Solution) -> Unknown:
    """The solution with the derivatives of the equations that it meets."""
    x, forces, active = found.x, found.multipliers, found.active
    flat = _flat(still, active, x)

    def solve(matvec: Callable[[Both], Both], right: Both) -> Both:
        return _refined(matvec, flat, right)

    def tangent(linear: Callable[[Both], Both], right: Both) -> Both:
        return jax.lax.custom_linear_solve(linear, right, solve, symmetric=True)

    def balance(unknown: Both) -> Both:
        return _balance(problem, active, unknown)

    unknown = jnp.concatenate([x, forces])
    root = jax.lax.custom_root(balance, unknown, lambda _, guess: guess, tangent)
    return root[: len(x)]


def _refined(matvec: Callable[[Both], Both], flat: Callable[[Both], Both], right: Both) -> Both:
    """Solve by conjugate gradients, begun and preconditioned by the flat inverse.

    It keeps them among the motions that the conditions leave free, where the equations are positive
    definite: Gould, Hribar and Nocedal, SIAM J. Sci. Comput. 23, 2001.
    """
    solution, _ = jax.scipy.sparse.linalg.cg(
        matvec, right, x0=flat(right), M=flat, tol=ACCURACY, atol=0.0, maxiter=MOST_TURNS
    )
    return solution
