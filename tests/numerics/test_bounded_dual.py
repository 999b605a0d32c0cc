"""Multipliers of bounds against SciPy's least squares of multipliers that are not negative."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import nnls

from moldline.numerics.bounded_dual import multipliers

COUNT, WIDTH = 12, 4
"""Bounds are more than unknowns, so that some depend on others wherever they meet."""


def solved(slopes, miss, is_bound):
    found = jax.jit(lambda m, d: multipliers(m, d, is_bound, 1e-13))(slopes @ slopes.T, miss)
    return np.asarray(found.values), np.asarray(found.active)


@pytest.mark.parametrize("equations", [0, 2])
@pytest.mark.parametrize("seed", range(5))
def test_the_least_x_within_bounds_is_found_where_they_depend_on_each_other(seed, equations):
    rng = np.random.default_rng(seed)
    slopes = rng.normal(size=(COUNT, WIDTH))
    slopes[-3:] = 2 * slopes[3:6]
    is_bound = np.arange(COUNT) >= equations
    miss = slopes @ rng.normal(size=WIDTH) - is_bound * rng.uniform(0, 1, COUNT)
    values, _ = solved(slopes, miss, is_bound)
    x = values @ slopes
    assert np.all(miss - slopes @ x <= 1e-10) and np.all(values[is_bound] >= 0)
    # the same by Lawson and Hanson, chapter 23.4: least distance programming
    signed = np.concatenate([slopes, -slopes[:equations]])
    missed = np.concatenate([miss, -miss[:equations]])
    system = np.vstack([signed.T, missed])
    residual = system @ nnls(system, np.eye(WIDTH + 1)[-1])[0] - np.eye(WIDTH + 1)[-1]
    np.testing.assert_allclose(x, -residual[:-1] / residual[-1], rtol=0, atol=1e-10)


def test_a_bound_that_nothing_moves_or_an_equation_contradicts_holds_up_no_other():
    slopes = np.array([[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
    miss = np.array([1.0, 9.0, 5.0, 2.0])
    values, active = solved(slopes, miss, np.array([False, True, True, True]))
    assert values == pytest.approx([1, 0, 0, 2])
    assert active.tolist() == [True, False, False, True]


def test_no_bounds_are_none():
    values, active = solved(np.eye(2), jnp.ones(2), np.zeros(2, bool))
    assert values == pytest.approx([1, 1]) and active.all()
