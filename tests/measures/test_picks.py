"""Spots and regions: by number, coordinates, chord and side, in a box, a ball, a component."""

import numpy as np
import pytest
from measures.simple import BOX, SIDES, naca0012, tapered
from pydantic import TypeAdapter, ValidationError

import moldline as ml
from moldline.errors import ParameterError
from moldline.measures.picks import Place, Region, chord_ends, region, spot

BLOCK = ml.Surface(BOX, SIDES, np.repeat([0, 1], 6), ("ends", "sides"))


def test_a_spot_near_coordinates_is_the_nearest_point_of_a_face():
    found = spot(BLOCK, {"near": (1.3, 0.7, 1.2)})
    np.testing.assert_allclose(found.of(BOX), [1.3, 0.7, 1.0], rtol=0, atol=1e-15)
    assert spot(BLOCK, {"near": (4.2, 2.1, 1.1)}).rows == (7,)
    far = ml.Spot.nearest(BLOCK, (1.3, 0.7, 1.2), component="ends")
    np.testing.assert_allclose(far.of(BOX), [1.3, 0, 1], rtol=0, atol=1e-15)


def test_of_a_section_it_is_on_a_segment_and_of_a_cloud_a_point():
    square = ml.Section([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], is_closed=True)
    found = ml.Spot.nearest(square, (-0.3, 0.25, 0.0))
    assert set(found.rows) == {3, 0}
    np.testing.assert_allclose(found.of(square.points), [0, 0.25, 0], rtol=0, atol=1e-15)
    assert ml.Spot.nearest(ml.Cloud(BOX), (3.0, 2.0, 0.1)).rows == (6,)


def test_numbers_of_numpy_are_numbers():
    assert ml.Spot.vertex(np.int64(3)) == ml.Spot.vertex(3)


