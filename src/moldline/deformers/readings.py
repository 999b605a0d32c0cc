"""What measures read of a shape that a deformer moves, with slopes by its controls."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array, Points
from ..measures.base import AbstractMeasure
from .base import AbstractDeformer
from .net import AbstractControlNet

FEW = 4096
"""Points that a measure reads up to which it is evaluated together with others like it."""

Controls = Float[Array, "n"]
Numbers = Float[Array, "k"]
Slopes = Float[Array, "k n"]


class _Group:
    """Measures that are evaluated together: of few points, or one of many."""

    def __init__(
        self,
        numbers: list[int],
        measures: Sequence[AbstractMeasure],
        moved: Callable[[np.ndarray], Callable[[Controls], Points]],
    ):
        self.measures = [measures[n] for n in numbers]
        reads = np.unique(np.concatenate([m.reads for m in self.measures]).astype(int))
        self.rows = [np.searchsorted(reads, m.reads) for m in self.measures]
        self.places = moved(reads) if len(reads) else lambda controls: jnp.zeros((0, 3))
        self.size = sum(m.size for m in self.measures)

    def values(self, controls: Controls) -> Numbers:
        places = self.places(controls)
        pairs = zip(self.measures, self.rows, strict=True)
        return jnp.concatenate([m.under(places[rows], controls) for m, rows in pairs])

    def slopes(self, controls: Controls) -> tuple[Numbers, Slopes]:
        if self.size > len(controls):
            value, push = jax.linearize(self.values, controls)
            return value, jax.lax.map(push, jnp.eye(len(controls))).T
        value, pull = jax.vjp(self.values, controls)
        return value, jax.lax.map(lambda one: pull(one)[0], jnp.eye(self.size))


class Readings:
    """Numbers of measures under a deformer's controls, one after the other as the measures are.

    Those that change in proportion to the controls are known by their slopes once and for all, so
    that a motion costs them nothing, whatever the size of the shape.
    """

    def __init__(
        self,
        deformer: AbstractDeformer,
        measures: Sequence[AbstractMeasure],
        moved: Callable[[np.ndarray], Callable[[Controls], Points]],
    ):
        """`moved` gives for numbers of points how the deformer moves these."""
        self.neutral = jnp.asarray(deformer.neutral)
        is_net = isinstance(deformer, AbstractControlNet)
        few = [n for n, m in enumerate(measures) if len(m.reads) <= FEW]
        many = [[n] for n, m in enumerate(measures) if len(m.reads) > FEW]
        straight = [n for n in few if is_net and measures[n].is_affine]
        bent = [n for n in few if n not in straight]
        parts = [part for part in (straight, bent, *many) if part]
        self.groups = [_Group(part, measures, moved) for part in parts]
        ends = np.cumsum([0, *(m.size for m in measures)])
        spans = [np.arange(a, b) for a, b in pairwise(ends)]
        self.rows = [np.concatenate([spans[n] for n in part]) for part in parts]
        self.size = int(ends[-1])
        self.is_affine = [is_net and all(measures[n].is_affine for n in part) for part in parts]
        self._known = [
            jax.jit(group.slopes)(self.neutral) if affine else None
            for group, affine in zip(self.groups, self.is_affine, strict=True)
        ]

    def at_rest(self) -> tuple[np.ndarray, np.ndarray]:
        """All numbers and their slopes by the controls at the neutral ones."""
        values, slopes = jax.jit(self.sloped)(jnp.zeros(self.neutral.shape))
        return np.asarray(values), np.asarray(slopes)

    def values(self, change: Controls) -> Numbers:
        """All numbers, for a change of the controls from the neutral ones."""
        return self._gathered(
            [
                known[0] + known[1] @ change if known else group.values(self.neutral + change)
                for known, group in zip(self._known, self.groups, strict=True)
            ]
        )

    def sloped(self, change: Controls) -> tuple[Numbers, Slopes]:
        """The same, and their slopes by the controls."""
        found = [
            (known[0] + known[1] @ change, known[1])
            if known
            else group.slopes(self.neutral + change)
            for known, group in zip(self._known, self.groups, strict=True)
        ]
        return self._gathered([v for v, _ in found]), self._gathered([s for _, s in found])

    def _gathered(self, parts: list[Array]) -> Array:
        total = jnp.zeros((self.size, *parts[0].shape[1:]))
        for rows, part in zip(self.rows, parts, strict=True):
            total = total.at[rows].set(part)
        return total
