"""The lattice against closed forms and against Blender's own numbers."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

import moldline as ml
from moldline.errors import GeometryError, ParameterError

UNIT = ((0, 0, 0), (1, 1, 1))


def inside(count=50, seed=0):
    return np.random.default_rng(seed).uniform(0, 1, (count, 3))


@pytest.mark.parametrize("shape", [(7, 4, 3), (2, 2, 2), (3, 3, 3), (6, 5, 4)], ids=str)
@pytest.mark.parametrize("basis", ["b-spline", "bernstein"])
def test_an_affine_motion_of_the_controls_is_that_motion_of_the_geometry(shape, basis):
    lattice = ml.Lattice((1, 2, 3), [[2, 0, 0], [1, 3, 0], [0, 1, 1]], shape, basis=basis)
    points = lattice.origin + inside() @ lattice.edges
    matrix = np.eye(3) + 0.3 * np.random.default_rng(1).normal(size=(3, 3))
    controls = (lattice.rest @ matrix.T + 0.5 - lattice.rest).ravel()
    # weights of about 1, coordinates of about 6: some tens of roundings
    np.testing.assert_allclose(lattice.bind(points)(controls), points @ matrix.T + 0.5, atol=3e-14)


def test_blenders_end_rule_errs_by_a_sixth_of_a_cell_at_the_end():
    lattice = ml.Lattice.box(*UNIT, (5, 1, 1), ends="blender")
    stretch = (lattice.rest - lattice.rest[:1]) * [1, 0, 0]
    moved = lattice.bind(np.array([[0.0, 0.5, 0.5]]))(stretch.ravel())
    # P0 weighs 5/6 and P1 1/6 there, and P1 moves by one cell
    assert float(moved[0, 0]) == pytest.approx(0.25 / 6, abs=1e-15)


@pytest.mark.parametrize("name", ["3x3x3", "7x4x2", "4x3x2", "10x2x1", "1x1x5"])
def test_blenders_rule_gives_blenders_numbers(data, name):
    found = np.load(data(f"blender/lattice_bspline_{name}.npz"))
    shape, matrix = tuple(found["shape"].tolist()), found["lattice_to_world"]

    def placed(points):
        world = points @ matrix[:3, :3].T + matrix[:3, 3]
        return world.reshape(*shape[::-1], 3).transpose(2, 1, 0, 3)

    rest, moved = placed(found["rest"]), placed(found["moved"])
    ends = rest[-1, 0, 0], rest[0, -1, 0], rest[0, 0, -1]
    edges = [
        end - rest[0, 0, 0] if n > 1 else matrix[:3, i]
        for i, (end, n) in enumerate(zip(ends, shape, strict=True))
    ]
    lattice = ml.Lattice(rest[0, 0, 0], edges, shape, ends="blender", outside="extend")
    ours = lattice.bind(found["points"])((moved - rest).ravel())
    # Blender computes in single precision: a few roundings of numbers around 1
    np.testing.assert_allclose(ours, found["deformed"], rtol=0, atol=1e-6)


def test_an_axis_with_too_few_controls_lowers_its_degree():
    cubic = ml.Lattice.box(*UNIT, (3, 2, 1))
    chosen = ml.Lattice.box(*UNIT, (3, 2, 1), basis="bernstein")
    controls = np.random.default_rng(0).normal(size=cubic.size)
    np.testing.assert_allclose(cubic.bind(inside())(controls), chosen.bind(inside())(controls))


def test_one_control_point_along_an_axis_means_no_dependence_on_it():
    lattice = ml.Lattice.box(*UNIT, (4, 1, 2))
    points = inside()
    far = points + np.array([0, 1e3, 0])
    controls = np.random.default_rng(0).normal(size=lattice.size)
    np.testing.assert_allclose(
        lattice.bind(far)(controls) - far, lattice.bind(points)(controls) - points, atol=1e-12
    )


def test_points_outside_stay_or_follow_the_nearest_end():
    outside = np.array([[1.5, 0.5, 0.5], [-3, 0.2, 0.2], [0.5, 0.5, 9]])
    nearest = np.clip(outside, 0, 1)
    controls = np.random.default_rng(0).normal(size=4 * 3 * 3 * 3)
    keep = ml.Lattice.box(*UNIT, (4, 3, 3))
    extend = ml.Lattice.box(*UNIT, (4, 3, 3), outside="extend")
    assert np.array_equal(keep.bind(outside)(controls), outside)
    np.testing.assert_allclose(
        extend.bind(outside)(controls) - outside,
        extend.bind(nearest)(controls) - nearest,
        atol=1e-14,
    )


@pytest.mark.parametrize(("ends", "rows"), [("clamped", 3), ("blender", 2)])
def test_frozen_rows_make_the_border_twice_smooth(ends, rows):
    lattice = ml.Lattice.box(*UNIT, (8, 2, 2), ends=ends, freeze=("x+",))
    assert lattice.frozen.sum() == rows * 4
    controls = jnp.asarray(np.random.default_rng(0).normal(size=lattice.size))

    def motion(x):
        return lattice(jnp.stack([x, 0.4, 0.6])[None], controls)[0] - jnp.array([x, 0.4, 0.6])

    border = 1.0 - 1e-9
    for order in range(3):  # value, slope and curvature fall to the zero outside
        value = jax.jit(motion)(border)
        np.testing.assert_allclose(value, 0.0, atol=1e-6 if order == 2 else 1e-8)
        motion = jax.jacfwd(motion)
    third = jax.jit(motion)(border)
    assert np.abs(third).max() > 1.0  # that one is free


def test_any_sides_can_be_frozen():
    lattice = ml.Lattice.box(*UNIT, (8, 5, 3), ends="blender", freeze=("x-", "x+", "y-"))
    assert np.argwhere(~lattice.frozen).min(axis=0).tolist() == [2, 2, 0]
    assert np.argwhere(~lattice.frozen).max(axis=0).tolist() == [5, 4, 2]
    moved = np.asarray(lattice.moved(np.ones(lattice.size)))
    assert np.array_equal(moved[lattice.frozen], lattice.rest[lattice.frozen])
    np.testing.assert_array_equal(moved[~lattice.frozen], lattice.rest[~lattice.frozen] + 1.0)


@pytest.mark.parametrize("options", [{}, {"ends": "blender"}, {"basis": "bernstein"}], ids=str)
def test_controls_that_move_together_take_the_geometry_along(options):
    lattice = ml.Lattice.box(*UNIT, (5, 4, 2), **options)
    shift = np.array([0.3, -0.2, 0.1])
    controls = np.broadcast_to(shift, (*lattice.shape, 3)).ravel()
    # weights that sum to one: some tens of roundings of numbers below two
    np.testing.assert_allclose(lattice.bind(inside())(controls), inside() + shift, atol=1e-14)


def test_a_mesh_that_leaves_a_moving_border_is_torn_there(ball):
    box = ml.Lattice.box((-2, -2, -2), (0.1, 2, 2), (4, 2, 2))
    t = ml.variable("t", value=0.25)
    case = ml.Pipeline(ball, [ml.Stage(box, {t: ml.links.group(box, "z")}, name="half")])
    from moldline.pipeline.examine import tears

    (tear,) = tears(case)
    assert tear.stage == "half"
    assert tear.widest == pytest.approx(0.25, abs=1e-12)
    assert tear.place[0] == pytest.approx(0.1, abs=1e-6)
    frozen = ml.Lattice.box((-2, -2, -2), (0.1, 2, 2), (6, 2, 2), freeze=("x+",))
    still = ml.Pipeline(ball, [ml.Stage(frozen, {t: ml.links.group(frozen, "z")})])
    assert tears(still) == []


def test_a_gap_is_measured_where_an_edge_leaves_the_box():
    lattice = ml.Lattice.box((0, 0, 0), (2, 1, 1), (2, 1, 2))
    points = np.array([[1.0, 9, 0.5], [3, -9, 0.5], [1.5, 0, 0.2], [1.5, 5, 2.2], [5, 5, 5]])
    tilt = np.zeros((2, 1, 2, 3))
    tilt[1, ..., 2] = 0.4  # grows along x from nothing
    edges = np.array([[0, 1], [3, 2], [0, 2], [1, 4]])  # two leave, one stays in, one is outside
    places, gaps = lattice.tears(points, edges, tilt.ravel())
    np.testing.assert_allclose(places, [[2, 0, 0.5], [1.5, 2, 1.0]], atol=1e-7)
    np.testing.assert_allclose(gaps, [0.4, 0.3], atol=1e-7)
    extended = ml.Lattice.box((0, 0, 0), (2, 1, 1), (2, 1, 2), outside="extend")
    assert len(extended.tears(points, edges, tilt.ravel())[1]) == 0


def test_the_sparse_jacobian_is_the_derivative():
    lattice = ml.Lattice.box(*UNIT, (5, 4, 2), freeze=("x-",))
    binding = lattice.bind(inside(20))
    defined = jax.jit(jax.jacfwd(lambda c: lattice(inside(20), c)))
    full = defined(jnp.zeros(lattice.size)).reshape(60, -1)
    sparse = binding.jacobian()
    np.testing.assert_allclose(sparse.toarray(), full, atol=1e-15)
    assert sparse.nnz <= 20 * 4 * 4 * 2 * 3


def test_a_batch_of_controls_is_mapped():
    lattice = ml.Lattice.box(*UNIT, (3, 2, 2))
    binding = lattice.bind(inside(10))
    batch = np.random.default_rng(0).normal(size=(4, lattice.size))
    together = jax.vmap(binding)(batch)
    np.testing.assert_array_equal(together, np.stack([binding(c) for c in batch]))


def test_a_lattice_and_its_points_may_be_traced_by_jax():
    lattice = ml.Lattice.box(*UNIT, (6, 3, 2), freeze=("x-",))
    points, controls = inside(10), np.linspace(-0.3, 0.4, lattice.size)
    defined = lattice(points, controls)
    for form in (lambda d, x, c: d.bind(x)(c), lambda d, x, c: d.follow(x, c)):
        traced = eqx.filter_jit(form)(lattice, jnp.asarray(points), controls)
        np.testing.assert_allclose(traced, defined, rtol=0, atol=1e-14)


def test_no_points_and_points_of_any_layout_are_welcome():
    lattice = ml.Lattice.box(*UNIT, (4, 3, 2))
    points, controls = inside(10), np.linspace(-0.3, 0.4, lattice.size)
    expected = np.asarray(lattice.bind(points)(controls))
    for form in (lambda x: lattice.bind(x)(controls), lambda x: lattice.follow(x, controls)):
        assert form(np.empty((0, 3))).shape == (0, 3)
        for same in (np.asfortranarray(points), np.repeat(points, 2, axis=0)[::2]):
            np.testing.assert_array_equal(form(same), form(points))
            np.testing.assert_allclose(form(same), expected, rtol=0, atol=1e-15)


@settings(max_examples=40, deadline=None)
@given(
    data=st.data(),
    ends=st.sampled_from(["clamped", "blender"]),
    outside=st.sampled_from(["keep", "extend"]),
)
def test_fast_forms_are_the_definition_everywhere(data, ends, outside):
    lattice = ml.Lattice.box((-1, 0, 2), (1, 3, 2.5), (4, 3, 2), ends=ends, outside=outside)
    coordinate = st.one_of(
        st.sampled_from([-1.0, 0.0, 1.0, 2.0, 2.5, 3.0, 1 / 3, 1e300, -1e300]),
        st.floats(-5, 5, allow_nan=False),
    )
    points = np.array(data.draw(st.lists(st.tuples(*[coordinate] * 3), min_size=7, max_size=7)))
    controls = np.linspace(-0.3, 0.4, lattice.size)
    defined = np.asarray(lattice(points, controls))
    for form in (lattice.bind(points)(controls), lattice.follow(points, controls)):
        np.testing.assert_allclose(form, defined, rtol=1e-15, atol=1e-14)


def by_scipy(shape, u, moves):
    """Displacements from SciPy's splines, at box coordinates inside [0, 1]."""
    weights = []
    for count, place in zip(shape, u.T, strict=True):
        degree = min(3, count - 1)
        inner = np.linspace(0, 1, count - degree + 1)[1:-1]
        knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
        weights.append(BSpline(knots, np.eye(count), degree)(place))
    return np.einsum("nu,nv,nw,uvwd->nd", *weights, moves)