@pytest.mark.parametrize("fraction", [0.05, 0.3, 0.7, 0.99])
def test_a_spot_at_the_chord_of_an_airfoil_is_at_its_published_height(fraction):
    foil = naca0012(400)
    x = fraction
    half = 0.6 * (0.2969 * x**0.5 - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    for side, sign in (("upper", 1), ("lower", -1)):
        place = ml.Spot.at_chord(foil, fraction, side).of(foil.points)
        np.testing.assert_allclose(place, [x, sign * half, 0], rtol=0, atol=2e-5)


@pytest.mark.parametrize("base", [0.0, 0.004])
def test_the_ends_of_the_chord_are_the_nose_and_the_corners(base):
    foil = naca0012(base=base, chord=2.0)
    for side, sign in (("upper", 1), ("lower", -1)):
        assert np.allclose(ml.Spot.at_chord(foil, 0.0, side).of(foil.points), 0, atol=1e-6)
        place = ml.Spot.at_chord(foil, 1.0, side).of(foil.points)
        np.testing.assert_allclose(place, [2, sign * base, 0], rtol=0, atol=1e-12)
    leading, trailing = (end.of(foil.points) for end in chord_ends(foil, None, None, "it"))
    np.testing.assert_allclose([leading, trailing], [[0, 0, 0], [2, 0, 0]], rtol=0, atol=1e-6)


@pytest.mark.parametrize("at", [0.0, 3.1, 10.0])
@pytest.mark.parametrize("side", ["upper", "lower"])
def test_a_spot_at_the_chord_of_a_wing_is_in_the_station_and_at_the_fraction(at, side):
    surface = tapered(base=0.01)
    points = np.asarray(surface.points)
    nose, fraction = 1.0 - 0.25 * (4 - 0.25 * at), 0.4
    for fraction in (0.0, 0.4, 1.0):
        place = ml.Spot.at_chord(surface, fraction, side, at=at).of(points)
        assert place[1] == pytest.approx(at, abs=1e-12)
        assert place[0] == pytest.approx(nose + fraction * (4 - 0.25 * at), abs=1e-4)
        sign = {"upper": 1, "lower": -1}[side] * (fraction > 0)
        assert (place[2] - 0.2) * sign > 0 or fraction == 0


def test_the_left_side_of_a_whole_wing_has_stations_too():
    from wings import wing

    whole = wing([0, 5, 10], [4, 3, 2], 0.0, sides=(1, -1))
    right, left = (ml.Spot.at_chord(whole, 0.3, "upper", at=y).of(whole.points) for y in (4, -4))
    np.testing.assert_allclose(left, right * [1, -1, 1], rtol=0, atol=1e-12)


def test_a_turned_section_is_cut_across_its_chord():
    surface = tapered(twist=0.3)
    upper, lower = (ml.Spot.at_chord(surface, 0.3, s, at=5.0) for s in ("upper", "lower"))
    across = upper.of(surface.points) - lower.of(surface.points)
    assert across[0] / across[2] == pytest.approx(np.tan(0.3), abs=2e-3)


def test_a_region_is_what_all_conditions_share():
    assert region(BLOCK, {"vertices": [5, 1]}).tolist() == [1, 5]
    assert region(BLOCK, {"inside": ((-1, -1, 0.5), (9, 9, 2))}).tolist() == [1, 3, 5, 7]
    assert region(BLOCK, {"near": (0, 0, 0), "radius": 2.1}).tolist() == [0, 1, 2]
    both = {"inside": ((-1, -1, 0.5), (9, 9, 2)), "near": (0, 0, 0), "radius": 2.1}
    assert region(BLOCK, both).tolist() == [1]
    part = ml.Surface(BOX, SIDES, np.repeat([0, 1, 2], [2, 2, 8]), ("low", "high", "sides"))
    assert region(part, {"component": "high"}).tolist() == [4, 5, 6, 7]


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ({}, "one of vertex, near and chord, got none"),
        ({"vertex": 1, "near": (0, 0, 0)}, "one of vertex, near and chord, got vertex, near"),
        ({"vertex": 1, "side": "upper"}, "by vertex does not take side"),
        ({"vertex": 8}, "vertex 8 is not there; the geometry has 8, counted from 0"),
        ({"vertex": -1}, "vertex -1 is not there"),
        ({"near": (99, 0, 0)}, r"nothing is near \(99, 0, 0\).* reaches from \(0, 0, 0\) to \(4, "),
        ({"near": (np.nan, 0, 0)}, "three coordinates"),
        ({"near": (0, 0, 0), "component": "fin"}, "no component named 'fin'; .*: ends, sides"),
    ],
)
def test_a_wrong_place_is_told(place, said):
    with pytest.raises(ParameterError, match=said):
        spot(BLOCK, place)


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ({"chord": 0.3}, "needs its side, upper or lower"),
        ({"chord": 0.3, "side": "upper"}, "say at which y, with `at`"),
        ({"chord": 1.3, "side": "upper", "at": 5.0}, "lies in 0 to 1, got 1.3"),
        ({"chord": 0.3, "side": "upper", "at": 99.0}, "the wing reaches from y = 0 to 10"),
    ],
)
def test_a_wrong_place_on_a_wing_is_told(place, said):
    with pytest.raises(ParameterError, match=said):
        spot(tapered(), place)


def test_chords_are_of_wings_and_sections_only():
    with pytest.raises(ParameterError, match="needs a surface of triangles, got a cloud"):
        spot(ml.Cloud(BOX), {"chord": 0.3, "side": "upper", "at": 1.0})
    with pytest.raises(ParameterError, match="no stations"):
        spot(naca0012(), {"chord": 0.3, "side": "upper", "at": 1.0})


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ({}, "by vertices, inside, near and radius, or component, got none"),
        ({"radius": 2.0}, "needs both near and radius"),
        ({"near": (0, 0, 0), "radius": -1.0}, "a radius is not negative, got -1"),
        ({"near": (50, 0, 0), "radius": 1.0}, r"no vertex is in .* reaches from \(0, 0, 0\) to"),
        ({"inside": ((1, 0, 0), (0, 1, 1))}, "lowest and its highest corner"),
        ({"vertices": [99]}, "vertex 99 is not there"),
        ({"component": "fin"}, "no component named 'fin'"),
    ],
)
def test_a_wrong_region_is_told(where, said):
    with pytest.raises(ParameterError, match=said):
        region(BLOCK, where)


def test_case_files_are_held_to_the_keys():
    place = TypeAdapter(Place).validate_python({"near": [1, 2, 3]})
    assert place == {"near": (1.0, 2.0, 3.0)}
    for model, given in ((Place, {"neat": 1}), (Region, {"inside": [[0, 0, 0]]})):
        with pytest.raises(ValidationError):
            TypeAdapter(model).validate_python(given)
