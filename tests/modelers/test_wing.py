"""Wings lofted through sections: closed, true to their planform, differentiable in every number."""

from pathlib import Path

import jax
import numpy as np
import pytest

from moldline.case.options import model_of
from moldline.errors import GeometryError, ParameterError
from moldline.mesh import quality, topology
from moldline.mesh.health import health
from moldline.mesh.planform import planform
from moldline.modelers.airfoils import airfoil
from moldline.modelers.base import shaped
from moldline.modelers.trapezoidal_wing import TrapezoidalWing
from moldline.modelers.wing import Wing
from moldline.numerics.taylor import remainder

SMALL = {"chordwise": 17, "spanwise": 12}
SWEPT = {
    "span": [4.0, 7.0, 10.0],
    "chord": [3.0, 2.0, 1.5, 1.0],
    "sweep": [0.4, 0.5, 0.3],
    "dihedral": [0.1, 0.05, 0.2],
    "twist": [0.03, 0.0, 0.01, -0.05],
    "thickness": [0.14, 0.12, 0.11, 0.1],
}
BLUNT = {"airfoil": "naca 2412", "trailing_edge": "blunt"}


def area(thickness, blunt=False):
    """Enclosed by a four-digit section of unit chord."""
    last = 0.1015 if blunt else 0.1036
    return 10 * thickness * (0.2969 * 2 / 3 - 0.1260 / 2 - 0.3516 / 3 + 0.2843 / 4 - last / 5)


@pytest.mark.parametrize(
    ("tip", "loft"), [("round", "cubic"), ("flat", "bspline"), ("closed", "linear")]
)
@pytest.mark.parametrize(
    ("foil", "base_points"), [("naca 2412", 0), (BLUNT, 0), (BLUNT, 2)], ids=["sharp", "blunt", "2"]
)
def test_a_wing_is_sound(tip, loft, foil, base_points):
    wing = Wing(**SWEPT, loft=loft, tip=tip, airfoil=foil, base_points=base_points, **SMALL)
    found = health(wing.geometry)
    assert not found.sentences()
    assert found.pieces == 1
    assert found.volume > 0


@pytest.mark.parametrize("seed", range(6))
def test_wings_of_any_shape_are_sound(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 5))
    wing = Wing(
        np.cumsum(rng.uniform(1, 4, count - 1)).tolist(),
        rng.uniform(0.5, 3, count).tolist(),
        sweep=rng.uniform(-0.6, 0.8, count - 1).tolist(),
        dihedral=rng.uniform(-0.3, 0.5, count - 1).tolist(),
        twist=rng.uniform(-0.15, 0.15, count).tolist(),
        thickness=rng.uniform(0.06, 0.2, count).tolist(),
        camber=float(rng.uniform(0, 1.5)),
        airfoil="naca 4412",
        tip=("round", "flat", "closed")[seed % 3],
        chordwise=33,
        spanwise=24,
    )
    assert not health(wing.geometry).sentences()


def test_connectivity_is_the_same_for_other_parameters_and_the_shape_stays_sound():
    wing = Wing(**SWEPT, **SMALL)
    other = wing.values.copy()
    for name, change in {"span": 1.0, "chord": 0.3, "sweep": -0.2, "twist": 0.1}.items():
        other[wing.parameters[name]] += change
    moved = wing.geometry.moved(np.asarray(wing.bind()(other)))
    assert not health(moved).sentences()
    np.testing.assert_array_equal(moved.faces, wing.geometry.faces)


@pytest.mark.parametrize("blunt", [False, True])
def test_volume_is_the_integral_of_section_areas(blunt):
    """Similar sections make flat cells, so the loft adds no error of its own."""
    foil = {"airfoil": "naca 0012", "trailing_edge": "blunt" if blunt else "sharp"}
    wing = Wing(6.0, [2.0, 1.0], sweep=0.5, dihedral=0.1, airfoil=foil, tip="flat", chordwise=401)
    exact = area(0.12, blunt) * 6.0 * (2.0**2 + 2.0 * 1.0 + 1.0) / 3
    np.testing.assert_allclose(quality.signed_volume(wing.geometry), exact, rtol=1e-5)


def test_a_round_tip_is_half_a_body_of_revolution():
    options = {"chordwise": 201, "spanwise": 4}
    flat, rounded = (Wing(2.0, 1.0, tip=tip, **options).geometry for tip in ("flat", "round"))
    x = (1 - np.cos(np.linspace(0, np.pi, 4001))) / 2
    half = 0.6 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    added = quality.signed_volume(rounded) - quality.signed_volume(flat)
    np.testing.assert_allclose(added, np.pi / 2 * np.trapezoid(half**2, x), rtol=0.01)
    np.testing.assert_allclose(np.asarray(rounded.points)[:, 1].max(), 2.06, atol=1e-4)


