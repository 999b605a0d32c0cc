"""Airfoils through published tables and files."""

import numpy as np
import pytest

import moldline as ml
from moldline.errors import GeometryError, ParameterError
from moldline.modelers.naca4 import Naca4
from moldline.modelers.tabulated import FOLDER, Tabulated, found, table, tables, two_sides
from moldline.numerics.taylor import remainder


@pytest.mark.parametrize("name", tables())
def test_tables_are_reproduced_at_their_points(name):
    section = table(name)
    upper, lower = two_sides(np.asarray(section.points), name)
    made = Tabulated(section)
    sides = np.asarray(made.sides(made.values, upper[:, 0]))
    np.testing.assert_allclose(sides[0], upper, rtol=0, atol=1e-17)
    np.testing.assert_allclose(sides[1], lower, rtol=0, atol=1e-17)


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.csv")), ids=lambda p: p.stem)
def test_tables_name_their_source(path):
    head = path.read_text().split("x,upper,lower")[0]
    assert any(word in head for word in ("AGARD", "ARC CP", "NASA TP"))


@pytest.mark.parametrize(
    ("name", "thickness", "edge"),
    [
        ("RAE 2822", 0.121, 0.0), ("RAE 104", 0.100, 0.0), ("ONERA D", 0.0979, 0.00141),
        ("SC(2)-0714", 0.1396, 0.0070), ("SC(2)-0412", 0.12, 0.0055), ("SC(2)-0010", 0.1, 0.005),
    ],
)  # fmt: skip
def test_tables_have_the_thickness_that_they_are_known_by(name, thickness, edge):
    made = Tabulated(table(name))
    upper, lower = np.asarray(made.sides(made.values, np.linspace(0, 1, 2001)))[..., 1]
    assert (upper - lower).max() == pytest.approx(thickness, abs=2e-4)
    assert upper[-1] - lower[-1] == pytest.approx(edge, abs=5e-5)
    assert made.is_blunt == (edge > 0)


def test_onera_d_closes_to_the_sharp_form_in_use():
    """NASA's Turbulence Modeling Resource takes 0.0007052 (x - 0.9) / 0.1 off behind x = 0.9."""
    sharp = {0.9061905: 0.0121952, 0.9479946: 0.0068038, 0.9842508: 0.0020606, 1.0: 0.0}
    upper = two_sides(np.asarray(table("ONERA D").points), "ONERA D")[0]
    for x, y in sharp.items():
        here = upper[np.argmin(np.abs(upper[:, 0] - x)), 1]
        assert here - 0.0007052 * (x - 0.9) / 0.1 == pytest.approx(y, abs=1.1e-7)


def test_the_nose_is_round_and_the_curve_between_points_is_that_of_the_section():
    """Every second point of a NACA 0012 gives the others back, to 1e-5 next to the nose."""
    fine = Naca4("0012", points_per_side=81)
    made = Tabulated(Naca4("0012", points_per_side=41).geometry)
    place = fine.outline.stations
    np.testing.assert_allclose(
        made.sides(made.values, place), fine.sides(fine.values, place), rtol=0, atol=1.1e-5
    )
    near = np.asarray(made.sides(made.values, np.array([0.0, 1e-8, 1.0])))[0, 1]
    assert near[1] ** 2 / 2e-8 == pytest.approx(1.1019 * 0.12**2, rel=0.03)


def test_factors_thicken_and_bend():
    made = Tabulated(table("RAE 2822"))
    place = np.linspace(0, 1, 33)
    rest, thick, bent = (
        np.asarray(made.sides(np.array(p), place))[..., 1] for p in ([1, 1.0], [1.2, 1], [1, 0.0])
    )
    np.testing.assert_allclose(thick[0] - thick[1], 1.2 * (rest[0] - rest[1]), atol=1e-15)
    np.testing.assert_allclose(thick.sum(axis=0), rest.sum(axis=0), atol=1e-15)
    np.testing.assert_allclose(bent.sum(axis=0), 0, atol=1e-15)
    assert remainder(made, made.values, np.array([0.1, 0.2])).is_right


def test_a_blunt_edge_is_closed_by_a_wedge():
    blunt = Tabulated(table("SC(2)-0714"))
    sharp = Tabulated(table("SC(2)-0714"), trailing_edge="sharp")
    place = np.linspace(0, 1, 9)
    gap = np.asarray(blunt.sides(blunt.values, place) - sharp.sides(sharp.values, place))
    np.testing.assert_allclose(gap[0, :, 1], 0.0035 * place, rtol=0, atol=1e-15)
    upper, lower = np.asarray(sharp.sides(np.array([1.3, 0.7]), place))
    assert np.array_equal(upper[-1], lower[-1])
    assert not sharp.is_blunt


def test_files_are_read_and_a_nose_between_two_points_is_found(data):
    """The file's least x is at two points; the nose between them is the formula's, the origin."""
    made = Tabulated.build(data("naca0012.dat").parent, section="naca0012.dat")
    known = Naca4("0012", trailing_edge="blunt")
    place = known.outline.stations
    np.testing.assert_allclose(
        made.sides(made.values, place), known.sides(known.values, place), rtol=0, atol=2e-5
    )


def test_a_written_section_comes_back(tmp_path):
    first = Tabulated(table("RAE 2822"), points_per_side=65).geometry
    ml.write(tmp_path / "rae.dat", first)
    again = Tabulated.build(tmp_path, section="rae.dat", points_per_side=65)
    np.testing.assert_allclose(again.geometry.points, first.points, rtol=0, atol=1e-16)
    assert again.name == "RAE 2822"


def test_coordinates_of_any_size_and_place_become_chord_1_from_the_origin():
    section = Naca4("2412").geometry
    moved = section.moved(250 * np.asarray(section.points) + [30, 7, 0])
    np.testing.assert_allclose(
        Tabulated(moved).geometry.points, Tabulated(section).geometry.points, rtol=0, atol=1e-13
    )


LOOP = np.asarray(Naca4("2412", points_per_side=9).geometry.points)


@pytest.mark.parametrize(
    ("points", "said"),
    [
        (LOOP[:5], "seven at least"),
        (LOOP[:, :1], "rows of x and y"),
        (LOOP[:10], "run from the trailing edge over the upper side"),
        (LOOP[::-1], "the first side lies below"),
        (np.insert(LOOP, 3, [0.9, 0.1, 0], axis=0), r"on the upper side at \(0.854532, 0.02798"),
    ],
)
def test_what_is_no_airfoil_is_refused(points, said):
    with pytest.raises(GeometryError, match=said):
        Tabulated(points, name="given")


def test_edges_that_cannot_be_had_and_unknown_tables_are_refused(tmp_path):
    with pytest.raises(ParameterError, match="no blunt edge"):
        Tabulated(table("RAE 2822"), trailing_edge="blunt")
    slanted = np.delete(np.asarray(table("SC(2)-0714").points), 0, axis=0)
    with pytest.raises(ParameterError, match=r"0.01 of chord apart in x"):
        Tabulated(slanted, trailing_edge="sharp")
    with pytest.raises(ParameterError, match=r"no table is called 'RAE 1'.*RAE 104, RAE 2822"):
        found("RAE 1", tmp_path)
