"""Planforms read from wings that are known."""

from pathlib import Path

import numpy as np
import pytest
from wings import airfoil, wing

import moldline as ml
from moldline.errors import GeometryError, ParameterError
from moldline.mesh.planform import planform
from moldline.mesh.stitch import stitched

SPAN = 10.0
MODEL = Path(__file__).parents[2] / "examples/data/crm_wing.csv"


def chord(y):
    return 4.0 - 2.5 * y / SPAN


def twist(y):
    return np.radians(3.0 - 6.0 * y / SPAN)


def swept(rows=13, section=None, **options):
    y = np.linspace(0, SPAN, rows)
    return wing(y, chord(y), twist(y), section=section, **options)


def errors(surface, stations=7):
    """Largest of chord, relative, and of twist, quarter-chord sweep and dihedral [rad]."""
    plan = planform(surface, stations)
    pairs = [
        (plan.chord / chord(plan.stations), 1.0),
        (plan.twist, twist(plan.stations)),
        (plan.sweep_at(0.25), 0.5),
        (plan.dihedral, 0.1),
    ]
    return np.array([np.abs(read - known).max() for read, known in pairs])


@pytest.mark.parametrize("base", [0.0, 0.004, 0.03])
def test_the_planform_of_a_known_wing_is_read_exactly(base):
    """Stations on rows of points; the base may be sharp or blunt."""
    assert np.all(errors(swept(section=airfoil(base=base))) < 1e-14)


def test_the_chord_of_a_cambered_section_ends_at_its_farthest_point():
    """A four-digit mean line begins a little beside it: 0.03 degrees of twist, 6e-6 of chord."""
    found = errors(swept(section=airfoil(camber=0.04)))
    assert np.all(found < [7e-6, 5e-4, 2e-5, 1e-4])
    assert found[1] > 1e-4


@pytest.mark.parametrize("count", [8, 12, 16, 40])
def test_stations_between_rows_of_a_coarse_mesh_are_read_too(count):
    """Edges run straight from row to row; between them triangles are chords of twisted quads."""
    surface, at = swept(5, airfoil(count)), np.array([0.7, 3.0, 5.5, 9.1])
    rows, plan = planform(surface, 5), planform(surface, at)
    for name, near in (("leading", 2e-4), ("trailing", 1e-14)):
        known = [np.interp(at, rows.stations, line) for line in getattr(rows, name).T]
        np.testing.assert_allclose(getattr(plan, name).T, known, rtol=0, atol=near)


def test_a_nose_that_falls_between_points_is_found_on_the_circle_through_three():
    section = np.delete(airfoil(40), 40, axis=0)  # without its foremost point
    section = np.delete(section, 40, axis=0)  # and unevenly so
    found = errors(swept(section=section))
    nearest = 1 - np.linalg.norm(section[39] - [1, 0])
    assert found[0] < nearest / 2
    assert found[1] < abs(section[39, 1]) / 5


def test_twist_is_positive_nose_up():
    plan = planform(wing([0, 5], [1, 1], [0.0, 0.1], sweep=0.3, dihedral=-0.2))
    np.testing.assert_allclose(plan.twist[[0, -1]], [0, 0.1], atol=1e-14)
    assert plan.leading[-1, 2] > plan.trailing[-1, 2]
    assert np.all(plan.sweep > 0) and np.all(plan.dihedral < 0)


def test_a_turned_section_is_read_turned():
    flat, steep = (planform(wing([0, 5], 2.0, t, section=airfoil(camber=0.04)), 2) for t in (0, 1))
    np.testing.assert_allclose(steep.twist - flat.twist, 1.0, rtol=0, atol=1e-13)
    np.testing.assert_allclose(steep.chord, flat.chord, rtol=1e-13)


def test_a_sharp_leading_edge_is_its_corner():
    diamond = np.array([[1, 0], [0.7, 0.03], [0.02, 0.002], [0, 0], [0.5, -0.03]])
    plan = planform(wing([0, 5], [2, 1], 0.1, section=diamond), 2)
    np.testing.assert_allclose(plan.twist, 0.1, atol=1e-14)
    np.testing.assert_allclose(plan.chord, [2, 1], rtol=1e-14)


def test_heights_are_the_section_s_extent():
    plan = planform(wing([0, 5], 2.0, 0.0, dihedral=0.0, place=(0, 1)), 2)
    np.testing.assert_allclose(plan.high - 1, 0.12, atol=1e-3)
    np.testing.assert_allclose(plan.low - 1, -0.12, atol=1e-3)


@pytest.mark.parametrize(("sides", "side"), [((1, -1), 1), ((-1,), -1)])
def test_whole_and_left_wings_are_read_as_right_ones(sides, side):
    right, other = planform(swept()), planform(swept(sides=sides))
    np.testing.assert_allclose(other.stations, side * right.stations, atol=1e-12)
    for name in ("leading", "trailing"):
        np.testing.assert_allclose(
            getattr(other, name), getattr(right, name) * [1, side, 1], rtol=0, atol=1e-12
        )
    np.testing.assert_allclose(other.sweep, right.sweep, atol=1e-12)
    np.testing.assert_allclose(other.dihedral, right.dihedral, atol=1e-12)


