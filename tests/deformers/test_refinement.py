"""More control points that begin with the same shape."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

import moldline as ml
from moldline import links
from moldline.deformers import refinement
from moldline.deformers.contract import check
from moldline.deformers.volume_frame import Box
from moldline.errors import ParameterError
from moldline.mesh import quality, topology
from moldline.numerics import bspline, knots

LOW, HIGH = (-1, -1, -1), (1, 1, 1)
SHEARED = [[2.0, 0.0, 0.0], [1.0, 3.0, 0.2], [0.0, 0.3, 1.0]]

ROUNDING = 2e-14
"""45 roundings of coordinates up to 2."""

LATTICES = {
    "cubic": ml.Lattice.box(LOW, HIGH, (7, 5, 4)),
    "few": ml.Lattice.box(LOW, HIGH, (3, 2, 4)),
    "sheared": ml.Lattice((-1, -1, -0.5), SHEARED, (5, 4, 4), outside="extend"),
    "bernstein": ml.Lattice.box(LOW, HIGH, (6, 3, 4), basis="bernstein"),
    "quintic": ml.Lattice.box(LOW, HIGH, (8, 2, 7), degree=5),
    "uneven": ml.Lattice.box(LOW, HIGH, (6, 2, 2), knots=([0.1, 0.6], None, None)),
    "creased": ml.Lattice.box(LOW, HIGH, (8, 2, 2), knots=([0.3, 0.3, 0.3, 0.7], None, None)),
    "frozen": ml.Lattice.box(LOW, HIGH, (7, 8, 4), freeze=("x+", "y-", "y+")),
}


def trial(lattice, seed=0):
    """Controls, and points inside, outside and on the border."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.5, 1.5, (400, 3))
    points[:40] = np.clip(points[:40], -1, 1)
    return 0.3 * rng.normal(size=lattice.size), points


def finer(lattice):
    """All ways to refine one."""
    more = tuple(n + k for n, k in zip(lattice.shape, (3, 1, 5), strict=True))
    top = max(axis.degree for axis in lattice.axes)
    yield lattice.refined(more)
    yield lattice.refined(2)
    yield lattice.refined(lattice.shape)
    yield lattice.elevated(top + 1)
    yield lattice.elevated(top + 2)


@pytest.mark.parametrize("lattice", LATTICES.values(), ids=LATTICES)
def test_a_finer_lattice_gives_the_coarse_shape(lattice):
    controls, points = trial(lattice)
    expected = lattice(points, controls)
    for fine, transfer in finer(lattice):
        assert transfer.shape == (fine.size, lattice.size)
        for moved in (fine(points, transfer @ controls), fine.bind(points)(transfer @ controls)):
            np.testing.assert_allclose(moved, expected, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(
            fine.follow(points, transfer @ controls), expected, rtol=0, atol=ROUNDING
        )


@pytest.mark.parametrize("name", ["cubic", "sheared", "creased", "frozen"])
def test_derivatives_go_through_the_transfer(name):
    lattice = LATTICES[name]
    controls, points = trial(lattice)
    fine, transfer = lattice.refined(2)
    coarse = lattice.bind(points).jacobian()
    assert abs(fine.bind(points).jacobian() @ transfer - coarse).max() < 1e-14
    along = jnp.asarray(np.random.default_rng(1).normal(size=points.shape))
    slopes = [
        jax.jvp(lambda p, d=deformer, c=c: d(p, jnp.asarray(c)), (jnp.asarray(points),), (along,))[
            1
        ]
        for deformer, c in ((lattice, controls), (fine, transfer @ controls))
    ]
    np.testing.assert_allclose(slopes[1], slopes[0], rtol=0, atol=1e-13)  # slopes reach 10


def test_a_refined_lattice_keeps_the_contract():
    points = np.random.default_rng(0).uniform(-0.97, 0.97, (40, 3))
    check(LATTICES["frozen"].refined((9, 9, 5))[0], points)


@given(st.integers(2, 9), st.integers(1, 5), st.integers(0, 2), st.integers(0, 7), st.data())
@settings(max_examples=60, deadline=None)
def test_any_spline_is_spanned_by_a_finer_one(count, degree, times, extra, data):
    degree = min(degree, count - 1)
    places = data.draw(
        st.lists(st.integers(1, 19), min_size=count - degree - 1, max_size=count - degree - 1)
    )
    inner = np.sort(places) / 20
    if any(np.sum(inner == knot) > degree for knot in inner):
        return
    coarse = bspline.clamped(count, degree, "keep", tuple(inner))
    up = knots.raised(coarse.interior, times)
    up = knots.filled(up, len(up) + extra)
    top = coarse.degree + times
    fine = bspline.clamped(len(up) + top + 1, top, "keep", tuple(up))
    matrix = knots.transfer(coarse, fine)
    u = np.linspace(0, 1, 101)
    one, other = (
        BSpline.design_matrix(u, axis.knots, axis.degree).toarray() for axis in (coarse, fine)
    )
    np.testing.assert_allclose(other @ matrix, one, rtol=0, atol=1e-13)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, rtol=0, atol=ROUNDING)
    assert matrix.min() >= 0
    # control points rest where a linear map puts them
    np.testing.assert_allclose(matrix @ coarse.rest, fine.rest, rtol=0, atol=ROUNDING)


