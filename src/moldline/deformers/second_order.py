"""Whether a motion that meets conditions is the least one nearby, by its second derivatives."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse.linalg

from .._types import Array, Vector
from ..numerics.least_norm import Problem, Solution

ACCURACY = 1e-3
"""Of the smallest curvature."""


class Probe(NamedTuple):
    """First and second derivatives of a problem's conditions, compiled once for all that is asked.

    Attributes
    ----------
    slopes
        Of the conditions, by what is asked and the motion.
    bend
        By these, multipliers and a vector: the conditions' second derivatives times the vector.
    """

    slopes: Callable[..., Any]
    bend: Callable[..., Any]


def probe(problem: Callable[[Array], Problem]) -> Probe:
    """Of the problem that something asked for makes."""

    def bend(asked: Array, motion: Array, forces: Array, along: Array) -> Array:
        def gradient(x: Array) -> Array:
            return jax.vjp(problem(asked).missing, x)[1](forces)[0]

        return jax.jvp(gradient, (motion,), (along,))[1]

    return Probe(jax.jit(lambda asked, motion: problem(asked).evaluated(motion)[1]), jax.jit(bend))


def smallest_curvature(
    probed: Probe, weights: Vector, asked: Array, motion: Array, solution: Solution
) -> float:
    """The least growth of the cost, per cost, along motions that keep all conditions.

    The smallest eigenvalue of the Lagrangian's second derivative in the weighted controls, on the
    motions that the active conditions leave free: above 0 the motion is a minimum, and depends
    smoothly on what is asked. Of a motion that is no number it is none either.
    """
    if not np.all(np.isfinite(motion)):
        return np.nan
    root = np.sqrt(np.asarray(weights))
    active = np.asarray(solution.active)
    slopes = np.asarray(probed.slopes(asked, motion))[active] / root
    forces = jnp.where(solution.active, solution.multipliers, 0.0)
    kept = np.linalg.qr(slopes.T)[0] if len(slopes) else np.zeros((len(root), 0))
    if kept.shape[1] >= len(root):
        return 1.0

    def free(vector: np.ndarray) -> np.ndarray:
        return vector - kept @ (kept.T @ vector)

    def product(vector: np.ndarray) -> np.ndarray:
        """What the cost's own curvature, 1, leaves: that of the conditions alone."""
        along = free(np.ravel(vector))
        return free(np.asarray(probed.bend(asked, motion, forces, along / root)) / root)

    shape = (len(root), len(root))
    operator = scipy.sparse.linalg.LinearOperator(shape, product, dtype=float)
    begin = np.random.default_rng(0).normal(size=len(root))
    if np.linalg.norm(product(begin)) <= 1e-12 * np.linalg.norm(begin):
        return 1.0
    try:
        low = scipy.sparse.linalg.eigsh(
            operator, k=1, which="SA", tol=ACCURACY, v0=begin, return_eigenvectors=False
        )
    except scipy.sparse.linalg.ArpackNoConvergence as error:
        low = error.eigenvalues if len(error.eigenvalues) else np.array([np.nan])
    return float(1 + min(low[0], 0.0))
