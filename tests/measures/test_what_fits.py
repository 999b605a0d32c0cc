"""Clearances and what is enclosed: closed forms, and searches against brute force."""

import itertools

import numpy as np
import pytest
from measures.simple import BOX, SIDES

import moldline as ml
from moldline.measures import Clearance, Enclosed
from moldline.measures.enclosed import box_points
from moldline.numerics.closest import closest, nearest, tree
from moldline.numerics.nearest import nearest as by_trying_all


def numbers(measure, points=BOX):
    return np.asarray(measure(points))


def test_depth_is_the_distance_from_the_nearest_side_negative_outside():
    points = [[2.1, 1.1, 0.4], [0.1, 0.7, 0.6], [2.0, 0.9, 1.2], [-3.0, -4.0, 0.5], [5.0, 3.0, 2.0]]
    found = numbers(Enclosed(SIDES, points))
    np.testing.assert_allclose(found, [0.4, 0.1, -0.2, -5.0, -np.sqrt(3)], rtol=1e-14)


def test_depth_grows_with_the_side_that_is_nearest():
    import jax

    measure = Enclosed(SIDES, [[2.1, 1.1, 0.4]])
    up = jax.grad(lambda z: measure(BOX + np.array([0, 0, 1.0]) * z)[0])(0.0)
    assert float(up) == pytest.approx(-1.0)


def test_inside_is_told_where_the_nearest_point_is_an_edge_or_corner_and_the_surface_is_open():
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 5, (200, 3)) * np.array([1, 0.5, 0.3])
    whole = numbers(Enclosed(SIDES, points))
    inside = np.all((points > 0) & (points < [4, 2, 1]), axis=1)
    assert np.array_equal(whole > 0, inside)
    open_ended = numbers(Enclosed(SIDES[2:], points))  # without its side at x = 0
    far = np.abs(whole) < np.abs(points[:, 0]) - 1e-9
    assert np.allclose(open_ended[far], whole[far])


def test_an_unwelded_surface_encloses_the_same():
    apart, own = BOX[SIDES].reshape(-1, 3), np.arange(36).reshape(-1, 3)
    points = np.random.default_rng(1).uniform(-1, 3, (100, 3))
    np.testing.assert_allclose(
        numbers(Enclosed(own, points), apart), numbers(Enclosed(SIDES, points)), rtol=1e-13
    )


def test_a_box_that_sticks_out_between_its_corners_is_found():
    """Through a roof with a valley: all its corners are inside."""
    points = np.array(
        [[x, y, z] for x in (0, 1, 2) for y in (0, 1) for z in (0, 1 if x != 1 else 0.4)], float
    )
    rows = [0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]
    faces = []
    for one, two in itertools.pairwise(rows):
        ring = [(0, 1), (1, 3), (3, 2), (2, 0)]
        for a, b in ring:
            faces += [[one[a], two[a], two[b]], [one[a], two[b], one[b]]]
    faces += [[0, 1, 3], [0, 3, 2], [8, 11, 9], [8, 10, 11]]
    faces = np.array(faces)
    if ml.measures.Volume(faces)(points)[0] < 0:
        faces = faces[:, ::-1]
    corners = [[0.1, 0.2, 0.1], [1.9, 0.8, 0.6]]
    only_corners = Enclosed(faces, box_points(corners, 2))
    assert numbers(only_corners, points).min() > 0
    assert numbers(Enclosed.box(faces, corners), points).min() < -0.1


def test_eight_corners_make_a_swept_box():
    two = box_points([[0, 0, 0], [1, 2, 3]], 4)
    assert len(two) == 4**3 - 2**3
    eight = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], float)
    np.testing.assert_allclose(box_points(eight, 4), two)
    swept = eight + np.outer(eight[:, 1], [0.5, 0, 0])
    np.testing.assert_allclose(box_points(swept, 4), two + np.outer(two[:, 1], [0.5, 0, 0]))


@pytest.mark.parametrize(
    ("move", "distance"),
    [
        ([6.0, 0.1, 0.2], 2.0),  # face to face
        ([5.0, 3.0, 0.2], np.sqrt(2)),  # edge to edge along it
        ([5.0, 3.0, 2.0], np.sqrt(3)),  # corner to corner
        ([1.0, 0.3, 0.4], -0.3),  # into each other: a corner is 0.3 behind a side
    ],
)
def test_boxes_are_as_far_apart_as_their_sides(move, distance):
    measure = Clearance(SIDES, BOX + np.array(move), SIDES)
    np.testing.assert_allclose(numbers(measure), [distance], rtol=1e-13)


