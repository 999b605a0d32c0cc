"""A live Blender's mesh deform modifier and our harmonic cage, on the same cage and points."""

import numpy as np
import pytest
from blender_process import cage_scene
from numerics.cages import box, wing

import moldline as ml
from moldline.errors import GeometryError

BAR = box((3, 3, 3), (1.0, 0.25, 0.25))
"""26 points around a place in which Blender's grid, a cube, has many nodes."""

pytestmark = pytest.mark.blender


@pytest.fixture(scope="module")
def points():
    """A fifth of the half-widths and more away from the bar's cage."""
    points, _ = BAR
    low, high = points.min(axis=0) + 0.025, points.max(axis=0) - 0.025
    return np.random.default_rng(0).uniform(low, high, (2000, 3))


@pytest.fixture(scope="module")
def controls():
    return 0.02 * np.random.default_rng(1).normal(size=3 * len(BAR[0]))


def moved(blender, points, cage, controls, precision, faces=None):
    """Blender's points, and that it says it has bound them."""
    scene = cage_scene(points, cage, controls, precision)
    told = blender.open(**scene if faces is None else scene | {"cage_faces": faces})
    assert told["is_bound"]
    return blender.deform()["deformed"]


def rms(difference, controls):
    """In the largest displacement of a vertex's coordinate."""
    return np.sqrt(np.mean(difference**2)) / np.abs(controls).max()


def test_blenders_weights_come_nearer_to_ours_as_its_grid_is_refined(blender, points, controls):
    """By the square of its cells: what is left is its own error."""
    cage = ml.Cage(*BAR, cells=(64, 48, 48))
    ours = np.asarray(cage.bind(points)(controls))
    assert rms(ours - points, controls) > 0.1
    errors = [
        rms(moved(blender, points, cage, controls, precision) - ours, controls)
        for precision in (4, 5, 6)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(orders > 1.5)
    assert errors[-1] < 1e-3


def test_ours_come_nearer_to_blenders_best_as_our_grid_is_refined(blender, points, controls):
    cages = [ml.Cage(*BAR, cells=(2 * n, n, n)) for n in (6, 12, 24)]
    best = moved(blender, points, cages[0], controls, 6)
    errors = [rms(np.asarray(cage.bind(points)(controls)) - best, controls) for cage in cages]
    assert errors[0] > 1.8 * errors[1] > 1.8**2 * errors[2]


def test_an_open_cage_moves_nothing_in_blender_and_is_refused_here(blender, points, controls):
    corners, faces = BAR
    theirs = moved(blender, points, ml.Cage(*BAR), controls, 5, faces=faces[1:])
    np.testing.assert_allclose(theirs, points, rtol=0, atol=1e-7)
    with pytest.raises(GeometryError, match="the cage is open at 3 edges"):
        ml.Cage(corners, faces[1:])


def test_a_cage_whose_faces_look_inwards_binds_the_outside_in_blender(blender, points, controls):
    corners, faces = BAR
    cage = ml.Cage(*BAR)
    theirs = moved(blender, points, cage, controls, 5, faces=faces[:, ::-1])
    np.testing.assert_allclose(theirs, points, rtol=0, atol=1e-7)
    turned = ml.Cage(corners, faces[:, ::-1])  # turned outwards
    ours = np.asarray(cage.bind(points)(controls))
    np.testing.assert_allclose(turned.bind(points)(controls), ours, rtol=0, atol=1e-12)
    assert rms(ours - points, controls) > 0.1


def test_points_outside_stay_in_blender_and_are_refused_here(blender, points, controls):
    cage = ml.Cage(*BAR)
    some = points.copy()
    some[:50, 1] += 1.0
    stay = np.abs(moved(blender, some, cage, controls, 5) - some).max(axis=1) < 1e-6
    assert np.flatnonzero(stay).tolist() == list(range(50))
    with pytest.raises(GeometryError, match="50 of 2000 points lie outside the cage: point 0 at"):
        cage.bind(some)


@pytest.mark.parametrize("precision", [5, 6])
def test_a_thin_wings_cage_moves_nothing_in_blender_and_all_here(blender, precision):
    """20 x 3 x 0.3: the cells of a cube are not thin enough, and Blender calls it bound."""
    corners, faces = wing()
    share = np.random.default_rng(0).uniform([-0.4, 0.05, -0.4], [0.4, 0.95, 0.4], (500, 3))
    share[:, [0, 2]] *= 1 - 0.6 * share[:, 1:2]
    points = share * [3.0, 20.0, 0.3]
    points[:, 0] += 0.4 * points[:, 1]
    cage = ml.Cage(corners, faces)
    matrix, shift = np.array([[0.01, 0.02, 0], [0, 0.01, 0], [0, 0.05, 0.1]]), [0.1, 0.2, 0.3]
    controls = (corners @ matrix.T + shift).ravel()
    theirs = moved(blender, points, cage, controls, precision)
    np.testing.assert_allclose(theirs, points, rtol=0, atol=2e-6)  # a rounding of 20
    ours = cage.bind(points)(controls)
    np.testing.assert_allclose(ours, points + points @ matrix.T + shift, rtol=0, atol=1e-12)
