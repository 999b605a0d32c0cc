"""NACA airfoils: closed forms, published ordinates, derivatives and refusals."""

import numpy as np
import pytest

from moldline.errors import ParameterError
from moldline.modelers.airfoil import check_edge
from moldline.modelers.naca4 import Naca4, half_thickness
from moldline.modelers.naca5 import REFLEXED, SIMPLE, Naca5, reflexed_line, simple_line
from moldline.modelers.naca_modified import NacaModified, half_modified
from moldline.numerics.taylor import remainder

PUBLISHED = {
    "2412": [
        (1.25, 2.15, -1.65), (2.5, 2.99, -2.27), (5, 4.13, -3.01), (10, 5.63, -3.75),
        (20, 7.26, -4.23), (30, 7.88, -4.12), (40, 7.80, -3.80), (60, 6.36, -2.76),
        (80, 3.75, -1.50), (95, 1.14, -0.48),
    ],
    "23012": [
        (1.25, 2.67, -1.23), (2.5, 3.61, -1.71), (5, 4.91, -2.26), (10, 6.43, -2.92),
        (20, 7.50, -3.97), (30, 7.55, -4.46), (40, 7.14, -4.48), (60, 5.47, -3.67),
        (80, 3.08, -2.16), (95, 0.92, -0.70),
    ],
}  # fmt: skip
"""Per cent of chord: Abbott and von Doenhoff, Theory of Wing Sections, 1959, appendix III."""

ALL = [
    Naca4("2412"), Naca4("0012", trailing_edge="blunt"), Naca5("23012", trailing_edge="blunt"),
    Naca5("44115"), NacaModified("2412-35", trailing_edge="blunt"), NacaModified("0012-64"),
]  # fmt: skip


@pytest.mark.parametrize("family", [Naca4, Naca5])
def test_ordinates_are_the_published_ones(family):
    """To a few hundredths of a per cent: they were drawn by hand, most so near the nose."""
    designation = "2412" if family is Naca4 else "23012"
    airfoil = family(designation, trailing_edge="blunt")
    x, upper, lower = np.array(PUBLISHED[designation]).T
    sides = 100 * np.asarray(airfoil.sides(airfoil.values, np.linspace(0, 1, 4001) ** 2))
    for side, heights in zip(sides, (upper, lower), strict=True):
        np.testing.assert_allclose(np.interp(x, *side.T), heights, rtol=0, atol=0.031)


@pytest.mark.parametrize(("edge", "gap"), [("sharp", 0.0), ("blunt", 0.00105)])
def test_thickness_of_four_digits_has_its_nose_radius_crest_and_edge(edge, gap):
    """Nose radius 1.1019 t², greatest near 0.3, and at the edge what the coefficients leave."""
    x = np.array([1e-12, 0.3, 1.0])
    near, crest, end = np.asarray(half_thickness(0.12, x, edge))
    assert near**2 / (2 * x[0]) == pytest.approx(1.1019 * 0.12**2, rel=1e-4)
    assert crest == pytest.approx(0.06, abs=2e-5)
    assert end == pytest.approx(0.12 / 0.1 * gap, abs=1e-15)


def test_a_sharp_edge_is_one_point_to_the_bit_and_a_blunt_one_two():
    for airfoil in ALL:
        upper, lower = np.asarray(airfoil.sides(airfoil.values, np.array([0.0, 0.5, 1.0])))
        assert np.array_equal(upper[0], lower[0])
        assert np.array_equal(upper[-1], lower[-1]) != airfoil.is_blunt


@pytest.mark.parametrize(("line", "table"), [(simple_line, SIMPLE), (reflexed_line, REFLEXED)])
def test_camber_lines_of_five_digits_have_the_published_constants(line, table):
    """The line's third derivative before r is k1; behind r it has none, or k2, and no kink."""
    for crest, r, k1 in table:
        height, slope = line(0.3, crest, np.array([0.0, r / 2, r - 1e-9, r + 1e-9, 1.0]))
        assert height[0] == pytest.approx(0, abs=1e-15)
        assert height[-1] == pytest.approx(0, abs=1e-15)
        assert slope[3] - slope[2] == pytest.approx(0, abs=1e-7)
        assert 8 * (slope[1] - slope[2]) / r**2 == pytest.approx(k1, rel=1e-6)
        top = line(0.3, crest, np.linspace(crest - 0.02, crest + 0.02, 4001))[0]
        assert abs(np.argmax(top) / 1e5 - 0.02) < 6e-4  # the constants have three or four digits


