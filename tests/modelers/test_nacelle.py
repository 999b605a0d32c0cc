"""Nacelles: closed rings, differentiable in every number."""

from pathlib import Path

import jax
import numpy as np
import pytest

from moldline.case.options import model_of
from moldline.errors import GeometryError, ParameterError
from moldline.mesh import quality
from moldline.mesh.health import health
from moldline.modelers.base import shaped
from moldline.modelers.nacelle import Nacelle
from moldline.numerics.taylor import remainder

SMALL = {"chordwise": 17, "around": 24}
UNEVEN = {
    "length": 4.0,
    "radius": [1.2, 1.3, 1.15],
    "exit_radius": [1.0, 1.05, 0.95],
    "thickness": [0.1, 0.12, 0.14],
    "droop": 0.08,
    "scarf": 0.1,
    "airfoil": {"airfoil": "naca 2412", "trailing_edge": "blunt"},
}


@pytest.mark.parametrize("base_points", [0, 2])
def test_a_nacelle_is_a_sound_ring(base_points):
    surface = Nacelle(**UNEVEN, base_points=base_points).geometry
    found = health(surface)
    assert not found.sentences()
    assert found.volume > 0
    assert len(surface.points) - len(surface.faces) // 2 == 0  # Euler's number of a torus
    assert np.degrees(found.smallest_angle) > 2
    assert not health(Nacelle(4.0, 1.2).geometry).sentences()


def test_volume_is_that_of_pappus():
    """A symmetric section's centroid goes around at the radius of its chord line there."""
    around, length = 400, 4.0
    surface = Nacelle(length, 1.2, 1.0, around=around, chordwise=201).geometry
    x = (1 - np.cos(np.linspace(0, np.pi, 4001))) / 2
    half = 0.6 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    area = 2 * np.trapezoid(half, x) * length**2
    centre = 1.2 - 0.2 * np.trapezoid(half * x, x) / np.trapezoid(half, x)
    exact = 2 * np.pi * centre * area
    np.testing.assert_allclose(quality.signed_volume(surface), exact, rtol=1e-4)


def test_crown_side_and_keel_have_the_radii_asked_for():
    points = np.asarray(Nacelle(4.0, [1.2, 1.3, 1.15], 1.0, **SMALL).geometry.points)
    lip = points[points[:, 0] == 0.0]
    np.testing.assert_allclose(lip[:, 2].max(), 1.2, rtol=1e-15)
    np.testing.assert_allclose(lip[:, 2].min(), -1.15, rtol=1e-15)
    np.testing.assert_allclose(lip[lip[:, 2] == 0.0][:, 1], [1.3, -1.3], rtol=1e-15)
    edge = points[np.isclose(points[:, 0], 4.0)]
    np.testing.assert_allclose(np.hypot(edge[:, 1], edge[:, 2]), 1.0, rtol=1e-12)


def test_droop_lowers_the_lip_and_scarf_brings_its_keel_forward():
    plain, drooped, scarfed = (
        np.asarray(Nacelle(4.0, 1.2, **options, **SMALL).geometry.points)
        for options in ({}, {"droop": 0.1}, {"scarf": 0.2})
    )
    lip = plain[:, 0] == 0.0
    np.testing.assert_allclose((drooped - plain)[lip, 2], -np.tan(0.1) * 2.0)
    np.testing.assert_allclose((scarfed - plain)[lip, 0], np.tan(0.2) * plain[lip, 2], atol=1e-15)
    aft = plain[:, 0] == 4.0
    np.testing.assert_array_equal(drooped[aft], plain[aft])


def test_cowl_and_duct_are_components():
    surface = Nacelle(4.0, 1.2, **SMALL).geometry
    assert surface.components == ("nacelle cowl", "nacelle duct")
    radius = np.hypot(*np.asarray(surface.points)[:, 1:].T)
    cowl, duct = (surface.component(name) for name in surface.components)
    assert radius[cowl].min() >= 1.2 - 1e-12
    assert radius[duct].max() <= 1.2 + 1e-12


def test_derivatives_by_every_parameter_are_finite_and_right():
    nacelle = Nacelle(**UNEVEN, section_parameters=["camber", "thickness"], **SMALL)
    jacobian = np.asarray(jax.jacfwd(lambda p: shaped(nacelle, p))(nacelle.values))
    assert np.isfinite(jacobian).all()
    assert np.abs(jacobian).max(axis=(0, 1)).min() > 0.01
    rng = np.random.default_rng(0)
    for name, rows in nacelle.parameters.items():
        along = np.zeros(nacelle.size)
        along[rows] = 0.05 * rng.normal(size=len(rows))
        assert remainder(lambda p: shaped(nacelle, p), nacelle.values, along).is_right, name


def test_connectivity_is_the_same_for_other_parameters_and_the_shape_stays_sound():
    nacelle = Nacelle(**UNEVEN, **SMALL)
    moved = nacelle.geometry.moved(np.asarray(nacelle.bind()(nacelle.values * 1.1)))
    assert not health(moved).sentences()


def test_half_a_nacelle_is_open_in_its_plane_to_the_bit():
    nacelle = Nacelle(**UNEVEN, half=True, **SMALL)
    found = health(nacelle.geometry)
    assert len(found.holes) == 2
    moved = np.asarray(nacelle.bind()(nacelle.values * 1.1))
    assert all(np.all(moved[hole, 1] == 0.0) for hole in found.holes)


def test_a_whole_nacelle_is_symmetric_to_the_bit():
    points = np.asarray(Nacelle(**UNEVEN, **SMALL).geometry.points)
    one, other = (np.unique(points * [1, side, 1] + 0.0, axis=0) for side in (1, -1))
    np.testing.assert_array_equal(one, other)


def test_a_case_file_can_say_all_of_it():
    said = {**UNEVEN, "droop": 4, "scarf": 5.0, "degrees": True, "section_parameters": True}
    model_of("nacelle", Nacelle.options()).model_validate(said)
    nacelle = Nacelle.build(Path(), **said)
    np.testing.assert_allclose(nacelle.values[nacelle.parameters["droop"]], np.radians(4))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"length": -4.0}, r"length must be above 0 \[m\]"),
        ({"radius": [1.0, 2.0]}, "radius takes one number, or three"),
        ({"droop": 4.0}, "droop must lie within 60 degrees"),
        ({"around": 7}, "around must be an even number"),
        ({"base_points": 1}, "0 where the trailing edge is sharp"),
        ({"half": True, "origin": [0, 1, 0]}, "half a nacelle begins at y = 0"),
    ],
)
def test_what_cannot_be_built_says_why(options, message):
    with pytest.raises(ParameterError, match=message):
        Nacelle(**({"length": 4.0, "radius": 1.2} | options))


def test_a_duct_that_closes_is_refused():
    with pytest.raises(GeometryError, match=r"the duct closes: its radius falls to -0.0"):
        Nacelle(4.0, 0.2)
