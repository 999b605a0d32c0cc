"""Deformers in plain NumPy: how they are differentiated, and how well."""

import jax
import numpy as np
import pytest

import moldline as ml

POINTS = np.random.default_rng(0).uniform(-1, 1, (40, 3))


class Turn(ml.AbstractNumpyDeformer):
    """Turns about z by an angle [rad], with numbers that must be real."""

    @property
    def size(self):
        return 1

    def move(self, points, controls):
        angle = float(controls[0])
        turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0]])
        return np.concatenate([points[:, :2] @ turn[:, :2], points[:, 2:]], axis=1)


class Spread(ml.AbstractNumpyDeformer):
    """Moves along the distance from the z axis, whose norm is not the one of complex numbers."""

    @property
    def size(self):
        return 1

    def move(self, points, controls):
        distance = np.linalg.norm(points[:, :2], axis=1, keepdims=True)
        return points + controls[0] * distance * np.array([0, 0, 1])


@pytest.mark.parametrize("scale", [1.0, 3e4], ids=["metres", "millimetres"])
def test_central_differences_suit_points_and_controls_of_different_sizes(scale):
    points, turn = scale * POINTS, Turn()
    assert turn.method(points, np.array([0.3])) == "central differences"
    slope = jax.jacfwd(lambda c: turn(points, c))(np.array([0.3]))[..., 0]
    x, y = points[:, 0], points[:, 1]
    s, c = np.sin(0.3), np.cos(0.3)
    exact = np.stack([-s * x - c * y, c * x - s * y, 0 * x], axis=1)
    np.testing.assert_allclose(slope, exact, rtol=0, atol=1e-9 * scale)


def test_a_complex_step_that_differences_contradict_is_not_taken():
    controls = np.array([0.2])
    assert Spread().method(POINTS, controls) == "central differences"
    slope = jax.jvp(lambda p: Spread()(p, controls), (POINTS,), (POINTS,))[1]
    expected = Spread().move(POINTS, controls)  # it scales with the points
    np.testing.assert_allclose(slope, expected, rtol=0, atol=1e-9)


def test_reverse_is_the_transpose_of_forward_also_inside_a_jit():
    rng, controls = np.random.default_rng(1), np.array([0.2])
    motion, weights = rng.normal(size=(2, *POINTS.shape))
    change = rng.normal(size=1)
    deformer = Turn()
    forward = jax.jit(lambda *d: jax.jvp(deformer, (POINTS, controls), d)[1])(motion, change)
    at_points, at_controls = jax.jit(lambda w: jax.vjp(deformer, POINTS, controls)[1](w))(weights)
    reverse = np.vdot(at_points, motion) + np.vdot(at_controls, change)
    assert np.vdot(weights, forward) == pytest.approx(reverse, rel=1e-7)  # by differences