def test_a_rounded_tip_lies_beyond_the_last_station():
    share = np.linspace(0, 1, 40)
    y = np.append(np.linspace(0, 9.8, 50)[:-1], 9.8 + 0.2 * np.sin(share * np.pi / 2))
    cap = np.append(np.ones(49), np.cos(share * np.pi / 2))
    plan = planform(wing(y, chord(y) * np.maximum(cap, 1e-6), 0.0, dihedral=0.0), 9)
    assert 9.5 <= plan.stations[-1] < 9.85
    np.testing.assert_allclose(plan.chord, chord(plan.stations), rtol=0.01)


def test_a_pointed_wing_is_read_to_near_its_point():
    plan = planform(wing(np.linspace(0, 10, 30), 4.0001 - np.linspace(0, 4, 30), 0.0), 5)
    assert 9.4 < plan.stations[-1] < 10
    np.testing.assert_allclose(plan.chord, 4.0001 - 0.4 * plan.stations, rtol=1e-3)


def test_a_root_that_is_plane_in_single_precision_only_is_whole():
    surface = swept()
    points = np.array(surface.points)
    points[:, 1] += 1e-6 * np.random.default_rng(0).uniform(-1, 1, len(points))
    assert np.all(errors(surface.moved(points), [0.0, 2.5, 10.0]) < 1e-6)


def test_only_the_named_component_is_read():
    one, other = swept(), wing([0, 5], 50.0, 0.0)
    both = ml.Surface(
        np.concatenate([one.points, other.points]),
        np.concatenate([one.faces, other.faces + len(one.points)]),
        np.repeat([0, 1], [len(one.faces), len(other.faces)]),
        ("wing", "fin"),
    )
    np.testing.assert_array_equal(planform(both, 5, "wing").chord, planform(one, 5).chord)
    with pytest.raises(GeometryError, match="no component named 'tail'"):
        planform(both, 5, "tail")


ROWS = wing(np.arange(4.0), 1.0, 0.0, section=np.array([[1, 0], [0.5, 0.1], [0, 0]]))
GAP = ml.Surface(ROWS.points, np.delete(ROWS.faces, np.r_[3:6, 12:15], axis=0))


@pytest.mark.parametrize(
    ("surface", "stations", "error", "said"),
    [
        (swept(), [0, 11.0], GeometryError, "at y = 11; the wing reaches from y = 0 to 10"),
        (swept(sides=(-1,)), [2.0], GeometryError, "at y = 2; the wing reaches from y = -10 to"),
        (swept(), [3.0, 1.0], ParameterError, "from the root outwards"),
        (swept(), [], ParameterError, "from the root outwards"),
        (swept(), 1, ParameterError, "stations are 2 to 1000, or places along y, got 1"),
        (swept(), 10**12, ParameterError, "stations are 2 to 1000"),
        (ml.Surface(swept().points[:, [0, 2, 1]], swept().faces), 3, GeometryError, "along y"),
        (ml.Surface(swept().points[:, [1, 0, 2]] * [9, 1, 1], swept().faces), 3, GeometryError,
         "along y"),
        (swept().moved(swept().points - [0, 3, 0]), 3, GeometryError, "symmetric about y = 0"),
        (swept().moved(np.full((1040, 3), np.nan)), 3, GeometryError, "finite"),
        (GAP, [1.5], GeometryError, "at y = 1.5; the surface has a gap"),
    ],
)  # fmt: skip
def test_what_is_no_wing_along_y_is_refused(surface, stations, error, said):
    with pytest.raises(error, match=said):
        planform(surface, stations)


def test_the_common_research_model_is_read_as_published(data):
    """AIAA 2008-6919 gives leading edge, twist and chord along x; the base there is blunt."""
    grid = ml.read(data("crm_wing_body_patches.xyz.gz"), units="in")
    surface, _ = stitched(grid, {"wing": [3, 4, 5, 6, 9, 10, 11, 12, 17, 18]})
    table = np.genfromtxt(MODEL, delimiter=",", names=True, skip_header=5)
    table = table[(table["eta"] >= 0.15) & (table["eta"] < 0.995)]
    plan = planform(surface, 0.0254 * table["y"], "wing")
    inches = plan.chord * np.cos(plan.twist) / 0.0254
    np.testing.assert_allclose(inches, table["chord"], rtol=2e-4)
    np.testing.assert_allclose(np.degrees(plan.twist), table["twist"], atol=0.14)
    np.testing.assert_allclose(plan.leading[:, 0] / 0.0254, table["x"], atol=0.03)
    np.testing.assert_allclose(plan.leading[:, 2] / 0.0254, table["z"], atol=0.5)


@pytest.mark.parametrize(
    ("name", "root", "tip"),
    [("su2/onera_m6_surface.stl", 0.8059, 0.4545), ("pygeo/c172.stl", 1670.9, 1182.9)],
)
def test_real_wings_are_read_from_root_to_tip(data, name, root, tip):
    """The M6's chords are 0.8059 m and, at the very tip, 0.4526 m (AGARD AR-138, 1979)."""
    surface = ml.read(data(name))
    if "c172" in name:
        surface = surface.moved(surface.points[:, [0, 2, 1]])
    plan = planform(surface)
    np.testing.assert_allclose(plan.chord[[0, -1]], [root, tip], rtol=1e-3)