def test_a_knot_in_the_middle_of_a_cubic_gives_the_known_weights():
    """Boehm: halving a Bézier cubic averages neighbours, thrice; here once."""
    coarse = bspline.clamped(4, 3, "keep")
    fine = bspline.clamped(5, 3, "keep", (0.5,))
    half = [[1, 0, 0, 0], [0.5, 0.5, 0, 0], [0, 0.5, 0.5, 0], [0, 0, 0.5, 0.5], [0, 0, 0, 1]]
    np.testing.assert_array_equal(knots.transfer(coarse, fine), half)


def test_elevation_of_a_bezier_curve_is_the_known_one():
    """Piegl and Tiller, The NURBS Book, eq. 5.34."""
    coarse, fine = bspline.clamped(4, 3, "keep"), bspline.clamped(5, 4, "keep")
    share = np.arange(5) / 4
    expected = np.zeros((5, 4))
    for i in range(5):
        for j, weight in ((i - 1, share[i]), (i, 1 - share[i])):
            if 0 <= j < 4:
                expected[i, j] = weight
    np.testing.assert_allclose(knots.transfer(coarse, fine), expected, rtol=0, atol=1e-15)


def test_knots_are_put_in_the_middle_of_the_longest_cells():
    start = np.array([0.5])
    np.testing.assert_array_equal(knots.filled(start, 2), [0.25, 0.5])
    np.testing.assert_array_equal(knots.filled(start, 3), [0.25, 0.5, 0.75])
    np.testing.assert_array_equal(knots.filled(start, 4), [0.25, 0.375, 0.5, 0.75])
    np.testing.assert_array_equal(knots.filled(np.array([0.1, 0.2]), 3), [0.1, 0.2, 0.6])
    thirds = np.array([1 / 3, 2 / 3])
    np.testing.assert_allclose(knots.cut(thirds, 3), np.arange(1, 9) / 9, rtol=1e-15)


def test_frozen_sides_stay_frozen_and_fade_as_they_did():
    lattice = ml.Lattice.box(LOW, HIGH, (7, 4, 4), freeze=("x-",))
    for fine, _ in (lattice.refined((12, 4, 5)), lattice.elevated(4), lattice.refined(3)):
        assert fine.frozen[:3].all()
        assert not fine.frozen[3:].any()
        near = np.array([[-1 + 1e-3, 0.0, 0.0]])
        moved = np.asarray(fine(near, np.ones(fine.size))) - near
        assert 0 < np.abs(moved).max() < 1e-6  # a cube of the distance, times knots


def test_what_frozen_controls_say_is_not_transferred():
    lattice = LATTICES["frozen"]
    _, transfer = lattice.refined(2)
    assert abs(transfer @ np.repeat(lattice.frozen.ravel(), 3)).max() == 0