@settings(max_examples=30, deadline=None)
@given(
    shape=st.sampled_from([(7, 4, 3), (4, 3, 2), (5, 1, 2)]),
    turn=st.tuples(*[st.floats(-3, 3)] * 3),
    origin=st.tuples(*[st.floats(-100, 100)] * 3),
    u=st.lists(
        st.tuples(*[st.one_of(st.sampled_from([0.0, 0.25, 0.5, 1.0]), st.floats(0, 1))] * 3),
        min_size=1,
        max_size=20,
    ),
)
def test_any_box_moves_its_inside_as_scipys_splines_do(shape, turn, origin, u):
    """Points on faces, edges and corners of a turned box count as in it, whatever the rounding."""
    edges = Rotation.from_rotvec(turn).as_matrix() * [[2.0], [0.5], [1.0]]
    lattice = ml.Lattice(origin, edges, shape)
    u, moves = np.array(u), np.random.default_rng(0).uniform(-1, 1, (*shape, 3))
    points = lattice.origin + u @ lattice.edges
    expected = points + by_scipy(shape, u, moves)
    # coordinates of 100 are known to 1e-14, so box coordinates too, and motion varies by 10 in one
    np.testing.assert_allclose(lattice.bind(points)(moves.ravel()), expected, rtol=0, atol=1e-12)


