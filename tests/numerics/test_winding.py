"""Winding numbers of closed triangulations."""

import numpy as np
import pytest
from numerics.cages import box, elbow, pair

from moldline.numerics.winding import winding, winding_in_jax


@pytest.mark.parametrize("form", [winding, winding_in_jax])
def test_it_counts_how_often_a_cage_goes_around(form):
    points, faces = elbow()
    x = np.array([[0.5, 1.5, 0.5], [1.5, 1.5, 0.5], [1.5, 0.5, 1.5], [9.0, 9.0, 9.0]])
    np.testing.assert_allclose(form(x, points, faces), [1, 0, 0, 0], rtol=0, atol=1e-14)
    np.testing.assert_allclose(form(x, points, faces[:, ::-1])[0], -1, rtol=1e-14)


@pytest.mark.parametrize("form", [winding, winding_in_jax])
def test_components_add_up_and_a_turned_one_takes_away(form):
    points, faces = box((2, 2, 2), (2.0, 2.0, 2.0))
    middle = points.mean(axis=0, keepdims=True)
    both = np.concatenate([points, middle + 0.5 * (points - middle)])
    twice = np.concatenate([faces, faces + 8])
    hollow = np.concatenate([faces, faces[:, ::-1] + 8])
    x = middle + np.array([[0.0, 0, 0], [0.75, 0, 0]])
    np.testing.assert_allclose(form(x, both, twice), [2, 1], rtol=1e-14)
    np.testing.assert_allclose(form(x, both, hollow), [0, 1], rtol=0, atol=1e-14)


def test_both_forms_agree_close_to_the_cage_too():
    points, faces = pair()
    rng = np.random.default_rng(0)
    shares = rng.dirichlet([1, 1, 1], len(faces))
    normal = np.cross(*(points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2)))
    on = np.einsum("tk,tkd->td", shares, points[faces])
    x = np.concatenate([on - 1e-9 * normal, on + 1e-9 * normal])
    around = winding(x, points, faces)
    np.testing.assert_allclose(winding_in_jax(x, points, faces), around, rtol=0, atol=1e-13)
    np.testing.assert_allclose(around, np.repeat([1, 0], len(faces)), rtol=0, atol=1e-5)
