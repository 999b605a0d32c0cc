"""Measures of real geometry: published numbers, and the same computed in another way."""

import math
from pathlib import Path

import numpy as np
import pytest
import scipy.integrate
import trimesh
from measures.simple import naca0012, tapered

import moldline as ml
from moldline.mesh import slices
from moldline.mesh.planform import planform

M = ml.measures
TRANSPORT = Path(__file__).parents[2] / "examples/data/transport_wing.tri"


def half(x):
    """Half thickness of NACA 0012 per chord: Jacobs, Ward and Pinkerton, NACA report 460, 1933."""
    return 0.6 * (0.2969 * x**0.5 - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1015 * x**4)


def one(measure, geometry):
    (found,) = np.asarray(measure(geometry.points))
    return float(found)


@pytest.fixture
def published(data):
    """NACA 0012 from a file of others, 160 points, blunt."""
    return ml.read(data("naca0012.dat"))


def test_naca_0012_is_twelve_percent_thick_at_thirty_percent_chord(published):
    for cls in (M.Thickness, M.RayThickness):
        assert one(cls.build(published, chord=0.3), published) == pytest.approx(0.12, abs=1.5e-4)
        over = cls.over(published, [0.1, 0.5, 0.9])
        found = np.asarray(over(published.points))
        np.testing.assert_allclose(found, 2 * half(np.array([0.1, 0.5, 0.9])), rtol=0, atol=2e-4)
    larger = published.moved(3 * published.points)
    relative = M.Thickness.build(published, chord=0.3, relative=True)
    assert one(relative, larger) == pytest.approx(0.12, abs=1.5e-4)
    # a ray stays in space: what was 30 % of the chord is 10 % of the larger one
    relative = M.RayThickness.build(published, chord=0.3, relative=True)
    assert one(relative, larger) == pytest.approx(2 * half(0.1), abs=2e-4)


def test_its_area_is_the_integral_of_the_published_thickness(published):
    exact, _ = scipy.integrate.quad(lambda x: 2 * half(x), 0, 1)
    assert exact == pytest.approx(0.08221, abs=5e-5)  # report 460's ordinates give 0.0822
    assert one(M.SectionArea.build(published), published) == pytest.approx(exact, rel=1e-3)
    backwards = ml.Section(published.points[::-1])
    assert one(M.SectionArea.build(backwards), backwards) == pytest.approx(exact, rel=1e-3)


def test_its_nose_radius_is_that_of_report_460(published):
    known = 1.1019 * 0.12**2
    # the circle is larger the more of the section it is fitted to, which grows flatter
    assert one(M.EdgeRadius.build(published), published) == pytest.approx(known, rel=0.15)
    fine = naca0012(2000)
    narrow = M.EdgeRadius.build(fine, length=5e-4)
    assert one(narrow, fine) == pytest.approx(known, rel=0.03)


def test_its_trailing_edge_angle_is_that_of_report_460(published):
    known = 2 * math.atan(1.16925 * 0.12)
    assert one(M.Opening.build(published, length=0.01), published) == pytest.approx(known, rel=0.01)


def test_it_has_no_camber_and_no_incidence_and_unit_chord(published):
    assert one(M.Camber.build(published, chord=0.4), published) == pytest.approx(0, abs=2e-5)
    assert one(M.Incidence.build(published), published) == pytest.approx(0, abs=3e-5)
    assert one(M.Chord.build(published), published) == pytest.approx(1.0, abs=3e-5)
    c, s = math.cos(0.1), math.sin(0.1)
    turned = published.moved(published.points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))
    assert one(M.Incidence.build(published), turned) == pytest.approx(0.1, abs=3e-5)


def test_naca_2412_has_two_percent_camber_at_forty_percent():
    from wings import airfoil

    flat = airfoil(400, camber=0.02)
    foil = ml.Section(np.column_stack([flat, 0 * flat[:, 0]]), is_closed=True)
    # ordinates are added across the chord here, where report 460 turns them with the mean line
    assert one(M.Camber.build(foil, chord=0.4), foil) == pytest.approx(0.02, abs=3e-5)


