"""Pilots: what is asked for comes out, with the least motion, and exact derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import moldline as ml
from moldline.deformers.contract import check, prove
from moldline.deformers.pilots import Pilots
from moldline.errors import ParameterError
from moldline.measures.angle import Incidence
from moldline.measures.distance import Distance
from moldline.measures.position import Position
from moldline.measures.separation import Separation
from moldline.measures.spot import Spot
from moldline.measures.volume import Volume

V = Spot.vertex


@pytest.fixture(scope="module")
def body(ball):
    return ml.Surface(np.asarray(ball.points) * np.array([3.0, 1.0, 0.7]), ball.faces)


@pytest.fixture(scope="module")
def lattice(body):
    return ml.Lattice.around(body, (5, 3, 3), margin=0.3)


@pytest.fixture(scope="module")
def bent(body, lattice):
    """Nonlinear: a length and an angle, at constant volume."""
    pilots = {"length": Distance(V(0), V(3)), "tilt": Incidence(V(3), V(1))}
    return Pilots(body.points, lattice, pilots, {"volume": Volume(body.faces)})


@pytest.fixture(scope="module")
def moved(body, lattice):
    """Linear: two places, a thickness kept."""
    pilots = {"nose": Position(V(3), "z"), "top": Position(V(2), "xz")}
    return Pilots(body.points, lattice, pilots, {"thick": Separation(V(5), V(2), "z")})


def test_linear_conditions_are_met_to_rounding_by_one_product(moved, body):
    change = np.array([0.1, -0.05, 0.2])
    points = np.asarray(moved.bind(body.points)(change))
    rest = np.asarray(body.points)
    assert points[3, 2] - rest[3, 2] == pytest.approx(0.1, abs=1e-14)
    assert points[2, [0, 2]] - rest[2, [0, 2]] == pytest.approx([-0.05, 0.2], abs=1e-14)
    assert points[2, 2] - points[5, 2] == pytest.approx(rest[2, 2] - rest[5, 2], abs=1e-14)
    assert moved.response is not None


def test_volume_length_and_angle_are_met_together(bent, body):
    change = np.array([0.4, 0.1])
    points = np.asarray(bent.bind(body.points)(change))
    for measure, asked in zip(bent.measures, [*(bent.values + change), None], strict=True):
        asked = np.asarray(measure(body.points)) if asked is None else asked
        assert np.asarray(measure(points)) == pytest.approx(asked, rel=1e-12)
    report = bent.report(change)
    assert report.is_converged and report.unmet == () and report.iterations > 2
    assert bent.report(np.zeros(2)).iterations == 0


def test_no_smaller_motion_meets_the_conditions(bent):
    change = jnp.array([0.4, 0.1])
    least = np.asarray(bent.pose(change))
    slopes = np.asarray(jax.jacrev(_conditions(bent))(least))
    across = least - np.linalg.pinv(slopes) @ (slopes @ least)
    assert np.linalg.norm(across) < 1e-10 * np.linalg.norm(least)


def _conditions(pilots):
    bound = pilots.net.bind(pilots.rest)
    return lambda x: jnp.concatenate([measure(bound(x)) for measure in pilots.measures])


def test_the_answer_depends_on_what_is_asked_and_not_on_the_way(bent):
    once = np.asarray(bent.pose(jnp.array([0.4, 0.1])))
    bent.pose(jnp.array([-0.9, 0.3]))
    assert np.array_equal(np.asarray(bent.pose(jnp.array([0.4, 0.1]))), once)


@pytest.mark.parametrize("which", ["moved", "bent"])
def test_pilots_keep_the_contract(which, request, body):
    check(request.getfixturevalue(which), np.asarray(body.points)[::17])


def test_the_whole_surface_has_exact_derivatives_by_the_pilots(bent, body):
    binding = bent.bind(body.points)
    for at in (np.zeros(2), np.array([0.4, 0.1])):
        prove(binding, at, np.array([0.05, 0.03]))


def test_pilots_behind_another_stage_hold_what_they_prescribe(bent, body):
    coarse = ml.Lattice.around(body, (3, 2, 2), margin=0.1)
    lift = ml.variable("lift", size=coarse.size)
    own = ml.variable("own", size=2, value=(0.2, 0.05))
    stages = [
        ml.Stage(coarse, {lift: ml.links.controls(coarse)}),
        ml.Stage(bent, {own: ml.links.controls(bent)}),
    ]
    case = ml.Pipeline(body, stages)
    values = {"lift": 0.1 * np.random.default_rng(0).normal(size=coarse.size)}
    moved = jax.jit(lambda v: case.points(v))
    points = np.asarray(moved(values))
    asked = [*(bent.values + own.value), *np.asarray(Volume(body.faces)(body.points))]
    found = [float(np.asarray(measure(points))[0]) for measure in bent.measures]
    assert found == pytest.approx(asked, rel=1e-11)
    prove(lambda v: moved({"lift": v}), values["lift"], 0.05 * np.ones(coarse.size))


def test_duplicates_are_dropped_and_conflicts_named(body, lattice):
    twice = {"one": Position(V(3), "z"), "two": Position(V(3), "z")}
    pilots = Pilots(body.points, lattice, twice)
    assert len(pilots.combinations) == 1
    assert pilots.report(np.array([0.1, 0.1])).unmet == ()
    torn = pilots.report(np.array([0.1, 0.2]))
    assert torn.unmet == ("one", "two")
    assert torn.misses["one"] == pytest.approx([0.05])  # the least squares


def test_weights_say_which_controls_move(body, lattice):
    heavy = np.ones(lattice.size)
    heavy[: lattice.size // 2] = 1e6
    pilots = Pilots(body.points, lattice, {"top": Position(V(2), "z")}, weights=heavy)
    motion = np.abs(np.asarray(pilots.pose(jnp.array([0.1]))))
    assert motion[: lattice.size // 2].max() < 1e-3 * motion.max()


def test_what_no_control_reaches_is_told(body):
    local = ml.Lattice.box((2.0, -1, -1), (4, 1, 1), (3, 2, 2))
    with pytest.raises(ParameterError, match="no control of the hidden deformer reaches 'tail'"):
        Pilots(body.points, local, {"nose": Position(V(0), "z"), "tail": Position(V(3), "z")})
    with pytest.raises(ParameterError, match="give one at least"):
        Pilots(body.points, local, {})
