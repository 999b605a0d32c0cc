"""Body skeletons: lengths, radii, heights and droop of a fuselage."""

import numpy as np
import pytest
from wings import body

import moldline as ml
from moldline.deformers.body_skeleton import BodySkeleton
from moldline.deformers.contract import check
from moldline.errors import GeometryError, ParameterError
from moldline.mesh.slices import section

CABIN = {"nose": 5.0, "tail": 12.0}


def moved(skeleton, surface, **changes):
    controls = np.zeros(skeleton.size)
    for name, change in changes.items():
        controls[skeleton.parameters[name]] = change
    return surface.moved(np.asarray(skeleton.bind(surface.points)(controls)))


def extents(surface, at):
    """Half width, half height and middle in z of a section."""
    y, z = np.concatenate(section(surface.points, surface.faces, "x", at))[:, 1:].T
    return np.array([y.max(), np.ptp(z) / 2, (z.max() + z.min()) / 2])


@pytest.mark.parametrize("loft", ["linear", "cubic"])
def test_lengths_change_by_what_is_asked_for(loft):
    surface = body()
    skeleton = BodySkeleton.fitted(surface, 9, **CABIN, loft=loft)
    np.testing.assert_allclose(skeleton.values[:3], [5, 7, 8], atol=1e-12)
    after = moved(skeleton, surface, nose=1.0, cabin=2.0, tail=-1.5)
    x = np.asarray(after.points)[:, 0]
    np.testing.assert_allclose([x.min(), x.max()], [-1, 20.5], rtol=0, atol=1e-12)
    ends = np.array([[5.0, 0, 0], [12, 0, 0]])
    there = np.asarray(skeleton.bind(ends)(np.repeat([1.0, 2, -1.5, 0], [1, 1, 1, 20])))
    np.testing.assert_allclose(there[:, 0], [5, 14], rtol=0, atol=1e-12)


def test_a_radius_scales_the_section_about_its_centre():
    surface = body()
    stations = [0.5, 2.0, 5.0, 8.0, 12.0, 16.0, 19.0]
    skeleton = BodySkeleton.fitted(surface, stations, **CABIN)
    change = np.array([0, 0.1, 0.2, -0.1, 0, 0.1, 0])
    after = moved(skeleton, surface, radius=change)
    for at, delta in zip(stations, change, strict=True):
        before, found = extents(surface, at), extents(after, at)
        np.testing.assert_allclose(found[:2].mean() - before[:2].mean(), delta, atol=5e-3)
        np.testing.assert_allclose(found[0] / found[1], before[0] / before[1], rtol=1e-6)
        np.testing.assert_allclose(found[2], before[2], atol=1e-3)


def test_at_rows_of_points_the_radius_is_exact():
    surface = body()
    x = np.unique(np.asarray(surface.points)[:, 0])[[8, 20, 30, 36, 50]]
    skeleton = BodySkeleton.fitted(surface, x, nose=x[1], tail=x[3], loft="linear")
    change = np.array([0.1, 0.2, -0.1, 0, 0.1])
    after = moved(skeleton, surface, radius=change, height=-change)
    for at, radius, delta in zip(x, skeleton.net.scales, change, strict=True):
        found, before = extents(after, at), extents(surface, at)
        np.testing.assert_allclose(found[:2].mean(), radius + delta, rtol=0, atol=1e-12)
        np.testing.assert_allclose(found[2], before[2] - delta, rtol=0, atol=1e-12)


def test_droop_lowers_the_nose_and_upsweep_lifts_the_tail():
    skeleton = BodySkeleton.fitted(body(), 9, **CABIN)
    places = np.array([[-1.0, 0, 0], [0, 0, 0], [5, 0, 0], [8, 0.5, 1], [12, 0, 0], [20, 0, 0]])
    controls = np.zeros(skeleton.size)
    controls[-2:] = [0.4, 0.7]
    lift = np.asarray(skeleton.bind(places)(controls)) - places
    assert np.all(lift[:, :2] == 0)
    np.testing.assert_allclose(lift[[0, 1, 2, 4, 5], 2], [-0.4, -0.4, 0, 0, 0.7], atol=1e-12)
    assert abs(lift[3, 2]) < 0.02


