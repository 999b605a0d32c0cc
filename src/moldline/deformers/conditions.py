"""Equations and bounds on what a shape measures, made independent and of one scale."""

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Bool, Float, Int

from .._types import Array
from ..errors import ParameterError
from ..measures.base import Constraint
from ..numerics.least_norm import Problem
from .readings import Readings

RANK = 1e-9
"""Singular values below this part of the largest are those of dependent equations."""

REACHED = 1e-12
"""A condition whose slopes are below this part of the steepest one's is reached by no control."""

ROUNDING = 1e-13
"""A miss that takes a motion of less than this part of the shape's size is none."""


@dataclass(frozen=True, eq=False)
class Conditions:
    """Which numbers of the measures are prescribed and which are bounded.

    Rows are equations first, then bounds, each in the motion of the weighted controls that a change
    of it takes at rest.

    Attributes
    ----------
    labels
        What each number is called.
    equations
        Numbers that are prescribed.
    wanted
        What they are prescribed to be while the pilots rest.
    bounds, signs, limits
        Numbers that are bounded, +1 by an upper and -1 by a lower limit.
    scales
        Of each number: its change for a unit motion of the weighted controls.
    importance
        Of each equation, where they contradict each other.
    weights
        What a change of each control costs.
    basis, sizes
        Where equations depend on each other: the motions of the weighted controls, shape (r, n),
        that tell them apart, and how much they do.
    dependent
        Labels of equations that others imply at rest, as far as slopes tell.
    size
        Of the shape [m].
    """

    labels: tuple[str, ...]
    equations: Int[np.ndarray, "e"]
    wanted: Float[np.ndarray, "e"]
    bounds: Int[np.ndarray, "b"]
    signs: Float[np.ndarray, "b"]
    limits: Float[np.ndarray, "b"]
    scales: Float[np.ndarray, "c"]
    importance: Float[np.ndarray, "e"]
    weights: Float[np.ndarray, "n"]
    basis: Float[np.ndarray, "r n"] | None
    sizes: Float[np.ndarray, "r"]
    dependent: tuple[str, ...]
    size: float

    @property
    def is_bound(self) -> Bool[np.ndarray, "k"]:
        """Which rows are bounds."""
        count = len(self.equations) if self.basis is None else len(self.basis)
        return np.arange(count + len(self.bounds)) >= count

    def slack(self, values: Float[Array, "c"], change: Float[Array, "p"]) -> tuple[Array, Array]:
        """By how much equations and bounds are missed, scaled; `change` is the pilots'."""
        asked = jnp.asarray(self.wanted).at[: len(change)].add(change)
        equations = (values[self.equations] - asked) / self.scales[self.equations]
        over = self.signs * (values[self.bounds] - self.limits)
        return equations, over / self.scales[self.bounds]

    def problem(self, readings: Readings, change: Float[Array, "p"]) -> Problem:
        """What the smallest motion has to meet."""
        rows = np.concatenate([self.equations, self.bounds])
        signs = np.concatenate([np.ones(len(self.equations)), self.signs])
        scale = signs / self.scales[rows]
        count = len(self.equations)

        def evaluated(x: Array) -> tuple[Array, Array]:
            values, slopes = readings.sloped(x)
            misses = jnp.concatenate(self.slack(values, change))
            slopes = scale[:, None] * slopes[rows]
            if self.basis is None:
                return misses, slopes
            combined = self._combined(slopes[:count])
            return (
                jnp.concatenate([combined @ misses[:count], misses[count:]]),
                jnp.concatenate([combined @ slopes[:count], slopes[count:]]),
            )

        def missing(x: Array) -> Array:
            if self.basis is not None:
                return evaluated(x)[0]
            return jnp.concatenate(self.slack(readings.values(x), change))

        rounding = ROUNDING * self.size
        return Problem(missing, evaluated, jnp.asarray(self.weights), self.is_bound, rounding)

    def _combined(self, slopes: Float[Array, "e n"]) -> Float[Array, "r e"]:
        """The normal equations of the least squares, along as many motions as there is rank.

        They vanish where the sum of squares is least, also where slopes are not those at rest.
        """
        assert self.basis is not None
        along = self.basis / np.sqrt(self.weights) / self.sizes[:, None]
        return (along @ slopes.T) * self.importance**2

    def response(self, slopes: Float[np.ndarray, "c n"]) -> Float[np.ndarray, "n e"]:
        """Where all is linear: controls for each equation, of least squares and least cost."""
        root = np.sqrt(self.weights)
        scaled = slopes[self.equations] / self.scales[self.equations, None] / root
        inverse = np.linalg.pinv(self.importance[:, None] * scaled, rcond=RANK)
        return inverse * self.importance / root[:, None] / self.scales[self.equations]


