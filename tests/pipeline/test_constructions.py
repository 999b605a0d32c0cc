"""Stages that make geometries: chains behind modelers, unions in the middle, the chain rule."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Float
from typing_extensions import override

import moldline as ml
from moldline import links
from moldline._types import Points, Vector
from moldline.errors import GeometryError, ParameterError
from moldline.mesh import topology
from moldline.modelers.base import AbstractShape
from moldline.numerics.taylor import remainder
from moldline.pipeline import examine
from moldline.pipeline.making import made
from moldline.pipeline.overview import overview


class Block(AbstractShape):
    """A box of 8 points: a modeler as somebody else would write it."""

    low: Float[np.ndarray, "3"]
    sides: Float[np.ndarray, "3"]

    @property
    @override
    def parameters(self):
        return {"sides": np.arange(3), "place": np.arange(3, 6)}

    @property
    @override
    def values(self) -> Vector:
        return np.concatenate([self.sides, self.low])

    @override
    def __call__(self, parameters: Vector) -> Points:
        corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T
        return parameters[3:] + corners * parameters[:3]

    @property
    @override
    def geometry(self) -> ml.Surface:
        quads = np.array(
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        )
        faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        return ml.Surface(np.asarray(self(jnp.asarray(self.values))), faces)


def block(low, sides):
    return Block(np.array(low, float), np.array(sides, float))


BODY, WING = block([0, 0, 0], [4, 1, 1]), block([1.1, 0.4, 0.3], [1, 3, 0.2])
LENGTH = ml.variable("length", value=4.0, bounds=(3, 6), unit="m", typical=0.1)
PLACE = ml.variable("place", size=3, typical=0.01)
BEND = ml.variable("bend", size=3, typical=0.01)
BULGE = ml.variable("bulge", size=2, typical=0.01)


def joined(**options):
    """A body and a wing, each deformed, their union, and that deformed again."""
    span = ml.Lattice.box((0.5, 0.0, -1), (3, 4, 2), (1, 3, 1))
    room = ml.Lattice.box((-1, -1, -1), (6, 5, 2), (2, 1, 1))
    length = links.named(BODY, "sides", [0], absolute=True)
    stages = [
        ml.Construction(BODY, {LENGTH: length}, to="body"),
        ml.Construction(WING, {PLACE: links.named(WING, "place")}, to="wing"),
        ml.Stage(span, {BEND: links.each(span, "z")}, on="wing", name="bend"),
        ml.Construction(ml.Union(**options), of=["body", "wing"], to="all", name="union"),
        ml.Stage(room, {BULGE: links.each(room, "x")}, on="all", name="bulge"),
    ]
    return ml.Pipeline({}, stages)


@pytest.fixture(scope="module")
def case():
    return joined()


VALUES = {
    "length": [4.02],
    "place": [0.01, -0.02, 0.005],
    "bend": [0.0, 0.02, 0.05],
    "bulge": [0.1, -0.05],
}
ALONG = {
    "length": jnp.array([0.1]),
    "place": jnp.array([0.02, 0.01, -0.01]),
    "bend": jnp.array([0.01, 0.02, -0.02]),
    "bulge": jnp.array([0.03, 0.05]),
}


def volume(geometry):
    return ml.measures.Volume(geometry.faces)


def test_a_modeler_gives_what_its_variables_say():
    case = ml.Pipeline({}, [ml.Construction(BODY, {LENGTH: links.named(BODY, "sides", [0], True)})])
    assert np.ptp(case({"length": 5.5}).points[:, 0]) == 5.5
    assert np.array_equal(case().points, BODY.geometry.points)
    assert case.sensitivity(None, "length").shape == (8, 3, 1)
    np.testing.assert_array_equal(case.pullback(None, np.ones((8, 3)))["length"], [4.0])


def test_the_geometry_at_rest_is_that_of_the_variables_own_values():
    long = ml.variable("length", value=5.0)
    case = ml.Pipeline({}, [ml.Construction(BODY, {long: links.named(BODY, "sides", [0], True)})])
    assert np.ptp(case.geometry.points[:, 0]) == 5.0


COARSE = {"chordwise": 9, "spanwise": 4}


@pytest.mark.parametrize(
    ("modeler", "parameter", "value", "message"),
    [
        (ml.Wing([3.0, 5.0], 1.0, **COARSE), "sweep", 30.0, "'wing': sweep .*were they degrees"),
        (ml.Wing([3.0, 5.0], 1.0, **COARSE), "span", [5.0, 3.0], "ascending and above 0"),
        (ml.Wing(5.0, 1.0, **COARSE), "thickness", -0.1, "thickness must be above 0"),
        (ml.TrapezoidalWing(5.0, 4.0, **COARSE), "taper", -0.5, "taper must be above 0"),
        (ml.TrapezoidalWing(5.0, 4.0, **COARSE), "dihedral", 5.0, "were they degrees"),
        (ml.Body([1.0, 2.0], [0.0, 1.0, 0.5]), "radius", [1.0, -0.5], "radius must be above 0"),
        (ml.Body([1.0, 2.0], [0.0, 1.0, 0.5]), "exponent", 0.5, "exponent must be 1 or more"),
        (ml.Nacelle(3.0, 1.0, around=8, chordwise=9), "droop", 3.0, "droop .*was it degrees"),
    ],
)
def test_values_that_a_modeler_would_refuse_are_refused_of_variables(
    modeler, parameter, value, message
):
    own = ml.variable("own", value=value)
    link = links.named(modeler, parameter, absolute=True)
    with pytest.raises(ParameterError, match=message):
        ml.Pipeline({}, [ml.Construction(modeler, {own: link})])


def test_two_variables_cannot_both_be_what_a_parameter_measures():
    one, other = ml.variable("one", value=4.0), ml.variable("other", value=4.0)
    absolute = links.named(BODY, "sides", [0], absolute=True)
    change = links.named(BODY, "sides", [0])
    with pytest.raises(ParameterError, match="of 'one', 'other' more than one is what the same"):
        ml.Construction(BODY, {one: absolute, other: absolute})
    ml.Construction(BODY, {one: absolute, other: links.named(BODY, "sides", [1], absolute=True)})
    case = ml.Pipeline({}, [ml.Construction(BODY, {one: absolute, other: change})])
    assert np.ptp(case({"one": 5.0, "other": 0.5}).points[:, 0]) == 5.5


def test_a_deformer_follows_what_a_modeler_moves():
    box = ml.Lattice.box((-1, -1, -1), (7, 2, 2), (4, 2, 2))
    t = ml.variable("t", size=4)
    length = links.named(BODY, "sides", [0], absolute=True)
    stage = ml.Stage(box, {t: links.thickness(box, "x", "z")})
    case = ml.Pipeline({}, [ml.Construction(BODY, {LENGTH: length}), stage])
    values = {"length": 5.0, "t": [0.1, 0.2, -0.1, 0.3]}
    rest = block([0, 0, 0], [5, 1, 1]).geometry.points
    expected = box(rest, stage.controls(case.values(values)))
    np.testing.assert_allclose(case(values).points, expected, atol=1e-14)
    proof = remainder(case.points, case.values(values), {"length": jnp.ones(1), "t": jnp.ones(4)})
    assert proof.order == pytest.approx(2.0, abs=0.05)


def test_a_carried_stage_is_carried_from_where_the_modeler_begins():
    parent = ml.Lattice.box((-1, -1, -1), (7, 2, 2), (2, 1, 1))
    child = ml.Lattice.box((-1, -1, -1), (7, 2, 2), (1, 2, 1))
    a, b = ml.variable("a", size=2), ml.variable("b", size=2)
    case = ml.Pipeline(
        {},
        [
            ml.Construction(BODY, {LENGTH: links.named(BODY, "sides", [0], absolute=True)}),
            ml.Stage(parent, {a: links.each(parent, "y")}),
            ml.Stage(child, {b: links.each(child, "z")}, carried=True),
        ],
    )
    values = {"length": 5.0, "a": [0.3, 0.9], "b": [0.5, -0.2]}
    rest = block([0, 0, 0], [5, 1, 1]).geometry.points
    one, other = (
        stage.deformer(rest, stage.controls(case.values(values))) - rest
        for stage in case.own_stages
    )
    np.testing.assert_allclose(case(values).points, rest + one + other, atol=1e-14)


def test_a_stage_that_refuses_points_refuses_those_of_a_modeler_too():
    around = block([-0.5, -0.5, -0.5], [5, 2, 2]).geometry
    cage = ml.Cage.of(around, cells=8)
    lift = ml.variable("lift")
    stage = ml.Stage(cage, {lift: links.group(cage, "z", index=[[1]])})
    long = ml.variable("length", value=6.0)
    for variable, fits in ((LENGTH, True), (long, False)):
        own = links.named(BODY, "sides", [0], absolute=True)
        stages = [ml.Construction(BODY, {variable: own}), stage]
        if fits:
            ml.Pipeline({}, stages)
            continue
        with pytest.raises(GeometryError, match="stage 'cage' on 'geometry': 4 of 8 points"):
            ml.Pipeline({}, stages)


def test_a_union_in_the_middle_has_the_exact_volume(case):
    found = case({"bend": np.zeros(3), "bulge": np.zeros(2)})
    assert topology.is_closed(found.faces)
    assert found.components == ("body", "wing")
    # the wing's part outside the body is 1 x 2.4 x 0.2
    assert float(volume(found)(found.points)[0]) == pytest.approx(4 + 0.48, rel=1e-12)


def test_derivatives_are_exact_through_modelers_union_and_stages(case):
    here = case.at(VALUES)
    at = case.values(VALUES)
    assert all(here.holds({k: at[k] + h * v for k, v in ALONG.items()}) for h in (1, 0.5, 0.25))
    proof = remainder(here.points, case.values(VALUES), ALONG)
    assert not proof.is_linear and proof.order == pytest.approx(2.0, abs=0.05)


def test_forward_reverse_and_whole_sensitivity_agree(case):
    here = case.at(VALUES)
    weights = np.random.default_rng(0).normal(size=here.geometry.points.shape)
    pushed, pulled = case.pushforward(VALUES, ALONG), case.pullback(VALUES, weights)
    assert np.vdot(weights, pushed) == pytest.approx(
        sum(np.vdot(pulled[name], ALONG[name]) for name in ALONG), rel=1e-12
    )
    whole = sum(case.sensitivity(VALUES, name) @ np.asarray(ALONG[name]) for name in ALONG)
    np.testing.assert_allclose(whole, pushed, atol=1e-14)
    inside = jax.grad(lambda v: jnp.vdot(weights, here.points(v)))(case.values(VALUES))
    for name in ALONG:
        np.testing.assert_allclose(inside[name], pulled[name], rtol=1e-11)


def test_measures_are_remade_with_their_union_and_agree_with_differences(case):
    measured = ml.Measurements(case, {"volume": volume})
    moved = {**VALUES, "place": [0.5, 0.3, 0.2]}
    assert case.at(moved) is case.at(moved)
    for values in (VALUES, moved):
        slopes = measured.jacobian(values)["volume"]
        for name, along in ALONG.items():
            there, back = (
                measured({**values, name: np.asarray(values[name]) + h * along})["volume"]
                for h in (1e-5, -1e-5)
            )
            difference = (there - back) / 2e-5
            np.testing.assert_allclose(slopes[name] @ along, difference, rtol=1e-7, atol=1e-9)


def test_measures_of_the_old_union_are_refused_for_the_new_one(case):
    measured = ml.Measurements(case, {"volume": volume(case.geometry)})
    through = {"place": [0.0, -2.0, 0.0]}  # the wing sticks out on both sides
    assert case.at(through) is not case
    with pytest.raises(ParameterError, match="'volume' was made for a surface that is made anew"):
        measured(through)


def test_a_union_that_no_longer_holds_is_made_anew_and_said_so(caplog):
    case = joined()
    through = {"place": [0.0, -2.0, 0.0], "bend": np.zeros(3), "bulge": np.zeros(2)}
    with caplog.at_level("INFO", "moldline.pipeline"):
        anew = case(through)
    assert "'all' is made anew" in caplog.text
    assert len(anew.points) != len(case.geometry.points)
    assert float(volume(anew)(anew.points)[0]) == pytest.approx(4 + 0.4, rel=1e-12)
    told = made(case, through)
    assert told.anew == ("all",) and "made anew" in told.sentences()[1]
    with pytest.raises(ParameterError, match="the cotangent must have the shape"):
        case.pullback(through, case.geometry.points)


FIN = block([2.5, 0.3, 0.5], [0.5, 0.4, 2.0])


@pytest.mark.parametrize("place", [[0.5, 0.3, 0.2], [0.0, -2.0, 0.0]])
@pytest.mark.parametrize(
    ("of", "modeler"), [(["pair"], ml.Subdivision(1)), (["pair", "fin"], ml.Union())]
)
def test_what_is_made_of_a_union_made_anew_is_made_anew_too(of, modeler, place):
    case = ml.Pipeline(
        {},
        [
            ml.Construction(BODY, to="body"),
            ml.Construction(WING, {PLACE: links.named(WING, "place")}, to="wing"),
            ml.Construction(FIN, to="fin"),
            ml.Construction(ml.Union(), of=["body", "wing"], to="pair"),
            ml.Construction(modeler, of=of, to="all"),
        ],
    )
    values = {"place": place}
    pair = case.of("pair")(values)
    assert not np.array_equal(pair.faces, case.geometries["pair"].faces)
    parts = [pair, *(case.geometries[name] for name in of[1:])]
    expected, found = modeler.bind(*parts).geometry, case(values)
    np.testing.assert_array_equal(found.faces, expected.faces)
    np.testing.assert_allclose(found.points, expected.points, atol=1e-14)


def test_pilots_on_a_union_are_refused_where_it_is_made_anew():
    stages = [
        ml.Construction(BODY, to="body"),
        ml.Construction(WING, {PLACE: links.named(WING, "place")}, to="wing"),
        ml.Construction(ml.Union(), of=["body", "wing"], to="all"),
    ]
    tip = ml.Spot.nearest(ml.Pipeline({}, stages).geometry, [2.1, 3.4, 0.5])
    pilots = ml.Pilots(ml.Pipeline({}, stages).geometry, {"tip": tip})
    lift = ml.variable("lift", size=3)
    case = ml.Pipeline(
        {}, [*stages, ml.Stage(pilots, {lift: links.named(pilots, "tip")}, on="all", name="tip")]
    )
    held = case({"place": [0.01, 0.0, 0.0], "lift": [0.0, 0.0, 0.1]})
    place = ml.measures.Position(tip)(held.points)
    np.testing.assert_allclose(place, [2.1, 3.4, 0.6], atol=1e-9)
    with pytest.raises(GeometryError, match="'tip' holds points of 'all' by their numbers"):
        case({"place": [0.0, -2.0, 0.0]})


def test_a_union_that_no_longer_holds_is_an_error_where_values_are_traced(case):
    apart = {"place": jnp.array([0.0, -4.0, 0.0])}
    with pytest.raises(Exception, match="no longer cross where they did"):
        jax.jit(lambda v: case.points(v))(apart).block_until_ready()


def test_folds_tears_and_proof_look_at_all_that_a_union_is_made_from(case):
    assert examine.proof(case, VALUES).is_right
    assert not examine.folding(case, VALUES).folds
    flip = {"place": np.zeros(3), "bulge": [8.0, 0.0]}
    assert examine.folding(case, flip).folds
    assert len(examine.turned_faces(case, flip)) > 0
    assert examine.tears(case, VALUES) == []


def test_the_overview_names_what_is_made_of_what(case):
    told = overview(case)
    assert [row.geometry for row in told.rows] == ["body", "wing", "all"]
    assert told.rows[2].of == ("body", "wing") and told.result == "all"
    assert told.rows[1].steps[1].variables == ("bend[3]",)
    text = "\n".join(told.sentences())
    for part in ("union of body, wing", "-> bend", "1 x 3 x 1 control points", "3 to 6 [m]"):
        assert part in text


def test_subdivision_takes_what_a_modeler_moves():
    smooth = ml.Construction(ml.Subdivision(2), of=["body"], to="smooth")
    length = links.named(BODY, "sides", [0], absolute=True)
    case = ml.Pipeline({}, [ml.Construction(BODY, {LENGTH: length}, to="body"), smooth])
    assert len(case.geometry.faces) == 16 * 12
    proof = remainder(case.points, case.values(), {"length": jnp.array([1.0])})
    assert proof.is_linear and proof.is_right
    weights = np.ones_like(case.geometry.points)
    pushed = case.pushforward(None, {"length": 1.0})
    pulled = case.pullback(None, weights)["length"][0]
    assert pulled == pytest.approx(float(np.sum(pushed)), rel=1e-12)


def test_points_ride_on_a_made_geometry_that_nothing_moves():
    box = ml.Lattice.box((-1, -1, -1), (5, 2, 2), (2, 2, 2))
    t = ml.variable("t")
    move = ml.Stage(box, {t: links.group(box, "z")}, on="body")
    case = ml.Pipeline({}, [ml.Construction(BODY, to="body"), move])
    rider = case.embed(np.array([[1.0, 0.5, 0.5]]))
    np.testing.assert_allclose(rider({"t": 0.5}).points, [[1.0, 0.5, 1.0]], atol=1e-14)


def stage(on):
    box = ml.Lattice.box((-1, -1, -1), (5, 2, 2), (2, 2, 2))
    return ml.Stage(box, {ml.variable("t"): links.group(box, "z")}, on=on)


BOTH = [ml.Construction(BODY, to="body"), ml.Construction(WING, to="wing")]


@pytest.mark.parametrize(
    ("stages", "message"),
    [
        ([], "a pipeline needs a geometry, or a stage that makes one"),
        ([*BOTH, ml.Construction(WING, to="body")], "to = 'body' is another geometry's name"),
        (
            [*BOTH, ml.Construction(ml.Union(), of=["body", "tail"], to="all")],
            "nothing named 'tail'; there is: body, wing",
        ),
        (
            [*BOTH, ml.Construction(ml.Union(), of=["body", "wing"], to="all"), stage("wing")],
            "deforms 'wing' after stage 'union' has taken it: put it before that one",
        ),
        ([*BOTH, stage("")], "must say on which geometry it acts: body, wing"),
    ],
)
def test_stages_that_do_not_fit_are_told(stages, message):
    with pytest.raises(ParameterError, match=message):
        ml.Pipeline({}, stages)


def test_wrong_numbers_of_geometries_and_riders_are_told(case):
    with pytest.raises(ParameterError, match="'union' takes 2 or more geometries, got 1"):
        ml.Construction(ml.Union(), of=["body"], to="all")
    with pytest.raises(ParameterError, match="'block' takes 0 geometries, got 1"):
        ml.Construction(BODY, of=["wing"])
    with pytest.raises(ParameterError, match="takes a geometry twice"):
        ml.Construction(ml.Union(), of=["body", "body"], to="all")
    with pytest.raises(ParameterError, match="'wing/embedded' cannot ride on 'wing'"):
        case.embed(np.zeros((1, 3)), on="wing")
    far = block([9, 9, 9], [1, 1, 1])
    parts = [ml.Construction(BODY, to="body"), ml.Construction(far, to="far")]
    with pytest.raises(GeometryError, match=r"stage 'union': .*crosses no other"):
        ml.Pipeline({}, [*parts, ml.Construction(ml.Union(), of=["body", "far"], to="all")])