def test_rest_droop_and_upsweep_are_the_body_s():
    skeleton = BodySkeleton.fitted(body(lift=0.5), 9, **CABIN)
    droop, upsweep = skeleton.values[-2:]
    assert droop == pytest.approx(0, abs=1e-3)
    assert 0.4 < upsweep < 0.5  # up to the last station, where the tail still has a size


def test_a_half_body_stays_on_its_plane_and_is_half_of_the_whole():
    half, whole = body(), body(around=64, end=2 * np.pi)
    skeletons = [BodySkeleton.fitted(s, 7, **CABIN) for s in (half, whole)]
    np.testing.assert_allclose(skeletons[0].values, skeletons[1].values, atol=1e-12)
    controls = np.random.default_rng(0).uniform(-0.3, 0.3, skeletons[0].size)
    after = [np.asarray(k.bind(s.points)(controls)) for k, s in
             zip(skeletons, (half, whole), strict=True)]  # fmt: skip
    on_plane = np.asarray(half.points)[:, 1] == 0
    assert on_plane.sum() >= 2 * 61 and np.all(after[0][on_plane, 1] == 0)
    rows = after[1].reshape(61, 65, 3)
    np.testing.assert_allclose(rows[:, :33], after[0].reshape(61, 33, 3), rtol=0, atol=1e-12)
    np.testing.assert_allclose(rows[:, ::-1] * [1, -1, 1], rows, rtol=0, atol=1e-12)


def test_the_cabin_is_found_where_sections_are_nearly_the_largest():
    skeleton = BodySkeleton.fitted(body())
    nose, cabin, tail = skeleton.lengths
    assert 3 < nose < 4 and 13.5 < nose + cabin < 14.5
    assert nose + cabin + tail == pytest.approx(20)
    assert len(skeleton.net.stations) == 7


def test_a_body_skeleton_keeps_the_contract():
    """Points between neighbouring stations."""
    skeleton = BodySkeleton.fitted(body(), 6, **CABIN)
    gaps = np.diff(skeleton.net.stations)
    start = skeleton.net.stations[np.argmax(gaps)]
    low, high = [start + 0.2 * gaps.max(), -2, -2], [start + 0.8 * gaps.max(), 2, 2]
    check(skeleton, np.random.default_rng(0).uniform(low, high, (60, 3)))


def test_controls_are_named():
    skeleton = BodySkeleton.build(body(), stations=8, **CABIN)
    counts = {name: len(rows) for name, rows in skeleton.parameters.items()}
    assert counts == {
        "nose": 1, "cabin": 1, "tail": 1, "radius": 8, "height": 8, "droop": 1, "upsweep": 1
    }  # fmt: skip
    assert skeleton.size == len(skeleton.values) == 21


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: BodySkeleton.fitted(body(), 3), "stations are 4 to 1000"),
        (lambda: BodySkeleton.fitted(body(), 10**10), "stations are 4 to 1000"),
        (lambda: BodySkeleton.fitted(body(), nose=30.0), "must lie inside the body"),
        (lambda: BodySkeleton.fitted(body(), [6.0, 7.0], nose=5, tail=12), "and not reach them"),
        (lambda: BodySkeleton.fitted(body(), [1, 30.0], **CABIN), "no section at x = 30; the body"),
        (lambda: BodySkeleton.fitted(body(), [0, 19.0], **CABIN), "may end in a point there"),
        (lambda: BodySkeleton.fitted(body(), 7, "wing"), "no component named 'wing'"),
        (lambda: BodySkeleton.fitted(ml.Grid(np.zeros((8, 3)), ((2, 2, 2),))), "got a Grid"),
        (
            lambda: BodySkeleton.fitted(ml.Surface(body().points[:, [1, 0, 2]], body().faces)),
            "must run along x",
        ),
    ],
)
def test_what_is_no_body_skeleton_is_refused(make, said):
    with pytest.raises((GeometryError, ParameterError), match=said):
        make()
