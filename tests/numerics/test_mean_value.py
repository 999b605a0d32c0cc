"""Mean value coordinates of cages."""

import jax
import numpy as np
import pytest
from numerics.cages import box, elbow, inside, pair, wing
from scipy.integrate import lebedev_rule

from moldline.deformers.contract import prove
from moldline.numerics.mean_value import MeanValue

CAGES = {"slab": box((3, 3, 3), (1.0, 0.6, 0.1)), "elbow": elbow(), "pair": pair(), "wing": wing()}
KINDS = ("face", "plane", "edge", "line", "vertex")
NEAR = [1e-3, 1e-6, 1e-9, 1e-12, 1e-15]


@pytest.fixture(params=CAGES)
def cage(request):
    """Points and faces."""
    return CAGES[request.param]


def places(cage, kind, away, count=40):
    """Places that are `away`, in sizes of the cage, from its faces, their planes, edges ..."""
    points, faces = cage
    rng = np.random.default_rng(0)
    size, t = np.ptp(points, axis=0).max(), rng.integers(len(faces), size=count)
    a, b, c = (points[faces[t, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal *= rng.choice([-1, 1], (count, 1)) / np.linalg.norm(normal, axis=1, keepdims=True)
    some = rng.normal(size=(count, 3))
    along = a + rng.uniform(0.1, 0.9, (count, 1)) * (b - a)
    middle = np.einsum("nk,knd->nd", rng.dirichlet([1, 1, 1], count), np.stack([a, b, c]))
    u, v = rng.uniform(-1.5, 2.5, (2, count, 1))
    return {
        "face": middle + away * size * normal,
        "plane": a + u * (b - a) + v * (c - a) + away * size * normal,
        "edge": along + away * size * some,
        "line": a + rng.choice([-0.7, 1.8], (count, 1)) * (b - a) + away * size * some,
        "vertex": a + away * size * some,
    }[kind]


def test_weights_are_the_means_of_what_is_seen():
    """The definition: over all directions, the corners' shares where a ray meets the cage, by one
    over the distance, which is integrated by Lebedev's rule."""
    points, faces = box((2, 2, 2), (2.0, 2.0, 2.0))
    points = points - points.mean(axis=0)
    middle = np.array([[0.2, -0.1, 0.1]])
    rays, amounts = lebedev_rule(131)
    a, b, c = (points[faces[:, k]][None] - middle[:, None] for k in range(3))
    total = np.zeros(8)
    for ray, amount in zip(rays.T, amounts, strict=True):
        shares = np.linalg.solve(
            np.stack([a[0], b[0], c[0]], axis=-1), np.tile(ray, (12, 1))[..., None]
        )
        face = np.argmax(shares[..., 0].min(axis=1))
        total[faces[face]] += amount * shares[face, :, 0]
    np.testing.assert_allclose(
        MeanValue(points, faces).weights(middle)[0], total / total.sum(), rtol=0, atol=2e-3
    )


def test_a_regular_octahedron_is_felt_evenly_from_its_middle():
    points = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array(
        [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    )
    np.testing.assert_allclose(
        MeanValue(points, faces).weights(np.zeros((1, 3))), 1 / 6, rtol=1e-15
    )


def test_weights_sum_to_one_and_give_the_point_inside_and_outside(cage):
    points, faces = cage
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    x = low + np.random.default_rng(0).uniform(-0.5, 1.5, (3000, 3)) * size
    weights = MeanValue(points, faces).weights(x)
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=0, atol=1e-10)
    np.testing.assert_allclose(weights @ points, x, rtol=0, atol=1e-10 * size.max())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("away", [*NEAR, 0.0])
def test_they_give_the_point_near_and_on_faces_planes_edges_and_vertices(cage, kind, away):
    points, faces = cage
    x = places(cage, kind, away)
    weights = MeanValue(points, faces).weights(x)
    assert np.all(np.isfinite(weights))
    tolerance = 1e-11 * np.ptp(points, axis=0).max()
    np.testing.assert_allclose(weights @ points, x, rtol=0, atol=tolerance)


@pytest.mark.parametrize("kind", ["face", "edge", "vertex"])
def test_they_are_continuous_up_to_the_cage(cage, kind):
    mean_value = MeanValue(*cage)
    on = mean_value.weights(places(cage, kind, 0.0))
    before = np.inf
    for away in NEAR:
        gap = np.abs(mean_value.weights(places(cage, kind, away)) - on).max()
        assert gap < max(0.2 * before, 1e-9)  # the wing's tip is 1e-3 of its size thick
        before = gap


def test_on_a_face_only_its_corners_count(cage):
    points, faces = cage
    shares = np.random.default_rng(0).dirichlet([1, 1, 1], len(faces))
    x = np.einsum("tk,tkd->td", shares, points[faces])
    expected = np.zeros((len(faces), len(points)))
    np.put_along_axis(expected, faces, shares, axis=1)
    weights = MeanValue(points, faces).weights(x)
    np.testing.assert_allclose(weights, expected, rtol=0, atol=1e-10)


def test_the_compiled_form_is_the_plain_one(cage):
    mean_value, size = MeanValue(*cage), np.ptp(cage[0])
    x = np.concatenate(
        [places(cage, kind, away, 10) for away in (0.1, *NEAR, 0.0) for kind in KINDS]
    )
    plain = jax.jit(mean_value.evaluated)(x)
    assert np.all(np.isfinite(plain))
    np.testing.assert_allclose(plain @ cage[0], x, rtol=0, atol=1e-11 * size)
    apart = x[:100]  # farther from the cage than rounding
    np.testing.assert_allclose(plain[:100], mean_value.weights(apart), rtol=0, atol=2e-11)


def test_inside_a_convex_cage_none_is_negative():
    points, faces = CAGES["slab"]
    weights = MeanValue(points, faces).weights(inside(points, faces, 2000))
    assert weights.min() > 0


def test_derivatives_by_points_are_exact():
    points, faces = elbow()
    mean_value = MeanValue(points, faces)
    x = inside(points, faces, 60)
    moves = np.random.default_rng(0).normal(size=points.shape)
    walls = np.array([0.0, 1.0, 2.0])[:, None]
    x = x[np.abs(x[:, None] - walls).min(axis=(1, 2)) > 0.05]
    along = 1e-3 * np.random.default_rng(1).normal(size=x.shape)
    prove(jax.jit(lambda p: mean_value.evaluated(p) @ moves), x, along)


def test_the_slope_is_right_in_the_plane_of_a_face():
    """Inside an elbow: the faces of its notch go on as planes through it."""
    points, faces = elbow()
    mean_value = MeanValue(points, faces)
    x = np.array([[0.4, 1.0, 0.3], [1.0, 0.3, 0.6], [1.0, 0.5, 0.2]])
    along = np.random.default_rng(0).normal(size=x.shape)
    slope = jax.jvp(mean_value.evaluated, (x,), (along,))[1]
    step = 1e-5
    ahead, behind = (mean_value.weights(x + s * along) for s in (step, -step))
    np.testing.assert_allclose(slope, (ahead - behind) / (2 * step), rtol=0, atol=1e-8)
    np.testing.assert_allclose(slope @ points, along, rtol=0, atol=1e-11)


def test_slopes_are_finite_everywhere():
    mean_value = MeanValue(*elbow())
    x = np.concatenate([places(elbow(), kind, 0.0, 10) for kind in KINDS])
    pull = jax.jit(lambda p: jax.vjp(mean_value.evaluated, p)[1](np.ones((len(p), 16)))[0])
    assert np.all(np.isfinite(pull(x)))


def test_no_points_have_no_weights(cage):
    none = np.empty((0, 3))
    assert MeanValue(*cage).weights(none).shape == (0, len(cage[0]))
    assert MeanValue(*cage).evaluated(none).shape == (0, len(cage[0]))
