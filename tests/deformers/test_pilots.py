"""Pilots: what is asked for comes out, with the least motion, and exact derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import moldline as ml
from moldline.deformers.chain import Chain
from moldline.deformers.contract import check, prove
from moldline.deformers.pilots import Pilots
from moldline.errors import ParameterError
from moldline.measures import (
    Constraint,
    Controls,
    Distance,
    Fixed,
    Incidence,
    Position,
    Separation,
    Spot,
    Volume,
)

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
    return Pilots(body, pilots, {"volume": Volume(body.faces)}, lattice)


@pytest.fixture(scope="module")
def moved(body, lattice):
    """Linear: two places, a thickness kept."""
    pilots = {"nose": Position(V(3), "z"), "top": Position(V(2), "xz")}
    return Pilots(body, pilots, {"thick": Separation(V(5), V(2), "z")}, lattice)


def test_linear_conditions_are_met_to_rounding_by_one_product(moved, body):
    change = np.array([0.1, -0.05, 0.2])
    points = np.asarray(moved.bind(body.points)(change))
    rest = np.asarray(body.points)
    assert points[3, 2] - rest[3, 2] == pytest.approx(0.1, abs=1e-14)
    assert points[2, [0, 2]] - rest[2, [0, 2]] == pytest.approx([-0.05, 0.2], abs=1e-14)
    assert points[2, 2] - points[5, 2] == pytest.approx(rest[2, 2] - rest[5, 2], abs=1e-14)
    assert moved.is_linear
    report = moved.report(change)
    assert (report.status, report.iterations) == ("met", 1)


def test_volume_length_and_angle_are_met_together(bent, body):
    change = np.array([0.4, 0.1])
    points = np.asarray(bent.bind(body.points)(change))
    for measure, asked in zip(bent.measures, [*(bent.values + change), None], strict=True):
        asked = np.asarray(measure(body.points)) if asked is None else asked
        assert np.asarray(measure(points)) == pytest.approx(asked, rel=1e-12)
    report = bent.report(change)
    assert report.status == "met" and report.unmet == () and report.iterations > 2
    assert 0.5 < report.curvature < 1
    assert bent.report(np.zeros(2)).iterations == 0


def test_no_smaller_motion_meets_the_conditions(bent):
    change = jnp.array([0.4, 0.1])
    least = np.asarray(bent.pose(change))
    slopes = np.asarray(jax.jacrev(_conditions(bent))(least))
    across = least - np.linalg.pinv(slopes) @ (slopes @ least)
    assert np.linalg.norm(across) < 1e-10 * np.linalg.norm(least)


def test_nor_where_the_conditions_are_known_to_fewer_digits(body, bent):
    """Far from the origin a volume has fewer; steps that only seemed to stand still ended there."""
    far = ml.Surface(np.asarray(body.points) + np.array([100.0, 100.0, 30.0]), body.faces)
    hidden = ml.Lattice.around(far, (5, 3, 3), margin=0.3)
    away = Pilots(far, bent.pilots, bent.constraints, hidden)
    change = np.array([0.6, 0.2])
    assert away.report(change).status == "met"
    near = np.asarray(bent.pose(change))
    np.testing.assert_allclose(away.pose(change), near, atol=1e-10 * np.abs(near).max())


def _conditions(pilots):
    bound = pilots.net.bind(pilots.rest)
    return lambda x: jnp.concatenate([measure(bound(x)) for measure in pilots.measures])


def test_the_answer_depends_on_what_is_asked_and_not_on_the_way(bent):
    once = np.asarray(bent.pose(jnp.array([0.4, 0.1])))
    bent.pose(jnp.array([-0.9, 0.3]))
    assert np.array_equal(np.asarray(bent.pose(jnp.array([0.4, 0.1]))), once)


def test_shorter_steps_come_to_the_same_shape(bent, body, lattice):
    slow = Pilots(body, bent.pilots, bent.constraints, lattice, step=0.8)
    change = np.array([0.2, 0.05])
    np.testing.assert_allclose(slow.pose(change), bent.pose(change), rtol=0, atol=1e-10)
    assert slow.report(change).iterations > bent.report(change).iterations


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
    before, behind = case.steps(values)
    rest = np.asarray(body.points)
    np.testing.assert_allclose(behind.after(rest, before.after(rest, rest)), points, atol=1e-12)
    report = bent.report(np.array(own.value), np.asarray(before.after(rest, rest)))
    assert report.status == "met"


def test_behind_another_stage_they_are_compiled_once(body, monkeypatch):
    calls, plain = [], Volume.of
    monkeypatch.setattr(Volume, "of", lambda self, places: calls.append(1) or plain(self, places))
    before = ml.Lattice.around(body, (3, 2, 2), margin=0.1)
    pilots = Pilots(body, [Position(V(2), "z")], [Volume(body.faces)], before)
    high = ml.variable("high", size=1, value=0.1)
    stages = [ml.Stage(before, {}), ml.Stage(pilots, {high: ml.links.controls(pilots)})]
    case = ml.Pipeline(body, stages)
    case.points()
    traced = len(calls)
    case.points({"high": 0.2})
    assert len(calls) == traced > 0


def test_a_flow_mesh_rides_along(moved, body):
    turn = ml.variable("turn", size=3, value=(0.1, 0.0, 0.2))
    case = ml.Pipeline(body, [ml.Stage(moved, {turn: ml.links.controls(moved)})])
    rider = case.embed(np.asarray(body.points)[5:9])
    assert np.array_equal(np.asarray(rider.points()), np.asarray(case.points())[5:9])


def test_pilots_may_hide_a_chain(body, lattice):
    fine = ml.Lattice.around(body, (4, 3, 3), margin=0.1)
    pilots = Pilots(body, [Position(V(3), "z"), Position(V(2), "z")], hidden=[fine, lattice])
    assert isinstance(pilots.net, Chain)
    change = np.array([0.1, -0.1])
    points, rest = np.asarray(pilots.bind(body.points)(change)), np.asarray(body.points)
    assert points[[3, 2], 2] - rest[[3, 2], 2] == pytest.approx(change, abs=1e-11)
    assert pilots.report(change).status == "met"
    few = rest[::41]
    check(pilots.net, few)
    prove(pilots.bind(few), change, np.array([0.05, 0.02]))


def test_duplicates_are_dropped_and_conflicts_named(body, lattice):
    twice = {"one": Position(V(3), "z"), "two": Position(V(3), "z")}
    pilots = Pilots(body, twice, hidden=lattice)
    agreed = pilots.report(np.array([0.1, 0.1]))
    assert (agreed.status, agreed.unmet, agreed.dependent) == ("met", (), ("two",))
    torn = pilots.report(np.array([0.1, 0.2]))
    assert (torn.status, torn.unmet) == ("least squares", ("one", "two"))
    assert torn.misses["one"] == pytest.approx([0.05])  # the least squares


def test_curved_conditions_that_contradict_are_met_in_least_squares(body, lattice):
    length = Distance(V(0), V(3))
    kept = {"volume": Volume(body.faces), "rest": Constraint(length, 6.0, 6.0, weight=2.0)}
    pilots = Pilots(body, {"length": length}, kept, lattice)
    at = np.array([0.5])
    report = pilots.report(at)
    assert report.unmet == ("length", "rest") and abs(report.misses["volume"]) < 1e-12
    # weights count squared: 1 : 4
    assert report.misses["rest"] == pytest.approx([0.1])
    assert report.misses["length"] == pytest.approx([-0.4])
    prove(pilots.bind(body.points), at, np.array([0.05]))


def test_pilots_in_one_cell_of_too_coarse_a_lattice_are_named(body):
    coarse = ml.Lattice.around(body, (2, 2, 2), margin=0.3)
    spots = {f"p{n}": Position(V(n), "z") for n in (0, 1, 2, 3, 4, 5, 20, 40, 60)}
    report = Pilots(body, spots, hidden=coarse).report(0.1 * np.arange(9.0))
    assert report.status == "least squares" and report.unmet and report.dependent
    fine = Pilots(body, spots)
    assert fine.report(0.1 * np.arange(9.0)).status == "met"
    assert max(fine.net.shape) > 2


def test_pilots_nearer_than_the_control_points_strain_them(body, lattice):
    face = next(face for face in np.asarray(body.faces) if 2 in face)
    beside = Spot.within(face, np.where(face == 2, 0.98, 0.01))
    near = {"a": Position(V(2), "z"), "b": Position(beside, "z")}
    pilots = Pilots(body, near, hidden=lattice)
    together, apart = (pilots.report(np.array(c)) for c in ([0.1, 0.1], [0.1, -0.1]))
    assert together.status == apart.status == "met"
    assert together.strain < 4 < 10 < apart.strain


def test_bounds_hold_and_let_go(body, lattice):
    bounds = {
        "keel": Constraint(Position(V(5), "z"), lower=-0.75, upper=-0.65),
        "wide": Constraint(Distance(V(1), V(4)), lower=1.9),
        "volume": Volume(body.faces),
    }
    pilots = Pilots(body, {"top": Position(V(2), "z")}, bounds, lattice)
    bind = pilots.bind(body.points)
    assert np.array_equal(bind(np.zeros(1)), body.points)
    for change, active in ((0.02, ()), (-0.3, ("keel",)), (0.2, ("wide", "keel"))):
        report = pilots.report(np.array([change]))
        assert (report.status, report.active) == ("met", active)
        keel = np.asarray(bind(np.array([change])))[5, 2]
        assert -0.75 - 1e-12 <= keel <= -0.65 + 1e-12
        prove(bind, np.array([change]), np.array([0.005]))
    pushed = pilots.solver(np.array([0.2]))
    assert np.all(np.asarray(pushed.multipliers)[pilots.conditions.is_bound] >= 0)


def test_a_bound_that_does_not_hold_at_rest_is_met_by_the_nearest_shape(body, lattice):
    tank = Constraint(Separation(V(5), V(2), "z"), lower=1.6)
    pilots = Pilots(body, {"nose": Position(V(3), "z")}, {"tank": tank}, lattice)
    points = np.asarray(pilots.bind(body.points)(np.zeros(1)))
    assert points[2, 2] - points[5, 2] == pytest.approx(1.6, abs=1e-12)


def test_a_bound_that_a_pilot_contradicts_does_not_hold_up_the_others(body, lattice):
    bounds = {
        "roof": Constraint(Position(V(2), "z"), upper=0.8),
        "keel": Constraint(Position(V(5), "z"), lower=-0.69),
    }
    moved = {"top": Position(V(2), "z"), "nose": Position(V(3), "z")}
    report = Pilots(body, moved, bounds, lattice).report(np.array([0.3, -0.1]))
    assert (report.status, report.unmet, report.active) == ("least squares", ("roof",), ("keel",))
    assert report.misses["roof"] == pytest.approx([0.2])


def test_a_value_that_is_not_the_one_at_rest_is_prescribed_by_equal_bounds(body, lattice):
    raised = {"top": Constraint(Position(V(2), "z"), 0.9, 0.9)}
    pilots = Pilots(body, {"nose": Position(V(3), "z")}, raised, lattice)
    points = np.asarray(pilots.bind(body.points)(np.array([0.1])))
    assert points[[2, 3], 2] == pytest.approx([0.9, body.points[3, 2] + 0.1], abs=1e-13)
    assert pilots.report(np.array([0.1])).status == "met"
    prove(pilots.bind(body.points), np.array([0.1]), np.array([0.05]))


@pytest.mark.parametrize("which", ["moved", "bent"])
def test_what_is_no_number_is_not_met(which, request):
    pilots = request.getfixturevalue(which)
    change = np.full(pilots.size, np.nan)
    report = pilots.report(change)
    assert report.status == "not converged" and set(pilots.pilots) <= set(report.unmet)
    assert np.isnan(np.asarray(pilots.pose(change))).all()


def test_bounds_that_contradict_are_told(body, lattice):
    both = {
        "up": Constraint(Position(V(2), "z"), lower=0.9),
        "down": Constraint(Position(V(2), "z"), upper=0.8),
    }
    report = Pilots(body, [Position(V(3), "z")], both, lattice).report(np.array([0.1]))
    assert report.unmet and report.status != "met"


def test_a_measure_may_read_the_hidden_controls(body, lattice):
    still = {"held": Controls([2, 5, 8])}
    pilots = Pilots(body, {"top": Position(V(2), "z")}, still, lattice)
    found = np.asarray(pilots.pose(np.array([0.1])))
    assert found[[2, 5, 8]] == pytest.approx(0, abs=1e-15) and np.abs(found).max() > 0.01


def test_a_fixed_region_stays(body):
    tail = np.flatnonzero(np.asarray(body.points)[:, 0] < -2.8)
    pilots = Pilots(body, [Position(V(0), "xz")], {"tail": Fixed(body.points, tail)})
    moved = np.asarray(pilots.bind(body.points)(np.array([0.1, 0.2])))
    np.testing.assert_allclose(moved[tail], np.asarray(body.points)[tail], rtol=0, atol=1e-12)


def test_weights_say_which_controls_move(body, lattice):
    heavy = np.ones(lattice.size)
    heavy[: lattice.size // 2] = 1e6
    pilots = Pilots(body, {"top": Position(V(2), "z")}, hidden=lattice, weights=heavy)
    motion = np.abs(np.asarray(pilots.pose(jnp.array([0.1]))))
    assert motion[: lattice.size // 2].max() < 1e-3 * motion.max()


@pytest.mark.parametrize("weight", [1e-12, 1e12])
def test_only_ratios_of_weights_matter_to_what_is_met(body, lattice, weight):
    twice = {"one": Position(V(3), "z"), "two": Position(V(3), "z")}
    pilots = Pilots(body, twice, hidden=lattice, weights=weight)
    assert pilots.report(np.array([0.1, 0.1001])).unmet == ("one", "two")
    assert pilots.report(np.array([0.1, 0.1])).status == "met"


def test_the_lattice_that_is_made_is_as_fine_as_the_pilots_are_near(body):
    rest = np.asarray(body.points)
    along = [int(np.abs(rest - [x, 0, 0.7 * np.sqrt(1 - x * x / 9)]).sum(1).argmin())
             for x in np.linspace(-2.4, 2.4, 9)]  # fmt: skip
    few = Pilots(body, [Position(V(n), "z") for n in along[::4]])
    many = Pilots(body, [Position(V(n), "z") for n in along])
    assert few.net.shape[0] < many.net.shape[0]
    airfoil = ml.Section(rest[np.abs(rest[:, 2]) < 1e-9])
    flat = Pilots(airfoil, [Position(V(1), "y")])
    assert flat.net.shape[2] == 1


def test_pilots_of_the_whole_shape_have_no_places_to_show(body, moved):
    assert moved.marks(body.points).shape == (2, 3)
    assert Pilots(body, [Volume(body.faces)]).marks(body.points).shape == (0, 3)


def test_what_no_control_reaches_is_told(body):
    local = ml.Lattice.box((2.0, -1, -1), (4, 1, 1), (3, 2, 2))
    with pytest.raises(ParameterError, match="no control of the hidden deformer reaches 'tail'"):
        Pilots(body, {"nose": Position(V(0), "z"), "tail": Position(V(3), "z")}, hidden=local)
    with pytest.raises(ParameterError, match="give one at least"):
        Pilots(body, {})
    with pytest.raises(ParameterError, match="both named 'a'"):
        Pilots(body, {"a": V(0)}, {"a": Volume(body.faces)})
    with pytest.raises(ParameterError, match="up to 1, got 2"):
        Pilots(body, {"a": V(0)}, step=2.0)
    with pytest.raises(ParameterError, match="must be above zero"):
        Pilots(body, {"a": V(0)}, hidden=local, weights=0.0)
    with pytest.raises(ParameterError, match=r"pilots measure 3 numbers, got shape \(2,\)"):
        Pilots(body, {"a": V(0)}).pose(np.zeros(2))
    for low, high in ((1.0, -1.0), (np.inf, np.inf), (np.nan, 1.0)):
        with pytest.raises(ParameterError, match="leave no choice"):
            Constraint(Volume(body.faces), low, high)
    with pytest.raises(ParameterError, match="margin is above zero"):
        Pilots(body, {"a": V(0)}, margin=-1.0)