def test_an_axis_that_nothing_depends_on_is_refined_where_the_outside_moves_along():
    lattice = ml.Lattice.box(LOW, HIGH, (4, 1, 3), outside="extend")
    controls, points = trial(lattice)
    fine, transfer = lattice.refined((5, 6, 4))
    assert [axis.degree for axis in fine.axes] == [3, 3, 2]
    np.testing.assert_allclose(
        fine(points, transfer @ controls), lattice(points, controls), rtol=0, atol=1e-14
    )
    same, _ = ml.Lattice.box(LOW, HIGH, (4, 1, 3)).refined(2)
    assert same.shape == (5, 1, 4)
    assert ml.Lattice.box(LOW, HIGH, (4, 1, 3)).elevated(4)[0].shape == (5, 1, 5)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: LATTICES["cubic"].refined((6, 5, 4)), r"no smaller, or by a whole number"),
        (lambda: LATTICES["cubic"].refined(0), "no smaller"),
        (lambda: LATTICES["cubic"].refined((9, 9)), "three counts"),
        (lambda: LATTICES["cubic"].refined((10**9, 9, 9)), "at most 512"),
        (lambda: LATTICES["cubic"].refined(10**9), "at most 512"),
        (lambda: LATTICES["cubic"].elevated(2), "no lower, 20 at most, got 2"),
        (lambda: LATTICES["cubic"].elevated(10**6), "20 at most"),
        (lambda: LATTICES["cubic"].elevated((4, 4)), "three that are no lower"),
        (
            lambda: ml.Lattice.box(LOW, HIGH, (4, 4, 4), ends="blender").refined(2),
            "'blender' cannot be refined",
        ),
        (
            lambda: ml.Lattice.box(LOW, HIGH, (4, 1, 4)).refined((4, 3, 4)),
            "one control point along y nothing depends on it",
        ),
        (
            lambda: ml.Lattice.box(LOW, HIGH, (6, 2, 2), knots=([0.5] * 3, None, None), degree=2),
            "each 2 times at most",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_refined_is_refused(make, said):
    with pytest.raises(ParameterError, match=said):
        make()


def bent(low, high, counts, name="1", **options):
    """A curved box."""
    lines = [np.linspace(a, b, n) for a, b, n in zip(low, high, counts, strict=True)]
    x, y, z = np.meshgrid(*lines, indexing="ij")
    return Box.of(
        name, np.stack([x + 0.1 * y * z, y + 0.1 * x**2, z + 0.05 * x * y], -1), **options
    )


def turned(box):
    """The same with its axes in another order and direction."""
    return Box.of("2", box.points[:, ::-1].transpose(1, 2, 0, 3))


VOLUMES = {
    "one": ml.ControlVolume([bent(LOW, HIGH, (6, 4, 3))], outside="keep"),
    "two": ml.ControlVolume(
        [bent(LOW, (0, 1, 1), (5, 4, 3)), turned(bent((0, -1, -1), HIGH, (4, 4, 3)))],
        outside="keep",
        freeze=("1:i-",),
    ),
}


@pytest.mark.parametrize("name", VOLUMES)
@pytest.mark.parametrize("way", [lambda v: v.refined(2), lambda v: v.elevated(4)])
def test_a_finer_control_volume_gives_the_coarse_shape(name, way):
    volume = VOLUMES[name]
    fine, transfer = way(volume)
    assert fine.frozen.any() == volume.frozen.any()
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.2, 1.2, (300, 3))
    controls = 0.3 * rng.normal(size=volume.size)
    # Newton's method finds box coordinates to rounding, in either box
    expected = volume.bind(points)(controls)
    assert np.any(np.asarray(expected) != points, axis=1).sum() > 100
    np.testing.assert_allclose(fine.bind(points)(transfer @ controls), expected, rtol=0, atol=1e-13)
    jacobian = fine.bind(points).jacobian() @ transfer - volume.bind(points).jacobian()
    assert abs(jacobian).max() < 1e-13


