"""What all airfoils share: sections, stations, and names."""

from pathlib import Path

import jax
import numpy as np
import pytest
from bodies import naca_0012

import moldline as ml
from moldline.errors import FileError, ParameterError
from moldline.modelers.airfoils import airfoil
from moldline.modelers.kulfan import Kulfan
from moldline.modelers.naca4 import Naca4
from moldline.modelers.naca5 import Naca5
from moldline.modelers.naca_modified import NacaModified
from moldline.modelers.spacing import NAMES, stations
from moldline.modelers.tabulated import Tabulated
from moldline.numerics.taylor import remainder

FAMILIES = [
    Naca4("2412"),
    Naca5("23012"),
    NacaModified("0012-64", trailing_edge="blunt"),
    Kulfan([0.2, 0.15, 0.2], [-0.12, -0.1], nose=0.01, tail=-0.01, edge=0.004),
    airfoil("rae 2822"),
    airfoil("sc(2)-0714"),
]


def test_a_section_is_that_of_the_formula():
    made = Naca4("0012").geometry
    np.testing.assert_allclose(made.points, naca_0012().points, rtol=0, atol=1e-15)
    assert not made.is_closed


@pytest.mark.parametrize("base", [0, 3])
def test_a_blunt_section_is_closed_across_its_base(base):
    made = Naca4("0012", trailing_edge="blunt", base_points=base, points_per_side=11, chord=2.0)
    section = made.geometry
    assert section.is_closed
    assert len(section.points) == 21 + base
    last = np.asarray(section.points)[20:]
    np.testing.assert_allclose(np.diff(np.append(last, section.points[:1], 0)[:, 0]), 0)
    heights = 2 * np.linspace(-0.00126, 0.00126, base + 2)
    np.testing.assert_allclose(last[:, 1], heights[:-1], rtol=0, atol=1e-15)


@pytest.mark.parametrize("made", FAMILIES, ids=lambda a: a.name)
def test_every_family_is_finite_at_its_nose_in_both_modes_and_by_the_stations(made):
    place = made.outline.stations[[0, 1, -1]]
    for derivative in (jax.jacfwd, jax.jacrev):
        slopes = jax.jit(derivative(lambda p, s: made.sides(p, s), argnums=(0, 1)))
        assert all(np.isfinite(slope).all() for slope in slopes(made.values, place))


@pytest.mark.parametrize("made", FAMILIES, ids=lambda a: a.name)
def test_points_stay_at_their_stations_whatever_the_parameters(made):
    """A binding gives what the definition does, and the stations are no result of parameters."""
    moved = np.asarray(made.bind()(1.1 * made.values))
    np.testing.assert_allclose(moved, made(1.1 * made.values), rtol=0, atol=1e-15)
    assert moved.shape == made.geometry.points.shape
    assert remainder(made, made.values, 0.002 * np.ones(made.size)).is_right
    upper, lower = np.asarray(made.sides(1.1 * made.values, made.outline.stations))
    for side in (upper, lower):  # a thick and bent nose may reach before the origin
        assert (np.diff(side[30:, 0]) > 0).all()


@pytest.mark.parametrize("spacing", NAMES)
def test_stations_run_from_nose_to_trailing_edge(spacing):
    found = stations(Naca4("2412"), 41, spacing)
    assert len(found) == 41
    assert found[0] == 0
    assert found[-1] == 1
    assert (np.diff(found) > 0).all()


def test_curvature_spacing_crowds_the_nose_and_evens_out_the_turns():
    """Each segment turns by far less at the nose than where points are evenly spread."""
    turns = {}
    for spacing in ("curvature", "cosine", "uniform"):
        points = np.asarray(Naca4("2412", points_per_side=61, spacing=spacing).geometry.points)
        angle = np.unwrap(np.arctan2(*np.diff(points[:, :2], axis=0).T[::-1]))
        turns[spacing] = np.abs(np.diff(angle)).max()
    assert turns["curvature"] < 0.7 * turns["cosine"] < 0.2 * turns["uniform"]


