"""What mending does, what it leaves, and that it does no more."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from shapes import CUBE, CUBE_POINTS, cube, two_cubes

from moldline.errors import GeometryError, ParameterError
from moldline.mesh import io, quality, topology
from moldline.mesh.health import health
from moldline.mesh.mend import mended
from moldline.mesh.surface import Surface

MOEBIUS = [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4], [4, 5, 1], [5, 0, 1]]
"""A strip of three quadrangles whose last edge 4-5 meets its first as 1-0."""


def tube(sides=12):
    """An open cylinder about z, its faces outward, as points and faces."""
    angles = np.arange(sides) * 2 * np.pi / sides
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    here = np.arange(sides)
    over = (here + 1) % sides
    faces = [[here, over, here + sides], [over, over + sides, here + sides]]
    points = np.vstack([ring, ring + np.array([0, 0, 3.0])])
    return points, np.concatenate([np.stack(part, axis=1) for part in faces])


def turned(faces, numbers):
    faces = np.array(faces)
    faces[numbers] = faces[numbers][:, ::-1]
    return faces


def test_a_sound_surface_comes_back_itself(ball):
    for sound in (cube(), ball):
        result, report = mended(sound)
        assert result is sound
        assert not report.is_change
        assert report.sentences() == report.left() == []


def test_points_in_one_place_are_welded_and_their_data_with_them():
    soup = CUBE_POINTS[CUBE].reshape(-1, 3)
    heat = soup @ [1.0, 10.0, 100.0]
    tags = np.arange(12) % 2
    surface = Surface(
        soup,
        np.arange(36).reshape(-1, 3),
        tags,
        ("left", "right"),
        {"heat": heat},
        {"number": np.arange(12)},
    )
    result, report = mended(surface)
    assert len(report.welded_points) == 28
    assert health(result).is_sound
    assert result.components == ("left", "right")
    np.testing.assert_array_equal(result.tags, tags)
    np.testing.assert_array_equal(result.points[result.faces], CUBE_POINTS[CUBE])
    np.testing.assert_array_equal(result.point_data["heat"], result.points @ [1.0, 10.0, 100.0])
    np.testing.assert_array_equal(result.face_data["number"], np.arange(12))


def test_points_apart_are_welded_only_within_the_tolerance():
    soup = CUBE_POINTS[CUBE].reshape(-1, 3)
    soup = soup + np.random.default_rng(0).uniform(-1e-4, 1e-4, soup.shape)
    surface = Surface(soup, np.arange(36).reshape(-1, 3))
    assert mended(surface)[0] is surface
    assert mended(surface, weld=1e-5)[0] is surface
    result, _ = mended(surface, weld=1e-3)
    assert len(result.points) == 8
    assert health(result).is_sound


def test_faces_that_collapse_when_they_are_welded_are_dropped():
    points, faces = tube()
    points[1] = points[0] + np.array([0, 1e-6, 0])
    result, report = mended(Surface(points, faces), weld=1e-5)
    assert report.welded_points.tolist() == [1]
    assert report.collapsed_faces.tolist() == [0]
    assert len(result.faces) == len(faces) - 1
    assert len(topology.edges(result.faces).open) == 23


@pytest.mark.parametrize("tolerance", [-1.0, np.nan, np.inf])
def test_a_tolerance_that_is_no_length_is_refused(tolerance):
    with pytest.raises(ParameterError, match="must be a finite length, got"):
        mended(cube(), weld=tolerance)


def test_a_tolerance_that_joins_everything_is_refused(ball):
    with pytest.raises(ParameterError, match="joins each point to 1025 others on average; it must"):
        mended(ball, weld=10.0)


def test_faces_that_repeat_one_are_dropped_and_those_back_to_back_left():
    faces = np.vstack([CUBE, CUBE[3:4], CUBE[3:4, [1, 2, 0]]])
    result, report = mended(Surface(CUBE_POINTS, faces))
    assert report.duplicate_faces.tolist() == [12, 13]
    assert health(result).is_sound
    wall = Surface(CUBE_POINTS, np.vstack([CUBE, CUBE[3:4, ::-1]]))
    result, report = mended(wall)
    assert result is wall
    assert report.left() == ["1 face left that lies back to back with an earlier one (first: 12)"]


def test_faces_without_area_go_only_where_no_hole_is_left():
    line = np.array([[5, 0, 0], [6, 0, 0], [7, 0, 0], [8, 0, 0]], float)
    points = np.vstack([CUBE_POINTS, line])
    apart = Surface(points, np.vstack([CUBE, [[8, 9, 10], [10, 9, 11]]]))
    result, report = mended(apart)
    assert report.flat_faces.tolist() == [12, 13]
    assert report.unused_points.tolist() == [8, 9, 10, 11]
    assert health(result).is_sound
    # a flat face that closes a slit: the top's diagonal gets a point that its other side lacks
    middle = np.vstack([CUBE_POINTS, [[0.5, 0.5, 1]]])
    top = [[4, 5, 6], [4, 6, 8], [4, 8, 7], [8, 6, 7]]
    slit = Surface(middle, np.vstack([np.delete(CUBE, [2, 3], axis=0), top]))
    assert health(slit).is_closed
    result, report = mended(slit)
    assert result is slit
    assert report.left_flat_faces.tolist() == [11]
    assert "the neighbours would come apart" in report.left()[0]


def test_neighbours_are_turned_to_agree_and_look_outward(ball):
    random = np.random.default_rng(3)
    numbers = np.flatnonzero(random.random(len(ball.faces)) < 0.7)  # so most look inward
    result, report = mended(Surface(ball.points, turned(ball.faces, numbers)))
    assert report.turned_faces.tolist() == numbers.tolist()
    assert health(result).is_sound
    np.testing.assert_allclose(quality.signed_volume(result), quality.signed_volume(ball))


def test_an_open_surface_is_turned_to_the_side_it_bulges_to():
    points, faces = tube()
    result, report = mended(Surface(points, turned(faces, np.arange(1, 24))))
    assert report.turned_faces.tolist() == list(range(1, 24))
    assert health(result).is_oriented
    assert quality.signed_volume(result) > 0


def test_a_flat_sheet_keeps_the_side_of_most_of_its_faces():
    sheet = Surface(CUBE_POINTS, turned([[0, 1, 2], [0, 2, 3], [0, 3, 7], [3, 2, 6]][:2], [1]))
    result, report = mended(sheet)
    assert report.turned_faces.tolist() == [1]  # a tie goes to the first
    grid = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]], float)
    faces = [[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4]]
    result, report = mended(Surface(grid, turned(faces, [0])))
    assert report.turned_faces.tolist() == [0]
    assert health(result).is_oriented


def test_an_open_surface_whose_faces_agree_is_left():
    points, faces = tube()
    inward = Surface(points, faces[:, ::-1])
    assert mended(inward)[0] is inward


def test_each_closed_piece_is_turned_outward_but_a_cavity_inward():
    points = np.vstack([CUBE_POINTS, CUBE_POINTS + 3.0])
    faces = turned(two_cubes([]), np.arange(12, 24))
    result, report = mended(Surface(points, faces))
    assert report.turned_faces.tolist() == list(range(12, 24))
    assert health(result).volume == pytest.approx(2.0)
    hollow = np.vstack([CUBE_POINTS, CUBE_POINTS / 4 + 0.3])
    cavity = Surface(hollow, faces)
    assert health(cavity).is_sound
    assert health(cavity).volume == pytest.approx(1 - 1 / 64)
    assert mended(cavity)[0] is cavity
    both = mended(Surface(hollow, two_cubes([])[:, ::-1]))[0]
    assert health(both).volume == pytest.approx(1 - 1 / 64)


def test_a_strip_with_one_side_is_left_and_said():
    points = np.random.default_rng(1).random((6, 3))
    strip = Surface(points, MOEBIUS)
    assert not topology.turns(strip.faces).is_orientable.any()
    result, report = mended(strip)
    assert result is strip
    assert report.left() == ["6 faces left on a strip that has only one side (first: 0)"]


def test_points_of_no_face_are_dropped():
    points = np.vstack([[[9, 9, 9]], CUBE_POINTS, [[7, 7, 7]]])
    result, report = mended(Surface(points, CUBE + 1))
    assert report.unused_points.tolist() == [0, 9]
    np.testing.assert_array_equal(result.points, CUBE_POINTS)
    np.testing.assert_array_equal(result.faces, CUBE)


def test_what_would_be_a_guess_is_left():
    for surface in (
        Surface(CUBE_POINTS, CUBE[1:]),
        Surface(np.tile(CUBE_POINTS, (2, 1)) + np.repeat([[0.0], [0.4]], 8, 0), two_cubes([])),
        Surface(np.array([*CUBE_POINTS[:4], [9, 9, 9]]), [[0, 1, 2], [0, 1, 3], [0, 1, 4]]),
    ):
        found = health(mended(surface)[0])
        assert not found.is_sound
        assert found.sentences() == health(surface).sentences()


def test_points_that_are_not_finite_are_refused():
    points = CUBE_POINTS.copy()
    points[3, 1] = np.nan
    with pytest.raises(GeometryError, match=r"1 of 8 points are not finite \(first: 3\)"):
        mended(Surface(points, CUBE))


def test_a_real_wing_whose_lower_half_was_turned_over_is_mended(data):
    wing = io.read(data("pygeo/c172.stl"))
    assert len(health(wing).misoriented_edges) == 42
    result, report = mended(wing)
    found = health(result)
    assert found.is_oriented
    assert len(found.open_edges) == 33  # the root is open, and a small triangle
    assert len(report.turned_faces) == 1906
    assert quality.signed_volume(result) > 0


def test_a_report_goes_through_json():
    plain = mended(Surface(CUBE_POINTS, turned(CUBE, [4, 5, 6])))[1].as_dict(places=2)
    assert plain["is_change"] is True
    assert plain["counts"]["turned_faces"] == 3
    assert plain["places"]["turned_faces"] == [4, 5]


@settings(max_examples=80, deadline=None)
@given(
    arrays(np.int64, (9, 3), elements=st.integers(0, 2)),
    st.lists(st.tuples(*[st.integers(0, 8)] * 3), max_size=14),
    st.sampled_from([0.0, 1.0]),
)
def test_mending_a_second_time_changes_nothing(points, faces, weld):
    surface = Surface(points.astype(float), np.array(faces, int).reshape(-1, 3))
    result, _ = mended(surface, weld)
    again, report = mended(result, weld)
    assert again is result and not report.is_change
    found = health(result)
    assert not len(found.duplicate_vertices) and not len(found.duplicate_faces)
    assert not len(found.unused_vertices) and not len(found.inside_out_pieces)
    if not len(report.left_unorientable_faces):
        assert found.is_oriented


@settings(max_examples=40, deadline=None)
@given(st.lists(st.booleans(), min_size=12, max_size=12), st.integers(0, 2), st.randoms())
def test_a_cube_that_was_spoilt_is_restored(is_turned, copies, random):
    order = list(range(12))
    random.shuffle(order)
    faces = turned(CUBE, np.array(is_turned))
    soup = np.vstack([CUBE_POINTS[faces[order]].reshape(-1, 3), [[8, 8, 8]]])
    numbers = np.vstack([np.arange(36).reshape(-1, 3)] * (copies + 1))
    result, _ = mended(Surface(soup, numbers))
    assert health(result).is_sound
    assert health(result).volume == pytest.approx(1.0)
    assert len(result.faces) == 12