def test_crossed_edges_are_nearest_between_their_ends():
    one = np.array([[-1.0, 0, 0], [1, 0, 0], [0, 0, -1]])
    other = np.array([[0, -1.0, 0.3], [0, 1, 0.3], [0, 0, 2]])
    face = np.array([[0, 1, 2]])
    np.testing.assert_allclose(numbers(Clearance(face, other, face), one), [0.3], rtol=1e-14)


def test_one_within_the_other_is_clear_of_it_and_one_through_the_other_is_not(ball):
    points, faces = np.asarray(ball.points), np.asarray(ball.faces)
    within = Clearance(faces, 0.5 * points, faces)
    assert numbers(within, points) == pytest.approx([0.5], abs=5e-3)
    needle = np.array([[0, 0, -2.0], [0.01, 0, 2.0], [-0.01, 0.01, 2.0]])
    through = Clearance(faces, needle, np.array([[0, 1, 2]]))
    assert numbers(through, points) == 0.0


def test_the_pair_that_is_found_is_the_closest_of_all():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(60, 3)), rng.normal(size=(48, 3)) + np.array([5.5, 0, 0])
    one, other = np.arange(60).reshape(-1, 3), np.arange(48).reshape(-1, 3)
    found = closest(a, one, tree(b, other))
    best = min(_apart(a[i], b[j]) for i in one for j in other)
    assert found.distance == pytest.approx(best, rel=1e-9)
    places = rng.normal(size=(50, 3))
    tried, searched = by_trying_all(places, b, other), nearest(places, tree(b, other))
    np.testing.assert_array_equal(tried.distances, searched.distances)
    np.testing.assert_array_equal(tried.faces, searched.faces)


def _apart(one, other):
    """Distance of two triangles: from points along all edges to the other's face."""
    face, share = np.array([[0, 1, 2]]), np.linspace(0, 1, 400)[:, None]
    best = np.inf
    for p, q in ((one, other), (other, one)):
        if np.linalg.norm(p.mean(axis=0) - q.mean(axis=0)) > 6.5:
            continue  # too far to matter
        for i in range(3):
            line = (1 - share) * p[i] + share * p[(i + 1) % 3]
            found = by_trying_all(line, q, face)
            k = int(found.distances.argmin())
            low, high = line[max(k - 1, 0)], line[min(k + 1, len(line) - 1)]
            for _ in range(4):
                line = (1 - share) * low + share * high
                found = by_trying_all(line, q, face)
                k = int(found.distances.argmin())
                low, high = line[max(k - 1, 0)], line[min(k + 1, len(line) - 1)]
            best = min(best, float(found.distances.min()))
    return best


def test_a_hundred_thousand_faces_against_ten_thousand_are_no_matter(ball):
    """Two wavy sheets; also through a jit."""
    import jax

    def sheet(count, height):
        x, y = np.meshgrid(*2 * [np.linspace(0, 1, count)], indexing="ij")
        points = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
        a = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
        faces = [np.stack([a, a + count, a + count + 1], 1), np.stack([a, a + count + 1, a + 1], 1)]
        return points, np.concatenate(faces)

    points, faces = sheet(225, lambda x, y: 0.01 * np.sin(9 * x))
    other, its = sheet(71, lambda x, y: 0.3 + 0.02 * np.cos(8 * x + 3 * y))
    assert len(faces) > 100_000 and len(its) == 9800
    measure = Clearance(faces, other, its)
    value, slope = jax.jit(jax.value_and_grad(lambda p: measure(p)[0]))(points)
    assert 0.26 < value < 0.3
    assert np.count_nonzero(np.any(np.asarray(slope) != 0, axis=1)) <= 3
    np.testing.assert_allclose(np.linalg.norm(np.asarray(slope).sum(axis=0)), 1.0, rtol=1e-9)


def test_second_derivatives_are_exact_too(ball):
    """Found pairs are differentiated as planes, lines and points, not as fixed places."""
    import jax

    rng = np.random.default_rng(0)
    points = np.asarray(ball.points) + 1e-3 * rng.normal(size=ball.points.shape)
    along, step = 1e-3 * rng.normal(size=points.shape), 1e-3
    for measure in (
        Enclosed(ball.faces, [[0.5, 0.31, 0.1], [0.02, 0.03, 1.4]]),
        Clearance(ball.faces, 0.5 * points + np.array([2.0, 0.7, 0.4]), ball.faces),
    ):
        slope = jax.grad(lambda p, m=measure: m(p).sum())
        exact = jax.jvp(slope, (points,), (along,))[1]
        about = (slope(points + step * along) - slope(points - step * along)) / (2 * step)
        np.testing.assert_allclose(exact, about, rtol=0, atol=1e-7 * np.abs(about).max())
