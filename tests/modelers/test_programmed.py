"""Shapes of other programs: their derivatives by differences, compiled or not."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from moldline.errors import GeometryError, ParameterError
from moldline.modelers.differencing import Programmed, differences
from moldline.numerics.taylor import remainder

GIVEN = {"size": 2.0, "bends": [0.3, -0.5]}


class Program:
    """Points by a formula; counts how often it is run."""

    def __init__(self):
        self.calls = 0

    def __call__(self, given):
        self.calls += 1
        places = np.linspace(0.0, 1.0, 5)
        first, second = given["bends"]
        heights = given["size"] * np.sin(first * places) + np.exp(second * places)
        return np.stack([given["size"] ** 2 * places, heights, 0 * places], axis=1)


@pytest.fixture
def program():
    function = Program()
    return Programmed(function, GIVEN, None, function(GIVEN))


def test_derivatives_are_right_in_both_modes(program):
    values = program.values
    for along in np.eye(3) * 0.1:
        assert remainder(lambda v: program(v)[0], values, along, accuracy=1e-10).is_right
    weights = np.arange(15.0).reshape(5, 3)
    forward = jax.jacfwd(lambda v: jnp.sum(program(v)[0] * weights))(values)
    reverse = jax.grad(lambda v: jnp.sum(program(v)[0] * weights))(values)
    compiled = jax.jit(jax.grad(lambda v: jnp.sum(program(v)[0] * weights)))(values)
    np.testing.assert_allclose(reverse, forward, rtol=1e-13)
    np.testing.assert_allclose(compiled, reverse, rtol=1e-13)


def test_the_program_runs_once_for_the_same_values(program):
    calls = program.function.calls
    for _ in range(3):
        program(program.values)
    assert program.function.calls == calls
    for _ in range(3):
        jax.grad(lambda v: jnp.sum(program(v)[0]))(program.values)
    assert program.function.calls == calls + 12


def test_errors_are_those_of_the_shorter_step():
    found = differences(lambda v: v[0] ** 3 * np.ones((1, 3)), np.array([1.0]), np.array([0.1]))
    np.testing.assert_allclose(found.jacobian, 3.0, rtol=1e-13)
    np.testing.assert_allclose(found.errors, (0.01 - 0.0025) / 3.0025, rtol=1e-10)


def test_what_is_not_finite_or_fails_is_told(program):
    program.function = lambda given: np.full((5, 3), np.nan)
    with pytest.raises(GeometryError, match="no finite numbers"):
        program(np.array([3.0, 0.0, 0.0]))
    with pytest.raises(ParameterError, match="steps of length, which are no parameters"):
        Programmed(Program(), GIVEN, {"length": 1.0}, np.zeros((5, 3)))