def test_a_tapered_wing_is_measured_at_its_stations():
    wing = tapered(base=0.004, camber=0.02, twist=0.05)
    for at in (0.0, 3.7, 10.0):
        chord = 4 - 0.25 * at
        assert one(M.Chord.build(wing, at=at), wing) == pytest.approx(chord, rel=1e-4)
        # a cambered mean line makes the farthest point no longer the foremost: 0.03 degrees
        assert one(M.Incidence.build(wing, at=at), wing) == pytest.approx(0.05, abs=1e-3)
        assert one(M.Camber.build(wing, chord=0.4, at=at), wing) == pytest.approx(0.02, abs=2e-4)
        thick = M.Thickness.build(wing, chord=0.3, at=at, relative=True)
        # upwards, not across the chord; the base thickens the section by 0.004 of 0.3
        known = (0.12 + 0.3 * 0.004) / math.cos(0.05)
        assert one(thick, wing) == pytest.approx(known, rel=4e-3)
    rows = M.Thickness.over(wing, [0.2, 0.5], [1.0, 5.0, 9.0], relative=True)
    rays = M.RayThickness.over(wing, [0.2, 0.5], [1.0, 5.0, 9.0], relative=True)
    found = np.asarray(rows(wing.points)).reshape(3, 2)
    np.testing.assert_allclose(found, found[:1].repeat(3, 0), rtol=2e-3)
    # a toothpick leans with the chord, a ray does not
    np.testing.assert_allclose(rays(wing.points), found.ravel(), rtol=0.02)


@pytest.fixture(scope="module")
def transport():
    return ml.read(TRANSPORT)


def test_the_transport_wing_has_the_volume_that_trimesh_finds(transport):
    points, faces = np.asarray(transport.points), np.asarray(transport.faces)
    other = trimesh.Trimesh(points, faces, process=False)
    assert one(M.Volume.build(transport), transport) == pytest.approx(other.volume, rel=1e-12)
    assert one(M.Area.build(transport), transport) == pytest.approx(other.area, rel=1e-12)
    middle = np.asarray(M.Centroid.build(transport)(points))
    np.testing.assert_allclose(middle, other.center_mass, rtol=1e-10)


def test_its_volume_is_the_integral_of_its_cross_sections(transport):
    at = np.linspace(0.01, 29.37, 41).tolist()
    cuts = np.asarray(M.CrossSection.build(transport, at=at)(transport.points))
    volume = scipy.integrate.simpson(cuts, x=at)
    assert one(M.Volume.build(transport), transport) == pytest.approx(volume, rel=3e-3)


def test_a_cross_section_is_what_the_slice_encloses(transport):
    points, faces = np.asarray(transport.points), np.asarray(transport.faces)
    (line,) = [cut for cut in slices.cut(points, faces, "y", 12.345) if len(cut) > 2]
    x, z = line[:, 0], line[:, 2]
    area = abs(np.sum(x[:-1] * z[1:] - x[1:] * z[:-1])) / 2
    assert one(M.CrossSection.build(transport, at=12.345), transport) == pytest.approx(
        area, rel=1e-9
    )


def test_its_planform_area_is_the_integral_of_its_chord(transport):
    plan = planform(transport, 200, "1")
    chord = plan.trailing[:, 0] - plan.leading[:, 0]
    area = np.trapezoid(chord, plan.stations)
    shadow = one(M.ProjectedArea.build(transport), transport)
    assert shadow == pytest.approx(area, rel=2e-3)
    # AIAA 2008-6919 names 594,720 in2 for both wings, without the trailing-edge break
    assert 1.0 < 2 * shadow / (594720 * 0.0254**2) < 1.1


def test_its_leading_edge_is_straight_in_planform_from_the_break_outwards(transport):
    outer = M.Linearity.build(transport, at=[13.0, 17.0, 21.0, 25.0], component="1")
    beside, above = np.asarray(outer(transport.points)).reshape(-1, 2).T
    assert np.abs(beside).max() < 1e-3  # in planform; seen from ahead the wing is bent upwards
    assert np.abs(above).max() > 0.1
    hinge = M.Linearity.build(transport, at=[5.0, 13.0, 25.0], chord=0.75, side="lower")
    assert np.abs(hinge(transport.points)).max() > 0.1


def test_a_spar_box_fits_between_spars_and_a_taller_one_does_not(transport):
    ends = {}
    for y in (5.0, 15.0):
        for x in (0.2, 0.6):
            low, high = (
                ml.Spot.at_chord(transport, x, side, at=y, component="1").of(transport.points)
                for side in ("lower", "upper")
            )
            ends[x, y] = (low, high)
    for share, fits in ((0.25, True), (0.0, False)):
        corners = [
            tuple((1 - w) * low + w * high)
            for x in (0.2, 0.6)
            for y in (5.0, 15.0)
            for low, high in [ends[x, y]]
            for w in (share, 1 - share)
        ]
        depth = np.asarray(M.Enclosed.build(transport, box=corners)(transport.points))
        assert (depth.min() > 0.01) == fits