def test_a_reflexed_line_bends_up_behind():
    slopes = np.asarray(reflexed_line(0.3, 0.15, np.linspace(0, 1, 101))[1])
    assert slopes[40] < slopes[-1]
    assert np.isclose(Naca5("23112").lift, 0.3)


def test_modified_thickness_has_the_published_coefficients():
    """Report 492, table I, index 6 and greatest thickness at 0.3, for a section 20 % thick."""
    x = np.linspace(0.01, 0.29, 40)
    powers = np.stack([np.sqrt(x), x, x**2, x**3], axis=1)
    before = np.linalg.lstsq(powers, half_modified(6.0, 0.3, x, "blunt"), rcond=None)[0]
    np.testing.assert_allclose(before, [0.2969, -0.0961, -0.5433, 0.5594], rtol=0, atol=5e-5)
    x = np.linspace(0.42, 1.0, 40)
    powers = (1 - x[:, None]) ** np.arange(4)
    behind = np.linalg.lstsq(powers, half_modified(6.0, 0.4, x, "blunt"), rcond=None)[0]
    np.testing.assert_allclose(behind, [0.002, 0.315, -0.233333, -0.032407], rtol=0, atol=1e-6)


@pytest.mark.parametrize("thickest", [0.2, 0.35, 0.6])
def test_modified_thickness_is_greatest_where_it_should_be(thickest):
    x = thickest + np.array([-1e-5, 0, 1e-5])
    before, at, behind = np.asarray(half_modified(4.0, thickest, x, "sharp"))
    assert at == pytest.approx(0.1, abs=1e-12)
    assert before - behind == pytest.approx(0, abs=1e-12)
    near = half_modified(4.0, thickest, np.array([1e-12]), "sharp")[0]
    assert near**2 / 2e-12 == pytest.approx(1.1019 * (0.2 * 4 / 6) ** 2, rel=1e-4)


@pytest.mark.parametrize("airfoil", ALL, ids=lambda a: f"{a.name} {a.trailing_edge}")
def test_derivatives_by_every_parameter_are_exact(airfoil):
    for name, number in airfoil.parameters.items():
        along = np.zeros(airfoil.size)
        along[number] = 0.01
        assert remainder(airfoil, airfoil.values, along).is_right, name


def test_other_edges_are_refused():
    with pytest.raises(ParameterError, match="sharp or blunt, got 'round'"):
        check_edge("round")


def test_options_replace_what_the_digits_say():
    airfoil = Naca4("2412", thickness=0.15, camber=0.03)
    np.testing.assert_array_equal(airfoil.values, [0.03, 0.4, 0.15])
    assert airfoil.name == "NACA 3415"
    assert Naca4("0012").values[1] == 0.4


@pytest.mark.parametrize(
    ("family", "options", "said"),
    [
        (Naca4, {"designation": "241"}, "named by 4 digits, such as 2412; got '241'"),
        (Naca4, {"designation": "2012"}, "both 0 or neither is; got 2 and 0"),
        (Naca4, {"crest": 1.0}, r"the crest must lie inside \(0, 1\)"),
        (Naca4, {"thickness": 0.0}, "the thickness must be above 0"),
        (Naca5, {"designation": "63215"}, "need a file of coordinates"),
        (Naca5, {"crest": 0.4}, "between 0.05 and 0.25 of chord"),
        (Naca5, {"thickness": -1.0}, "the thickness must be above 0"),
        (NacaModified, {"designation": "0012-67"}, "is 2 to 6, got 7"),
        (NacaModified, {"thickest": 0.7}, "thickest must lie between 0.2 and 0.6"),
        (NacaModified, {"nose": -1.0}, "index must be 0 or more"),
        (NacaModified, {"crest": 0.0}, "the crest must lie inside"),
        (NacaModified, {"thickness": 0.0}, "the thickness must be above 0"),
    ],
)
def test_what_is_no_section_is_refused(family, options, said):
    with pytest.raises(ParameterError, match=said):
        family(**options)