def conditions(
    named: Sequence[tuple[str, Constraint | None]],
    counts: Sequence[int],
    rest: Float[np.ndarray, "c"],
    slopes: Float[np.ndarray, "c n"],
    weights: Float[np.ndarray, "n"],
    size: float,
) -> Conditions:
    """Sort out what is asked: pilots first; without a constraint a number stays as it is at rest.

    `counts` says how many numbers each has, `rest` and `slopes` are theirs by the hidden controls.

    Raises
    ------
    ParameterError
        Where no control reaches a number.
    """
    labels = tuple(name for (name, _), n in zip(named, counts, strict=True) for _ in range(n))
    importance = np.concatenate(
        [
            np.full(n, 1.0 if c is None else c.weight)
            for (_, c), n in zip(named, counts, strict=True)
        ]
    )
    both = [
        (np.full((2, n), np.nan) if c is None else np.stack(c.bounds))
        for (_, c), n in zip(named, counts, strict=True)
    ]
    low, high = np.concatenate(both, axis=1)
    is_kept = np.isnan(low)
    equal = np.flatnonzero(is_kept | (low == high))
    lower, upper = (np.flatnonzero(np.isfinite(x) & (low != high)) for x in (low, high))
    scales = _scales(labels, slopes, weights, np.concatenate([equal, lower, upper]))
    scaled = importance[equal, None] * slopes[equal] / scales[equal, None] / np.sqrt(weights)
    basis, sizes, repeated = _independent(scaled)
    return Conditions(
        labels,
        equal,
        np.where(is_kept, rest, low)[equal],
        np.concatenate([lower, upper]),
        np.concatenate([-np.ones(len(lower)), np.ones(len(upper))]),
        np.concatenate([low[lower], high[upper]]),
        scales,
        importance[equal],
        weights,
        basis,
        sizes,
        tuple(dict.fromkeys(labels[equal[row]] for row in repeated)),
        size,
    )


def _scales(
    labels: Sequence[str], slopes: np.ndarray, weights: np.ndarray, used: np.ndarray
) -> np.ndarray:
    scales = np.sqrt(np.sum(slopes**2 / weights, axis=1))
    if not np.all(np.isfinite(scales[used])):
        lost = used[~np.isfinite(scales[used])][0]
        raise ParameterError(
            f"{labels[lost]!r} has no derivative where the shape is at rest; measure it elsewhere"
        )
    lost = used[scales[used] <= REACHED * scales.max(initial=0.0)]
    if len(lost):
        raise ParameterError(
            f"no control of the hidden deformer reaches {labels[lost[0]]!r}; put it inside, or "
            "leave it out"
        )
    return np.where(scales > 0, scales, 1.0)


def _independent(
    scaled: Float[np.ndarray, "e n"],
) -> tuple[np.ndarray | None, np.ndarray, np.ndarray]:
    """Directions and sizes that tell dependent equations apart, and which of them are too many."""
    if len(scaled) == 0:
        return None, np.zeros(0), np.zeros(0, int)
    _, sizes, right = np.linalg.svd(scaled, full_matrices=False)
    rank = int(np.sum(sizes > RANK * sizes.max(initial=0.0)))
    if rank == len(scaled):
        return None, sizes, np.zeros(0, int)
    order = scipy.linalg.qr(scaled.T, mode="r", pivoting=True)[1]
    return right[:rank], sizes[:rank], np.sort(order[rank:])
