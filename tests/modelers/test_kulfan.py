"""Airfoils by class and shape functions."""

from pathlib import Path

import numpy as np
import pytest

from moldline.errors import ParameterError
from moldline.modelers.kulfan import Kulfan
from moldline.modelers.naca4 import Naca4
from moldline.modelers.tabulated import table, tables
from moldline.numerics.taylor import remainder


def test_one_coefficient_is_the_class_function():
    """√x (1 - x) times the coefficient, whose square's half is the nose radius."""
    airfoil = Kulfan([0.2], [-0.1])
    place = np.linspace(0, 1, 11)
    upper, lower = np.asarray(airfoil.sides(airfoil.values, place))
    np.testing.assert_allclose(upper[:, 1], 0.2 * np.sqrt(place) * (1 - place), atol=1e-16)
    np.testing.assert_allclose(lower[:, 1], -0.1 * np.sqrt(place) * (1 - place), atol=1e-16)


def test_equal_coefficients_of_any_order_are_one():
    """Bernstein polynomials sum to 1."""
    place = np.linspace(0, 1, 33)
    one, many = Kulfan([0.2], [-0.1]), Kulfan(np.full(9, 0.2), np.full(5, -0.1))
    np.testing.assert_allclose(
        many.sides(many.values, place), one.sides(one.values, place), rtol=0, atol=1e-16
    )


def test_first_and_last_coefficients_are_nose_radius_and_boat_tail():
    """c0² = 2 r, and the last one is the tangent of the angle at the trailing edge."""
    airfoil = Kulfan([0.3, 0.1, 0.2], [-0.3, -0.1, -0.2])
    upper = np.asarray(airfoil.sides(airfoil.values, np.array([0, 1e-10, 1 - 1e-8, 1.0])))[0]
    assert upper[1, 1] ** 2 / 1e-10 == pytest.approx(0.3**2, rel=1e-6)
    assert upper[2, 1] / 1e-8 == pytest.approx(0.2, rel=1e-6)


def test_edge_tail_and_nose_are_added():
    airfoil = Kulfan([0.2, 0.2], [-0.1], edge=0.01, tail=-0.02, nose=0.05)
    assert list(airfoil.parameters) == ["upper", "lower", "edge", "tail", "nose"]
    ends = np.asarray(airfoil.sides(airfoil.values, np.array([0.0, 0.5, 1.0])))[:, -1]
    np.testing.assert_allclose(ends, [[1, -0.015], [1, -0.025]], rtol=0, atol=1e-17)
    assert airfoil.is_blunt
    assert not Kulfan([0.2], [-0.1], tail=0.1).is_blunt
    bare = Kulfan([0.2, 0.2], [-0.1], edge=0.01, tail=-0.02)
    half = np.array([0.0, 0.5, 1.0])
    bend = np.asarray(airfoil.sides(airfoil.values, half) - bare.sides(bare.values, half))
    np.testing.assert_allclose(bend[:, 1, 1], 0.05 * 0.5 * 0.5 ** np.array([2.5, 1.5]))


@pytest.mark.parametrize("exponents", [(0.5, 1.0), (1.0, 1.0), (0.75, 0.75), (0.5, 0.0)])
def test_derivatives_are_exact_for_any_class(exponents):
    airfoil = Kulfan([0.2, 0.1], [-0.1, -0.1, 0.1], exponents=exponents, nose=0.1, tail=0.1)
    assert remainder(airfoil, airfoil.values, 0.1 * np.ones(airfoil.size)).is_right


def test_a_fit_finds_the_coefficients_again():
    known = Kulfan([0.2, 0.1, 0.25], [-0.1, -0.15, 0.05], edge=0.006, tail=-0.01, nose=0.03)
    fit = Kulfan.fitted(known.geometry, 2, has_nose_term=True)
    assert fit.largest < 1e-15
    np.testing.assert_allclose(fit.airfoil.values, known.values, rtol=0, atol=1e-12)


def test_rae_2822_is_fitted_better_than_wind_tunnel_models_are_made():
    """Kulfan's tolerance: 4e-4 of chord before 0.2, 8e-4 behind. Ours at order 8: 1.0e-4."""
    errors = [Kulfan.fitted(table("RAE 2822"), order).largest for order in (4, 6, 8, 10, 12)]
    assert errors[2] < 1.1e-4
    assert (np.diff(errors) < 0).all()
    assert errors[-1] < 2e-5


@pytest.mark.parametrize("name", tables())
def test_every_table_is_fitted_by_order_8(name):
    fit = Kulfan.fitted(table(name), 8)
    assert fit.rms < fit.largest < 6e-4
    place = fit.airfoil.outline.stations
    assert np.isfinite(fit.airfoil.sides(fit.airfoil.values, place)).all()


def test_the_fit_of_a_case_file():
    made = Kulfan.build(Path(), fit="RAE 2822", order=6, nose=0.0, points_per_side=21)
    assert len(made.upper) == 7
    assert made.nose is not None
    assert made.geometry.points.shape == (41, 3)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"upper": []}, "list of 1 to 100 finite coefficients"),
        ({"lower": [np.nan]}, "list of 1 to 100 finite coefficients"),
        ({"exponents": (0.0, 1.0)}, "above 0 at the nose"),
        ({"edge": 0.0}, "leave it out for a sharp trailing edge"),
        ({"edge": np.inf}, "edge must be a finite number, got inf"),
        ({"tail": np.nan}, "tail must be a finite number, got nan"),
    ],
)
def test_what_is_no_section_is_refused(options, said):
    with pytest.raises(ParameterError, match=said):
        Kulfan(**({"upper": [0.1], "lower": [-0.1]} | options))


def test_fits_that_cannot_be_had_are_refused():
    few = Naca4("2412", points_per_side=6).geometry
    with pytest.raises(ParameterError, match=r"do not fix 18 coefficients; give a lower order"):
        Kulfan.fitted(few, 8)
    with pytest.raises(ParameterError, match="the order must be 1 to 99"):
        Kulfan.fitted(few, 0)
    with pytest.raises(ParameterError, match="a fit finds upper, lower, edge and tail itself"):
        Kulfan.build(Path(), fit="RAE 2822", upper=[0.1])
    with pytest.raises(ParameterError, match="needs coefficients upper and lower, or fit"):
        Kulfan.build(Path(), upper=[0.1])
