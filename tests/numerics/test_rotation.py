"""Rotations by vectors: their quaternions, products, matrices and derivatives at rest."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from moldline.numerics.rotation import increments, product, quaternion, turn

VECTORS = np.random.default_rng(0).normal(size=(200, 3)) * np.logspace(-9, 0.8, 200)[:, None]


def test_rotations_are_those_of_scipy():
    known = Rotation.from_rotvec(VECTORS).as_matrix() - np.eye(3)
    np.testing.assert_allclose(increments(quaternion(VECTORS)), known, rtol=0, atol=3e-15)


def test_small_rotations_lose_no_digits():
    known = np.cross(VECTORS[0], [1.0, 2.0, 3.0])  # to a relative 1e-9
    found = turn(quaternion(VECTORS[0]), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(found, known, rtol=1e-7)


def test_the_series_meets_the_closed_form():
    """At an angle of two, where one takes over from the other."""
    angles = 2 + np.array([-1e-9, 1e-9])
    below, above = np.asarray(quaternion(np.outer(angles, [0.6, 0.0, 0.8])))
    np.testing.assert_allclose(below, above, rtol=0, atol=2e-9)
    np.testing.assert_allclose(np.linalg.norm([below, above], axis=1), 1, rtol=0, atol=4e-16)


def test_a_product_turns_by_the_first_then_by_the_other():
    later, first = Rotation.from_rotvec(VECTORS[::-1]), Rotation.from_rotvec(VECTORS)
    known = (later * first).as_matrix() - np.eye(3)
    both = product(quaternion(VECTORS[::-1]), quaternion(VECTORS))
    np.testing.assert_allclose(increments(both), known, rtol=0, atol=5e-15)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_at_no_rotation_are_those_of_the_series(order):
    """R(t) e_x = (cos t, sin t, 0) about z, so its derivatives are known."""

    def turned(angle):
        return turn(quaternion(angle * jnp.array([0.0, 0.0, 1.0])), jnp.array([1.0, 0.0, 0.0]))

    known = {1: (0, 1, 0), 2: (-1, 0, 0), 3: (0, -1, 0)}[order]
    for _ in range(order):
        turned = jax.jacfwd(turned)
    np.testing.assert_allclose(turned(0.0), known, rtol=0, atol=1e-15)


def test_no_rotation_is_no_displacement_to_the_bit():
    assert np.all(np.asarray(turn(quaternion(np.zeros(3)), VECTORS)) == 0)
