"""What every deformer keeps, as checks that the author of a plug-in runs too.

```python
from moldline.deformers.contract import check

def test_my_deformer_keeps_the_contract():
    check(MyDeformer(), points)
```

Some tens of points do, spread over where the deformer acts and beyond. The derivative by points is
proved by moving each about 1 % of the cloud's size, so none should be that close to a place where
the map has a jump or a kink, such as the face of a box whose outside stays.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._types import Array, Points
from ..numerics.taylor import remainder
from .base import AbstractDeformer
from .foreign import AbstractNumpyDeformer

Clause = Callable[[AbstractDeformer, Points], None]

ROUNDING = 1e-14
"""Two ways of computing a coordinate may differ by this times the largest one: 45 roundings."""

REACH = 0.05
"""Largest distance of the controls that are tried from the neutral ones."""

MOTION = 0.01
"""Largest motion of a point in a proof of derivatives, in sizes of the cloud."""

DIFFERENCES = 1e-7
"""Relative accuracy that is asked of a derivative by central differences."""


def check(deformer: AbstractDeformer, points: Points) -> None:
    """Hold a deformer against all clauses; raises AssertionError with a sentence."""
    for clause in CLAUSES:
        clause(deformer, points)


def neutral_controls_are_as_many_as_its_size(deformer: AbstractDeformer, points: Points) -> None:
    """And finite."""
    neutral = np.asarray(deformer.neutral)
    assert neutral.shape == (deformer.size,), (
        f"{deformer.size} controls need a neutral value each, got shape {neutral.shape}"
    )
    assert np.all(np.isfinite(neutral)), f"neutral controls must be finite, got {neutral}"


def neutral_controls_leave_every_coordinate_equal(
    deformer: AbstractDeformer, points: Points
) -> None:
    """To the bit, by binding, by definition and for points that move."""
    for name, form in _forms(deformer, points).items():
        moved = np.asarray(form(np.asarray(deformer.neutral, float)))
        changed = np.flatnonzero(np.any(moved != points, axis=1))
        assert len(changed) == 0, f"neutral controls move point {changed[0]} by {name}"


def it_does_not_change_what_it_is_given(deformer: AbstractDeformer, points: Points) -> None:
    """Neither points nor controls: others use the same arrays."""
    given, controls = np.array(points), _controls(deformer)
    for form in _forms(deformer, given).values():
        form(controls)
    assert np.array_equal(given, points), "the points given to it are changed in place"
    assert np.array_equal(controls, _controls(deformer)), "the controls are changed in place"


def a_point_moves_the_same_alone_or_in_company(deformer: AbstractDeformer, points: Points) -> None:
    """No point looks at the others, so a flow mesh may ride on a surface."""
    controls = _controls(deformer)
    together, alone = deformer.bind(points)(controls), deformer.bind(points[3:4])(controls)
    _same(alone, together[3:4], _size(together), "a point moves otherwise when it is alone")


def the_binding_agrees_with_the_definition(deformer: AbstractDeformer, points: Points) -> None:
    """To rounding: the fast form sums the same terms in another order."""
    forms, controls = _forms(deformer, points), _controls(deformer)
    defined = forms["definition"](controls)
    _same(forms["binding"](controls), defined, _size(defined), "the binding is not the definition")


def following_agrees_with_the_definition(deformer: AbstractDeformer, points: Points) -> None:
    """To rounding, so it does not matter which stage comes first."""
    forms, controls = _forms(deformer, points), _controls(deformer)
    defined = forms["definition"](controls)
    _same(forms["following"](controls), defined, _size(defined), "follow is not the definition")


def a_jit_changes_neither_value_nor_gradient(deformer: AbstractDeformer, points: Points) -> None:
    """To rounding; users put whole optimisations into one."""
    binding, controls = deformer.bind(points), jnp.asarray(_controls(deformer))
    weights = jnp.asarray(_noise(points.shape, 3))

    def gradient(c: Array) -> Array:
        return jax.vjp(lambda c: binding(c), c)[1](weights)[0]

    moved, slope = binding(controls), gradient(controls)
    _same(jax.jit(lambda c: binding(c))(controls), moved, _size(moved), "a jit changes the result")
    size = len(points) * _size(slope)  # a sum over all points
    _same(jax.jit(gradient)(controls), slope, size, "a jit changes the gradient")


def derivatives_by_controls_are_right(deformer: AbstractDeformer, points: Points) -> None:
    """Also at the neutral controls, where every optimisation begins."""
    binding, along = deformer.bind(points), REACH * _noise(deformer.size, 1)
    for controls in (np.asarray(deformer.neutral, float), _controls(deformer)):
        prove(binding, controls, along, _accuracy(deformer, points, controls))


def derivatives_by_points_are_right(deformer: AbstractDeformer, points: Points) -> None:
    """By definition and for points that move: what stages after another one need."""
    controls = _controls(deformer)
    along = MOTION * float(np.ptp(points, axis=0).max()) * _noise(points.shape, 2)
    accuracy = _accuracy(deformer, points, controls)
    prove(lambda p: deformer(p, controls), points, along, accuracy)
    prove(lambda p: deformer.follow(p, controls), points, along, accuracy)


CLAUSES: tuple[Clause, ...] = (
    neutral_controls_are_as_many_as_its_size,
    neutral_controls_leave_every_coordinate_equal,
    it_does_not_change_what_it_is_given,
    a_point_moves_the_same_alone_or_in_company,
    the_binding_agrees_with_the_definition,
    following_agrees_with_the_definition,
    a_jit_changes_neither_value_nor_gradient,
    derivatives_by_controls_are_right,
    derivatives_by_points_are_right,
)


def prove(form: Callable[[Any], Array], at: Any, along: Any, accuracy: float = 0.0) -> None:
    """Prove a function's derivative: forward by its Taylor remainder, reverse as the transpose.

    `at` and `along` are arrays or dictionaries of arrays. `accuracy` is the relative one of a
    derivative that is known not to be exact.
    """
    at, along = jax.tree.map(jnp.asarray, (at, along))
    value, pushed = jax.jvp(form, (at,), (along,))
    weights = _noise(value.shape, 3)
    (pulled,) = jax.vjp(form, at)[1](jnp.asarray(weights))
    for slope in jax.tree.leaves((pushed, pulled)):
        assert np.all(np.isfinite(slope)), "a derivative is not finite"
    proof = remainder(form, at, along, accuracy)
    assert proof.is_right, f"Taylor remainders {proof.sizes} fall with order {proof.order:.2f}"
    forward = float(np.vdot(weights, pushed))
    reverse = sum(map(float, jax.tree.leaves(jax.tree.map(jnp.vdot, pulled, along))))
    # both are sums of as many products as there are coordinates
    scale = np.linalg.norm(weights) * (np.linalg.norm(pushed) + np.finfo(float).tiny)
    assert abs(forward - reverse) <= (accuracy or 1e-12) * scale, (
        f"reverse is not the transpose of forward: {reverse:.17g} is not {forward:.17g}"
    )


def _forms(deformer: AbstractDeformer, points: Points) -> dict[str, Callable[[Array], Points]]:
    return {
        "binding": deformer.bind(points),
        "definition": lambda controls: deformer(points, controls),
        "following": lambda controls: deformer.follow(points, controls),
    }


def _noise(shape: int | tuple[int, ...], seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, shape)


def _controls(deformer: AbstractDeformer) -> np.ndarray:
    return np.asarray(deformer.neutral, float) + REACH * _noise(deformer.size, 0)


def _accuracy(deformer: AbstractDeformer, points: Points, controls: np.ndarray) -> float:
    if not isinstance(deformer, AbstractNumpyDeformer):
        return 0.0
    return 0.0 if deformer.method(points, controls) == "complex step" else DIFFERENCES


def _size(array: Array) -> float:
    return float(np.abs(np.asarray(array)).max(initial=0.0))


def _same(one: Array, other: Array, size: float, sentence: str) -> None:
    worst = _size(np.asarray(one) - np.asarray(other))
    assert worst <= ROUNDING * size, f"{sentence}: {worst:.1e} apart, in sizes up to {size:.1e}"
