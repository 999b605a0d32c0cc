"""Splines against SciPy, the proof of derivatives, and threads."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import BSpline

from moldline.numerics import bspline, cellwise
from moldline.numerics.taylor import remainder
from moldline.numerics.threads import cores, spread


def weights(axis, u):
    cell, t = cellwise.located(axis, u)
    powers = t[:, None] ** np.arange(axis.terms)
    return np.einsum("na,nak->nk", powers, axis.powers[cell])


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_clamped_weights_are_scipys(degree):
    inner = (0.2, 0.45, 0.8)
    count = degree + 1 + len(inner)
    axis = bspline.clamped(count, degree, "keep", inner)
    u = np.linspace(0, 0.999, 41)
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    expected = BSpline(knots, np.eye(count), degree)(u)
    np.testing.assert_allclose(weights(axis, u), expected, atol=1e-14)


@pytest.mark.parametrize(
    "axis",
    [bspline.clamped(7, 3, "keep"), bspline.clamped(6, 5, "keep"), bspline.even(5, "keep")],
    ids=["clamped", "bernstein", "blender"],
)
def test_weights_sum_to_one_inside_and_to_nothing_outside(axis):
    u = np.linspace(0, 1, 33)
    np.testing.assert_allclose(weights(axis, u).sum(axis=1), 1.0, atol=1e-14)
    assert np.all(weights(axis, np.array([-0.1, 1.1])) == 0.0)


def test_at_the_lower_end_only_the_first_control_counts_to_the_bit():
    axis = bspline.clamped(7, 3, "keep")
    assert np.array_equal(weights(axis, np.array([0.0])), np.eye(7)[:1])


def test_control_points_rest_at_the_greville_positions():
    axis = bspline.clamped(5, 3, "keep")
    np.testing.assert_allclose(axis.rest, [0, 1 / 6, 1 / 2, 5 / 6, 1])


def test_a_right_derivative_has_order_two_and_a_wrong_one_does_not():
    x, along = jnp.array([0.3, 0.7]), jnp.array([1.0, -0.4])
    assert remainder(jnp.sin, x, along).is_right
    assert remainder(lambda v: 3 * v, x, along).is_linear

    import jax

    @jax.custom_jvp
    def wrong(v):
        return jnp.sin(v)

    wrong.defjvp(lambda p, t: (wrong(*p), 1.001 * jnp.cos(p[0]) * t[0]))
    assert not remainder(wrong, x, along).is_right


def test_parts_of_a_loop_cover_it_once():
    seen = []
    spread(lambda part, start, stop: seen.append((start, stop)), 1000, least=10)
    assert sorted(seen)[0][0] == 0
    assert sum(stop - start for start, stop in seen) == 1000
    assert len(seen) <= cores()


def test_threads_can_be_chosen(monkeypatch):
    monkeypatch.setenv("MOLDLINE_THREADS", "1")
    assert cores() == 1
