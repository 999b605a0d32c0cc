"""Stages in a row: values, derivatives, riders, errors."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import moldline as ml
from moldline import links
from moldline.errors import ParameterError
from moldline.numerics.taylor import remainder
from moldline.pipeline import examine


@pytest.fixture(scope="module")
def case(ball):
    """Two overlaid lattices that really act on each other."""
    box = ml.Lattice.around(ball, (4, 3, 3), margin=0.05)
    nose = ml.Lattice.box((-1.4, -1.4, -1.4), (1.1, 1.4, 1.4), (6, 4, 4), outside="extend")
    t = ml.variable("t", size=4, bounds=(-0.3, 0.3))
    d = ml.variable("d", size=6, bounds=(-0.3, 0.3))
    return ml.Pipeline(
        ball,
        [
            ml.Stage(box, {t: links.thickness(box, "x", "z")}, name="all"),
            ml.Stage(
                nose,
                {d: links.camber(nose, "x", "z"), t: links.camber(nose, "z", "x")},
                name="nose",
            ),
        ],
    )


VALUES = {"t": np.array([0.1, -0.2, 0.15, 0.1]), "d": np.linspace(-0.2, 0.2, 6)}


def test_neutral_values_leave_every_coordinate_equal(case, ball):
    assert np.array_equal(case().points, ball.points)


def test_stages_act_on_what_those_before_them_give(case, ball):
    first, second = case.stages
    middle = first.deformer(ball.points, first.controls(VALUES))
    expected = second.deformer(middle, second.controls(VALUES))
    np.testing.assert_allclose(case(VALUES).points, expected, atol=1e-14)


def test_derivatives_are_exact_through_both_stages(case):
    along = {"t": jnp.array([0.1, 0.2, -0.1, 0.1]), "d": jnp.linspace(0.1, -0.2, 6)}
    proof = remainder(case.points, case.values(VALUES), along)
    assert not proof.is_linear and proof.order == pytest.approx(2.0, abs=0.05)


def test_forward_reverse_and_whole_sensitivity_agree(case):
    rng = np.random.default_rng(0)
    weights = rng.normal(size=case.geometry.points.shape)
    gradient = case.pullback(VALUES, weights)
    for name in ("t", "d"):
        whole = case.sensitivity(VALUES, name)
        direction = rng.normal(size=whole.shape[2])
        pushed = case.pushforward(VALUES, {name: direction})
        np.testing.assert_allclose(pushed, whole @ direction, atol=1e-13)
        np.testing.assert_allclose(
            gradient[name], np.einsum("ni,niv->v", weights, whole), rtol=1e-11
        )


def test_jax_differentiates_a_case_from_outside(case):
    def objective(t):
        return (case({**VALUES, "t": t}).points ** 2).sum()

    t = jnp.asarray(VALUES["t"])
    outside = jax.grad(objective)(t)
    inside = case.pullback(VALUES, 2 * case(VALUES).points)["t"]
    np.testing.assert_allclose(outside, inside, rtol=1e-12)
    np.testing.assert_allclose(jax.jit(jax.grad(objective))(t), inside, rtol=1e-12)


def test_a_case_is_an_argument_of_jax_like_any_array(case):
    inside = eqx.filter_jit(lambda case, values: case.points(values))(case, VALUES)
    np.testing.assert_allclose(inside, case(VALUES).points, rtol=0, atol=1e-14)


def test_a_case_without_stages_changes_nothing(ball):
    case = ml.Pipeline(ball, [])
    assert np.array_equal(case().points, ball.points)
    assert np.all(np.asarray(case.pushforward(None, {})) == 0.0)
    assert case.pullback(None, ball.points) == {}


def test_other_points_move_as_the_surface_does(case, ball):
    flow = case.embed(np.asarray(ball.points)[::7] * 1.0)
    np.testing.assert_array_equal(flow(VALUES).points, case(VALUES).points[::7])
    gradient = flow.pullback(VALUES, np.ones((len(ball.points[::7]), 3)))
    assert set(gradient) == {"t", "d"}


def test_two_geometries_have_their_own_chains_and_share_variables(ball):
    body = ball.moved(ball.points * [3.0, 1.0, 1.0])
    box, tube = ml.Lattice.around(ball, (2, 2, 2)), ml.Lattice.around(body, (5, 2, 2))
    t = ml.variable("t")
    stages = [
        ml.Stage(box, {t: links.group(box, "z")}, on="wing"),
        ml.Stage(tube, {t: 2 * links.group(tube, "x")}, on="body"),
    ]
    for result, motion in (("wing", [0, 0, 0.5]), ("body", [1.0, 0, 0])):
        case = ml.Pipeline({"wing": ball, "body": body}, stages, result)
        rest = case.geometry.points
        np.testing.assert_allclose(case({"t": 0.5}).points - rest, [motion] * len(rest), atol=1e-14)
    with pytest.raises(ParameterError, match="must say on which geometry it acts: wing, body"):
        ml.Pipeline({"wing": ball, "body": body}, [ml.Stage(box, {})])


def test_all_kinds_of_geometry_are_deformed_alike(ball):
    points = np.asarray(ball.points)[:12]
    box = ml.Lattice.around(ball, (3, 3, 3))
    t = ml.variable("t", size=3)
    for geometry in (
        ml.Cloud(points),
        ml.Section(points),
        ml.Grid(points, ((3, 4, 1),)),
        ml.Surface(points, np.array([[0, 1, 2]])),
    ):
        case = ml.Pipeline(geometry, [ml.Stage(box, {t: links.thickness(box, "x", "z")})])
        moved = case({"t": [0.1, 0.2, 0.3]})
        assert type(moved) is type(geometry)
        assert np.abs(np.asarray(moved.points) - points).max() > 0.01


def test_a_fold_is_found_and_a_sound_deformation_is_not_blamed(case, ball):
    assert not examine.folding(case, VALUES).folds
    box = ml.Lattice.around(ball, (4, 2, 2))
    t = ml.variable("t")
    link = links.group(box, "x", index=[(0, j, k) for j in (0, 1) for k in (0, 1)])
    folded = ml.Pipeline(ball, [ml.Stage(box, {t: link})])
    found = examine.folding(folded, {"t": 3.0})
    assert found.folds and found.at_points < 0
    # cubic Bernstein: dx/du = 2.08 - 3 * 3 at u = 0 where the end control moves by 3
    assert found.smallest == pytest.approx(1 - 9 / 2.08, rel=1e-12)
    assert len(examine.turned_faces(folded, {"t": 3.0})) > 0


def test_the_proof_covers_both_directions(case):
    proof = examine.proof(case, VALUES)
    assert proof.is_right and proof.method == "exact"
    assert proof.mismatch < 1e-12


class Ripple(ml.AbstractNumpyDeformer):
    """Waves along x, in NumPy."""

    @property
    def size(self):
        return 1

    def move(self, points, controls):
        return points + controls[0] * np.sin(3 * points[:, :1])


def test_a_numpy_stage_is_proved_among_ours(ball):
    cloud, box = ml.Cloud(ball.points[:40]), ml.Lattice.around(ball, (3, 3, 3))
    t, r = ml.variable("t", size=3, typical=0.1), ml.variable("r", typical=0.1)
    thick, ripple = {t: links.thickness(box, "x", "z")}, {r: links.controls(Ripple())}
    for stages in (
        [ml.Stage(box, thick), ml.Stage(Ripple(), ripple)],
        [ml.Stage(Ripple(), ripple), ml.Stage(box, thick)],
    ):
        proof = examine.proof(ml.Pipeline(cloud, stages), {"t": [0.1, 0.2, 0.1], "r": 0.1})
        assert proof.is_right and proof.method == "complex step"
        assert proof.mismatch < 1e-10


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"x": 1.0}, "nothing named 'x'; there is: t, d"),
        ({"t": [1.0, 2.0]}, "'t' has 4 numbers, got shape"),
        ({"d": [np.nan] * 6}, "must be finite"),
    ],
)
def test_wrong_values_are_told(case, values, message):
    with pytest.raises(ParameterError, match=message):
        case(values)


@pytest.mark.parametrize(
    ("directions", "message"),
    [
        ({"x": 1.0}, "nothing named 'x'; there is: t, d"),
        ({"t": 1.0}, "'t' has 4 numbers, got shape"),
    ],
)
def test_wrong_directions_are_told(case, directions, message):
    with pytest.raises(ParameterError, match=message):
        case.pushforward(VALUES, directions)


def test_wrong_links_and_cotangents_are_told(case, ball):
    box = ml.Lattice.around(ball, (2, 2, 2))
    with pytest.raises(
        ParameterError, match="takes 1 numbers, the variable has 2; make its size 1"
    ):
        ml.Stage(box, {ml.variable("t", size=2): links.group(box, "z")})
    with pytest.raises(ParameterError, match="the cotangent must have the shape"):
        case.pullback(VALUES, np.ones((3, 3)))
    pair = (
        {ml.variable("t"): links.group(box, "z")},
        {ml.variable("t", value=1.0): links.group(box, "z")},
    )
    with pytest.raises(ParameterError, match="two different variables are named 't'"):
        ml.Pipeline(ball, [ml.Stage(box, p) for p in pair])


def test_a_mirrored_stage_neither_moves_points_across_its_plane_nor_brings_them_back(ball):
    box = ml.Lattice.around(ball, (3, 3, 3), margin=0.1)
    aside = ml.variable("aside", size=3)
    lift = ml.variable("lift", size=27)
    stages = [
        ml.Stage(box, {aside: links.camber(box, "x", "y")}),
        ml.Stage(box, {lift: links.mirrored(box, links.each(box, "z"), "y")}),
    ]
    case = ml.Pipeline(ball, stages)
    on_plane = ball.points[:, 1] == 0
    lifted = {"lift": np.linspace(-0.1, 0.1, 27)}
    assert np.all(np.asarray(case(lifted).points)[on_plane, 1] == 0)
    moved = {"aside": [0.1, 0.2, 0.1]}
    alone = ml.Pipeline(ball, stages[:1])
    np.testing.assert_array_equal(case(moved).points, alone(moved).points)
    slope = case.pushforward({}, {"aside": [1.0, 1.0, 1.0]})
    np.testing.assert_allclose(slope[:, 1], alone.pushforward({}, {"aside": [1.0, 1.0, 1.0]})[:, 1])
    assert np.abs(np.asarray(slope)[on_plane, 1]).min() > 0.1