def test_stations_may_be_given():
    made = Naca4("0012", spacing=[0.0, 0.3, 1.0])
    np.testing.assert_allclose(made.geometry.points[:, 0], [1, 0.3, 0, 0.3, 1])
    built = Naca4.build(Path(), spacing=[0.0, 0.3, 1.0])
    assert np.array_equal(built(made.values), made(made.values))


@pytest.mark.parametrize(
    ("spacing", "count", "said"),
    [
        ("dense", 9, "spacing must be one of cosine, half-cosine, uniform, curvature"),
        ("cosine", 2, "at least 3 points and 1048576 at most, got 2"),
        ([0.0, 0.5], 9, "ascend from 0 to 1"),
        ([0.0, 0.5, 0.5, 1.0], 9, "ascend from 0 to 1"),
        ([0.1, 0.5, 1.0], 9, "ascend from 0 to 1"),
        ("curvature", 9, "needs an airfoil"),
    ],
)
def test_other_stations_are_refused(spacing, count, said):
    with pytest.raises(ParameterError, match=said):
        stations(None, count, spacing)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"base_points": -1}, "0 points inside or more"),
        ({"base_points": 2}, "say trailing_edge = blunt"),
        ({"chord": 0.0}, "a length above 0"),
    ],
)
def test_other_outlines_are_refused(options, said):
    with pytest.raises(ParameterError, match=said):
        Naca4("0012", **options)


@pytest.mark.parametrize(
    ("said", "name"),
    [
        ("2412", "NACA 2412"), ("naca 2412", "NACA 2412"), ("NACA-23012", "NACA 23012"),
        ("naca 0012-64", "NACA 0012-64"), ("NACA001264", "NACA 0012-64"),
        ("rae 2822", "RAE 2822"), ("RAE104", "RAE 104"), ("Onera D", "ONERA D"),
        ("ONERA M6", "ONERA D"), ("sc(2)-0714", "NASA SC(2)-0714"),
        ("NASA SC(2) 0412", "NASA SC(2)-0412"), ({"airfoil": "naca4"}, "NACA 0012"),
        ({"airfoil": "kulfan", "upper": [0.1], "lower": [-0.1, -0.1]}, "Kulfan 1 + 2"),
        ({"airfoil": "kulfan", "fit": "rae 104", "order": 4}, "Kulfan 5 + 5"),
        ({"airfoil": "tabulated", "section": "RAE 104"}, "RAE 104"),
    ],
)  # fmt: skip
def test_an_airfoil_is_known_by_what_one_calls_it(said, name):
    assert airfoil(said).name == name


def test_options_and_airfoils_pass_through(tmp_path):
    made = airfoil({"airfoil": "2412", "thickness": 0.1}, points_per_side=5)
    assert made.geometry.points.shape == (9, 3)
    assert made.values[2] == 0.1
    assert airfoil(made) is made
    ml.write(tmp_path / "own.dat", made.geometry)
    assert isinstance(airfoil("own.dat", tmp_path), Tabulated)


@pytest.mark.parametrize(
    ("said", "error", "match"),
    [
        ("clark y", ParameterError, r"no airfoil is known as 'clark y'.*RAE 2822.*kulfan"),
        ("63-215", ParameterError, "no airfoil is known as"),
        ("none.dat", FileError, "no such file"),
        ({"thickness": 0.1}, ParameterError, "need airfoil = its family or name"),
        ({"airfoil": "naca4", "width": 1}, ParameterError, "Naca4 has no option width; it has"),
        ({"airfoil": "naca4", "thickness": "x"}, ParameterError, "Naca4 cannot be made of thick"),
        ({"airfoil": "kulfan", "fit": 3}, ParameterError, "Kulfan cannot be made of fit = 3: "),
        ({"airfoil": "2412", "points_per_side": 10**9}, ParameterError, "and 1048576 at most"),
        ({"airfoil": Naca4("0012"), "chord": 2.0}, ParameterError, "chord come too late"),
    ],
)
def test_what_is_not_known_is_told_with_what_is(said, error, match):
    with pytest.raises(error, match=match):
        airfoil(said)
