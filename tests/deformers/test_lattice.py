"""The lattice against closed forms and against Blender's own numbers."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
    far = points + [0, 1e3, 0]
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
        np.testing.assert_allclose(motion(border), 0.0, atol=1e-6 if order == 2 else 1e-8)
        motion = jax.jacfwd(motion)
    assert np.abs(motion(border)).max() > 1.0  # the third derivative is free


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


def test_the_sparse_jacobian_is_the_derivative():
    lattice = ml.Lattice.box(*UNIT, (5, 4, 2), freeze=("x-",))
    binding = lattice.bind(inside(20))
    full = jax.jacfwd(binding)(jnp.zeros(lattice.size)).reshape(60, -1)
    sparse = binding.jacobian()
    np.testing.assert_allclose(sparse.toarray(), full, atol=1e-15)
    assert sparse.nnz <= 20 * 4 * 4 * 2 * 3


def test_second_derivatives_of_the_kernels_are_those_of_the_definition():
    lattice = ml.Lattice.box((-1, -1, -1), (2, 2, 2), (4, 3, 3))
    points, rng = inside(12), np.random.default_rng(3)
    controls, along = 0.1 * rng.normal(size=(2, lattice.size))
    weights = rng.normal(size=points.shape)

    def curvature(form):
        def scalar(c):
            return (form(form(points, c), c) ** 3 * weights).sum()

        return jax.jvp(jax.grad(scalar), (controls,), (along,))[1]

    np.testing.assert_allclose(curvature(lattice.follow), curvature(lattice), rtol=1e-11)


def test_a_batch_of_controls_is_mapped():
    lattice = ml.Lattice.box(*UNIT, (3, 2, 2))
    binding = lattice.bind(inside(10))
    batch = np.random.default_rng(0).normal(size=(4, lattice.size))
    together = jax.vmap(binding)(batch)
    np.testing.assert_array_equal(together, np.stack([binding(c) for c in batch]))


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