def test_many_points_in_threads_and_blocks_are_the_definition():
    lattice = ml.Lattice.box(*UNIT, (4, 4, 4))
    points = inside(70_000)
    controls = 0.1 * np.random.default_rng(1).normal(size=lattice.size)
    defined = lattice(points, controls)
    np.testing.assert_allclose(lattice.bind(points)(controls), defined, atol=1e-15 * 8)
    np.testing.assert_allclose(lattice.follow(points, controls), defined, atol=1e-15 * 8)


def test_a_box_around_a_geometry_encloses_it(ball):
    lattice = ml.Lattice.around(ball, (3, 3, 3), margin=0.1)
    np.testing.assert_allclose(lattice.rest[0, 0, 0], -1.2)
    np.testing.assert_allclose(lattice.rest[-1, -1, -1], 1.2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"shape": (3, 3)}, "three counts of at least 1"),
        ({"shape": (3, 3, 0)}, "three counts of at least 1"),
        ({"shape": (3, 3, 3), "ends": "open"}, "ends must be one of clamped, blender, got 'open'"),
        ({"shape": (3, 3, 3), "freeze": ("x+", "x-")}, "leaves no free control point"),
        ({"shape": (3, 3, 3), "freeze": ("x+",), "degree": 5}, None),
        (
            {"shape": (2, 3, 3), "freeze": ("x+",), "ends": "blender"},
            "freezing x\\+ takes 2 rows, but the lattice has only 2 along x",
        ),
        ({"shape": (2, 3, 3), "freeze": ("x*",)}, "freeze must be one of"),
        ({"shape": (3, 3, 3), "degree": 0}, "degree of a lattice is at least 1"),
        ({"shape": (6, 1, 1), "knots": ([0.5], None, None)}, "need 2 knots, ascending"),
        ({"shape": (4, 4, 4), "ends": "blender", "degree": 2}, "is cubic, with even spacing"),
    ],
)
def test_a_lattice_that_cannot_be_is_refused(options, message):
    if message is None:
        ml.Lattice.box(*UNIT, **options)
        return
    with pytest.raises(ParameterError, match=message):
        ml.Lattice.box(*UNIT, **options)


def test_a_flat_box_and_edges_in_a_plane_are_refused():
    with pytest.raises(GeometryError, match="is flat along z; give that axis one control point"):
        ml.Lattice.box((0, 0, 0), (1, 1, 0), (3, 3, 2))
    with pytest.raises(ParameterError, match=r"must span a box"):
        ml.Lattice((0, 0, 0), [[1, 0, 0], [0, 1, 0], [1, 1, 0]], (3, 3, 3))