def test_a_round_tip_is_tangent_to_both_sides():
    """What the triangles turn by at the tip's row halves with their size."""
    turns = []
    for fine in (33, 65):
        wing = Wing(**SWEPT, airfoil="naca 2412", chordwise=fine, spanwise=fine)
        surface = wing.geometry
        near = topology.neighbours(surface.faces)
        tags = np.asarray(surface.tags)
        crosses = np.sort(np.stack([tags[near.one], tags[near.other]]), axis=0)
        crosses = np.all(crosses == [[0], [1]], axis=0)
        a, b, c = (np.asarray(surface.points)[np.asarray(surface.faces)[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        cosine = np.sum(normals[near.one] * normals[near.other], axis=1)[crosses]
        turns.append(np.median(np.arccos(cosine)))
    np.testing.assert_allclose(turns[0] / turns[1], 2.0, atol=0.2)


def test_a_closed_tip_thins_like_an_ellipse():
    wing = Wing(3.0, 1.0, tip="closed", chordwise=201, spanwise=200)
    exact = area(0.12) * 3.0 * np.pi / 4
    np.testing.assert_allclose(quality.signed_volume(wing.geometry), exact, rtol=2e-4)


@pytest.mark.parametrize(
    ("loft", "tip", "at"),
    [
        ("linear", "round", (0.0, 0.25)),
        ("linear", "flat", (0.25, 0.25)),
        ("cubic", "round", (0.6, 0.0)),
        ("cubic", "flat", (0.0, 0.25)),
    ],
)
def test_the_planform_reads_back_what_was_asked_for(loft, tip, at):
    wing = Wing(**SWEPT, loft=loft, tip=tip, sweep_at=at[0], twist_at=at[1], **SMALL)
    plan = planform(wing.geometry, [0.0, *SWEPT["span"]], "wing")
    for found, name in (
        (plan.chord, "chord"),
        (plan.twist, "twist"),
        (plan.sweep_at(at[0]), "sweep"),
        (plan.dihedral_at(at[1]), "dihedral"),
    ):
        np.testing.assert_allclose(found, SWEPT[name], rtol=0, atol=1e-12)


def test_the_thickness_is_that_of_the_section():
    wing = Wing(5.0, [2.0, 1.0], thickness=[0.15, 0.1], airfoil="naca 0012", chordwise=801)
    plan = planform(wing.geometry, [0.0, 5.0], "wing")
    np.testing.assert_allclose((plan.high - plan.low) / plan.chord, [0.15, 0.1], atol=1e-6)


def test_a_camber_of_nothing_makes_the_section_symmetric():
    wing = Wing(5.0, 1.0, airfoil="naca 4412", camber=0.0, **SMALL)
    upper, lower = np.asarray(wing._outlines(wing.quantities.parted(wing.values)))[0]
    np.testing.assert_allclose(upper[:, 1], -lower[:, 1], atol=1e-15)


@pytest.mark.parametrize("tip", ["round", "flat", "closed"])
def test_derivatives_by_every_parameter_are_finite_and_right(tip):
    wing = Wing(
        **SWEPT, airfoil="naca 2412", section_parameters=["camber", "thickness"], tip=tip, **SMALL
    )
    jacobian = np.asarray(jax.jacfwd(lambda p: shaped(wing, p))(wing.values))
    assert np.isfinite(jacobian).all()
    assert np.abs(jacobian).max(axis=(0, 1)).min() > 0.01
    rng = np.random.default_rng(0)
    for name, rows in wing.parameters.items():
        along = np.zeros(wing.size)
        along[rows] = 0.05 * rng.normal(size=len(rows))
        assert remainder(lambda p: shaped(wing, p), wing.values, along).is_right, name


def test_rows_stand_at_every_station():
    wing = Wing(**SWEPT, **SMALL)
    y = np.asarray(wing.geometry.points)[:, 1]
    for station in (0.0, *SWEPT["span"]):
        assert np.sum(y == station) >= 32


def test_one_number_is_one_parameter_and_a_list_has_one_each():
    few = Wing(10.0, 1.0, sweep=0.4)
    assert {k: len(v) for k, v in few.parameters.items()} == {
        "span": 1, "chord": 1, "sweep": 1, "dihedral": 1, "twist": 1, "thickness": 1, "camber": 1,
        "origin": 3,
    }  # fmt: skip
    foils = [{"airfoil": "naca4", "thickness": t} for t in (0.14, 0.12, 0.11, 0.1)]
    many = Wing(**{**SWEPT, "thickness": None}, airfoil=foils, section_parameters=True, **SMALL)
    assert len(many.parameters["thickness"]) == 4
    # the coefficient that closes the trailing edge makes the section 0.012 % thicker
    np.testing.assert_allclose(
        many.values[many.parameters["thickness"]], [0.14, 0.12, 0.11, 0.1], rtol=2e-4
    )
    assert many.parameters["section 2 camber"].shape == (1,)
    assert many.size == len(many.values) == 3 + 4 + 3 + 3 + 4 + 4 + 1 + 3 + 12


def test_one_span_spreads_the_stations_evenly():
    wing = Wing(9.0, [3.0, 2.0, 1.5, 1.0], **SMALL)
    plan = planform(wing.geometry, [0.0, 3.0, 6.0, 9.0], "wing")
    np.testing.assert_allclose(plan.chord, [3.0, 2.0, 1.5, 1.0], atol=1e-12)


def test_a_whole_wing_is_symmetric_to_the_bit_and_closed():
    wing = Wing(**SWEPT, airfoil="naca 2412", sides=2, **SMALL)
    surface = wing.geometry
    assert not health(surface).sentences()
    assert "wing root" not in surface.components
    points = np.asarray(surface.points)
    one, other = (np.unique(points * [1, side, 1] + 0.0, axis=0) for side in (1, -1))
    np.testing.assert_array_equal(one, other)
    half = Wing(**SWEPT, airfoil="naca 2412", **SMALL).geometry
    np.testing.assert_allclose(
        quality.signed_volume(surface), 2 * quality.signed_volume(half), rtol=1e-12
    )


def test_an_open_root_lies_in_its_plane_to_the_bit_whatever_the_parameters():
    wing = Wing(**SWEPT, airfoil="naca 2412", root="open", **SMALL)
    found = health(wing.geometry)
    assert len(found.holes) == 1
    moved = np.asarray(wing.bind()(wing.values * 1.1))
    assert np.all(moved[found.holes[0], 1] == 0.0)


@pytest.mark.parametrize(
    ("along", "tip"), [("z", [0, 0, 1]), ("-z", [0, 0, -1]), ("-y", [0, -1, 0])]
)
def test_a_pylon_is_a_wing_along_another_axis(along, tip):
    plain, turned = (
        Wing(2.0, [2.0, 1.0], sweep=0.5, airfoil="naca 2412", along=way, **SMALL).geometry
        for way in ("y", along)
    )
    assert not health(turned).sentences()
    np.testing.assert_allclose(quality.signed_volume(turned), quality.signed_volume(plain))
    farthest = np.argmax(np.asarray(plain.points)[:, 1])
    assert (np.asarray(turned.points) @ tip)[farthest] == np.asarray(plain.points)[farthest, 1]
    np.testing.assert_array_equal(np.asarray(turned.points)[:, 0], np.asarray(plain.points)[:, 0])


def test_the_origin_is_where_the_root_s_leading_edge_is_whichever_way_a_wing_stands():
    for along in ("y", "-y", "z", "-z"):
        plain, placed = (
            Wing(2.0, [2.0, 1.0], along=along, origin=place, **SMALL).geometry.points
            for place in ((0.0, 0.0, 0.0), (5.0, 2.0, -1.0))
        )
        np.testing.assert_allclose(placed - plain, np.tile([5.0, 2.0, -1.0], (len(plain), 1)))
        assert np.any(np.all(placed == [5.0, 2.0, -1.0], axis=1))


def test_caps_have_well_shaped_triangles():
    wing = Wing(**SWEPT, chordwise=65, spanwise=64).geometry
    angles = np.degrees(quality.smallest_angles(wing))
    for name, least in (("wing tip", 25.0), ("wing root", 10.0)):
        own = angles[wing.tags == wing.components.index(name)]
        assert np.percentile(own, 2) > least
        assert np.median(own) > 40
    assert angles.min() > 1.0  # no slivers anywhere


def test_a_trapezium_has_only_its_own_parameters():
    wing = TrapezoidalWing(
        10.0, 20.0, taper=0.4, sweep=25, dihedral=5, twist=-3, degrees=True, **SMALL
    )
    assert list(wing.parameters) == ["span", "area", "taper", "sweep", "dihedral", "twist"]
    plan = planform(wing.geometry, [0.0, 10.0], "wing")
    np.testing.assert_allclose(10.0 * plan.chord.sum() / 2, 20.0, rtol=1e-12)
    np.testing.assert_allclose(plan.chord[1] / plan.chord[0], 0.4, rtol=1e-12)
    np.testing.assert_allclose(np.degrees([plan.sweep[0], plan.dihedral[0]]), [25, 5], rtol=1e-12)
    np.testing.assert_allclose(np.degrees(plan.twist), [0, -3], atol=1e-12)
    rng = np.random.default_rng(0)
    for row in range(wing.size):
        along = 0.1 * rng.normal() * np.eye(wing.size)[row] * wing.values
        assert remainder(lambda p: shaped(wing, p), wing.values, along).is_right
    by_chord = TrapezoidalWing(10.0, chord=float(plan.chord[0]), taper=0.4, **SMALL)
    assert list(by_chord.parameters)[1] == "chord"


def test_a_case_file_can_say_all_of_it():
    said = {"span": [4, 10], "chord": [3, 2, 1.0], "sweep": 25, "degrees": True, "tip": "flat"}
    said |= {"airfoil": ["naca 2412", {"airfoil": "naca4", "thickness": 0.1}, "naca 0010"]}
    said |= {"section_parameters": ["thickness"], "origin": [1, 0, 0.5], "spacing": "cosine"}
    model_of("wing", Wing.options()).model_validate(said)
    wing = Wing.build(Path(), **said)
    np.testing.assert_allclose(wing.values[wing.parameters["sweep"]], np.radians(25))
    assert "section 2 thickness" in wing.parameters
    short = {"span": 4, "area": 6.0, "taper": 0.5, "airfoil": "naca 2412", "chordwise": 17}
    model_of("trapezoidal_wing", TrapezoidalWing.options()).model_validate(short)
    assert TrapezoidalWing.build(Path(), **short).size == 6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"span": [4.0, 3.0]}, "distances of stations from the first one, ascending"),
        ({"chord": [1.0, -2.0, 1.0]}, r"chord must be above 0 \[m\], got \[1.0, -2.0, 1.0\]"),
        ({"twist": [0.0, 0.1]}, "chord for 3, twist for 2, span for 3"),
        ({"sweep": 25.0}, "sweep must lie within 80 degrees.*were they degrees"),
        ({"thickness": 0.0}, "thickness must be above 0"),
        ({"spanwise": 1}, "3 stations need at least 2 intervals"),
        ({"clustering": 2.0}, "clustering lies from 0"),
        ({"base_points": 2}, "0 where the trailing edge is sharp"),
        ({"sides": 2, "origin": [0.0, 1.0, 0.0]}, "a wing with two sides begins at y = 0"),
        ({"sides": 2, "along": "z"}, "a wing with two sides lies along y, got along = 'z'"),
        ({"section_parameters": ["upper"]}, "NACA 0012 has no parameter 'upper'.*camber, crest"),
        ({"airfoil": ["naca 0012", BLUNT, "naca 0012"]}, "all be blunt or all be sharp"),
        ({"origin": [0.0, 0.0]}, r"origin is a place \(x, y, z\)"),
        ({"chord": [1.0, float("nan"), 1.0]}, "chord must be above 0"),
        ({"twist": [0.0, float("inf"), 1.0]}, "twist must be finite"),
        ({"chordwise": 10**8}, "chordwise = 100000000 and spanwise = 64 make more than 67108864"),
        ({"sweep_at": float("nan")}, "sweep_at must be a finite number, got nan"),
    ],
)
def test_what_cannot_be_built_says_why(options, message):
    with pytest.raises(ParameterError, match=message):
        Wing(**({"span": [4.0, 10.0], "chord": [3.0, 2.0, 1.0]} | options))


def test_a_cubic_that_falls_below_nothing_is_refused():
    with pytest.raises(GeometryError, match="falls below 0 between its stations; use more"):
        Wing([1.0, 2.0, 10.0, 11.0], [5.0, 5.0, 0.1, 0.1, 5.0], loft="cubic")


def test_a_trapezium_wants_its_area_or_its_chord():
    with pytest.raises(ParameterError, match="give area or chord"):
        TrapezoidalWing(10.0)
    with pytest.raises(ParameterError, match="taper must be above 0"):
        TrapezoidalWing(10.0, 5.0, taper=0.0)
    with pytest.raises(ParameterError, match="those of a Wing"):
        TrapezoidalWing(10.0, 5.0, section_parameters=True)


def test_other_numbers_of_parameters_are_refused():
    wing = Wing(10.0, 1.0, **SMALL)
    with pytest.raises(ParameterError, match=r"10 parameters.*got 9 numbers"):
        wing(wing.values[:-1])


def test_an_airfoil_made_before_serves_too():
    foil = airfoil("naca 2412")
    assert Wing(5.0, 1.0, airfoil=foil, **SMALL).profiles[0].airfoil is foil