def test_shared_faces_stay_shared_or_it_is_refused():
    volume = VOLUMES["two"]
    fine, _ = volume.refined(2)
    assert len(fine.rest) == sum(box.points[..., 0].size for box in fine.frame.boxes) - 5 * 4
    even = ml.ControlVolume(
        [bent(LOW, (0, 1, 1), (4, 4, 4)), turned(bent((0, -1, -1), HIGH, (4, 4, 4)))]
    )
    with pytest.raises(ParameterError, match="share a face must be refined alike there"):
        even.refined((4, 4, 7))
    assert len(even.refined((5, 5, 5))[0].rest) == 2 * 5**3 - 5**2


def test_one_box_is_refined_to_counts():
    fine, transfer = VOLUMES["one"].refined((7, 6, 3))
    assert fine.frame.boxes[0].points.shape == (7, 6, 3, 3)
    assert transfer.shape == (fine.size, VOLUMES["one"].size)


TETRAHEDRON = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4.0]])
CORNERS = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
BRICK = np.array([[x, y, z] for z in (0, 1) for y in (0, 2) for x in (0, 3)], float)
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)]


def fans(faces):
    """Triangles of convex polygons."""
    return np.array([(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)])


@pytest.mark.parametrize(("points", "faces"), [(TETRAHEDRON, CORNERS), (BRICK, SIDES)])
def test_a_subdivided_cage_is_the_same_closed_surface(points, faces):
    new, parts, transfer = refinement.subdivided(points, faces)
    assert len(new) == len(np.unique(new, axis=0))
    np.testing.assert_array_equal(new[: len(points)], points)
    assert {len(part) for part in parts} == {len(faces[0])}
    before, after = (ml.Surface(p, fans(f)) for p, f in ((points, faces), (new, parts)))
    assert topology.is_closed(after.faces)
    assert len(parts) == 4 * len(faces)
    for measure in (quality.area, quality.signed_volume):
        assert measure(after) == pytest.approx(measure(before), rel=1e-14)
    assert quality.signed_volume(after) > 0
    np.testing.assert_allclose(transfer.sum(axis=1), 1.0, rtol=1e-15)
    np.testing.assert_array_equal(new, transfer @ points)


def test_subdivision_keeps_functions_that_are_linear_on_each_triangle():
    """Value at any place of a coarse face, from its corners or from the fine ones."""
    values = np.array([1.0, -2.0, 0.5, 4.0])
    new, parts, transfer = refinement.subdivided(TETRAHEDRON, CORNERS)
    fine = transfer @ values
    for number, part in enumerate(parts):
        corners = CORNERS[number // 4]
        middle = new[list(part)].mean(axis=0)
        share = np.linalg.lstsq(
            np.vstack([TETRAHEDRON[corners].T, np.ones(3)]), np.append(middle, 1.0)
        )[0]
        assert fine[list(part)].mean() == pytest.approx(share @ values[corners], rel=1e-13)


def test_coarse_controls_go_on_finer():
    """The page docs/howto/refine.md: coarse first, then finer from the same shape."""
    section = ml.Section(
        np.stack([np.linspace(0, 1, 60), 0.1 * np.sin(np.linspace(0, np.pi, 60)), np.zeros(60)], 1)
    )
    wanted = section.points[:, 1] * (1 + 0.3 * np.sin(9 * section.points[:, 0]))
    box = ml.Lattice.around(section, (4, 2, 1))
    values, heights = np.zeros(8), []
    for _ in range(3):
        link = links.each(box, "y")
        jacobian = box.bind(section.points).jacobian() @ link.matrix

        def misses(values, jacobian=jacobian):
            return section.points[:, 1] + (jacobian @ values)[1::3] - wanted

        begun = np.linalg.norm(misses(values))
        if heights:
            assert begun == pytest.approx(heights[-1], rel=1e-12)  # the same shape
        found = scipy.optimize.least_squares(misses, values)
        heights.append(float(np.linalg.norm(found.fun)))
        box, transfer = box.refined((2 * box.shape[0], 2, 1))
        controls = transfer @ (link.matrix @ found.x)
        values = links.each(box, "y").matrix.T @ controls
    assert heights[0] > 2 * heights[1] > 4 * heights[2]
