"""Where surfaces run through themselves."""

import itertools
import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import linprog
from shapes import CUBE, CUBE_POINTS, cube, two_cubes

from moldline.mesh import io
from moldline.mesh.intersections import self_intersections
from moldline.mesh.topology import weld

LEVEL = [[0, 0, 0], [2, 0, 0], [0, 2, 0]]


def pairs(points, faces=None):
    """Crossing pairs of faces, by default of triangles that follow each other."""
    points = np.array(points, float)
    faces = np.arange(len(points)).reshape(-1, 3) if faces is None else faces
    return self_intersections(points, np.array(faces)).pairs.tolist()


def meets_inside(one, other):
    """Whether a triangle's inside has a point in common with another; by linear programming.

    Of the points of `one` that lie in `other` it finds the one whose smallest barycentric
    coordinate is largest.
    """
    equal = np.zeros((5, 7))
    equal[:3, :3], equal[:3, 3:6] = one.T, -other.T
    equal[3, :3] = equal[4, 3:6] = 1.0
    margin = np.hstack([-np.eye(3), np.zeros((3, 3)), np.ones((3, 1))])
    bounds = [(None, None)] * 3 + [(0, None)] * 3 + [(None, 1)]
    found = linprog([0] * 6 + [-1], margin, np.zeros(3), equal, [0, 0, 0, 1, 1], bounds)
    return found.status == 0 and -found.fun > 1e-9


def brute_force(points, faces):
    """Every pair that crosses, each pair looked at."""
    kept, index = weld(points)
    points, faces = points[kept], index[faces]
    a, b, c = (points[faces[:, i]] for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    found = []
    for i, j in itertools.combinations(np.flatnonzero(areas > 0).tolist(), 2):
        if len(set(faces[i]) & set(faces[j])) < 2:
            one, other = points[faces[i]], points[faces[j]]
            if meets_inside(one, other) or meets_inside(other, one):
                found.append([i, j])
    return found


@pytest.mark.parametrize(
    ("second", "crosses"),
    [
        ([[0.5, 0.5, -1], [0.5, 0.5, 1], [0.7, 0.5, 1]], True),
        ([[0.5, 0.5, 0], [0.5, 0.5, 1], [0.7, 0.5, 1]], True),  # a corner on the inside
        ([[0.5, 0.2, 0], [0.2, 0.5, 0], [0.7, 0.5, 1]], True),  # an edge on the inside
        ([[0.5, 0.5, 1e-12], [0.5, 0.5, 1], [0.7, 0.5, 1]], False),
        ([[0.5, 0, 0], [0.5, -1, 1], [0.5, -1, -1]], False),  # a corner on an edge
        ([[-1, 0, 0], [3, 0, 0], [1, -1, 1]], False),  # an edge on an edge
        ([[1, -1, 1], [1, -1, -1], [1, 1e-9, 0]], True),
        ([[5, 5, -1], [5, 5, 1], [6, 5, 0]], False),
    ],
)
def test_triangles_cross_if_they_meet_inside_one_of_them(second, crosses):
    for turn in range(3):
        turned = second[turn:] + second[:turn]
        for other in (turned, turned[::-1]):
            assert pairs(LEVEL + other) == ([[0, 1]] if crosses else [])
            assert pairs(other + LEVEL) == ([[0, 1]] if crosses else [])


@pytest.mark.parametrize(
    ("second", "overlaps"),
    [
        ([[0.5, 0.5, 0], [3, 0.5, 0], [0.5, 3, 0]], True),
        ([[0.5, 0.5, 0], [0.7, 0.5, 0], [0.5, 0.7, 0]], True),  # one within the other
        ([[1, 1, 0], [3, 0, 0], [3, 3, 0]], False),  # a corner on an edge
        ([[3, 3, 0], [1.5, 0.5, 0], [0.5, 1.5, 0]], False),  # an edge on an edge
        ([[1.2, 1.2, 0], [3, 0, 0], [3, 3, 0]], False),
        ([[1.2, 1.2, 0], [-1, -1, 0], [3, 3, 1]], True),
    ],
)
def test_triangles_in_one_plane_overlap_if_they_have_area_in_common(second, overlaps):
    for axes in itertools.permutations(range(3)):
        both = np.array(LEVEL + second, float)[:, axes]
        assert pairs(both) == ([[0, 1]] if overlaps else [])


@pytest.mark.parametrize(
    ("far", "crosses"),
    [
        ([[1, 0.5, -1], [1, 0.5, 1]], True),
        ([[-1, 0.5, -1], [-1, 0.5, 1]], False),
        ([[2, 1, 0], [1, 3, 0]], True),  # in one plane, over each other
        ([[-2, -1, 0], [-1, -3, 0]], False),
        ([[1, 0.5, 0], [1, 0.5, 1]], True),  # an edge from the shared corner along the inside
    ],
)
def test_triangles_that_share_a_corner_may_cross_beyond_it(far, crosses):
    points = np.array([*LEVEL, *far], float)
    expected = [[0, 1]] if crosses else []
    assert pairs(points, [[0, 1, 2], [0, 3, 4]]) == expected
    assert pairs(points[[0, 1, 2, 0, 3, 4]]) == expected  # the corner need not be welded


def test_neighbours_never_cross_however_they_are_folded():
    points = [[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 0.9, 0], [0.5, 0.5, 0.5]]
    assert pairs(points, [[0, 1, 2], [1, 0, 3]]) == []
    assert pairs(points, [[0, 1, 2], [1, 0, 4]]) == []
    assert pairs(points, [[0, 1, 2], [2, 1, 0]]) == []


def test_two_cubes_cross_along_a_known_hexagon():
    second = CUBE_POINTS + np.array([0.5, 0.25, 0.125])
    points, faces = np.vstack([CUBE_POINTS, second]), two_cubes([])
    found = self_intersections(points, faces)
    assert found.pairs.tolist() == brute_force(points, faces)
    assert np.all((found.pairs < 12) == [True, False])
    on_first, on_second = found.places, found.places - np.array([0.5, 0.25, 0.125])
    for inside in (on_first, on_second):
        assert np.all((inside >= -1e-12) & (inside <= 1 + 1e-12))
        assert np.all(np.min(np.abs(np.hstack([inside, inside - 1])), axis=1) < 1e-12)


def test_a_spike_through_a_tetrahedron_crosses_two_of_its_faces():
    tetrahedron = np.array([[0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]], float)
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [4, 5, 6]]
    spike = [[0.5, 0.6, -1], [0.52, 0.6, -1], [0.5, 0.6, 9]]  # in at z = 0, out at x + y + z = 3
    found = self_intersections(np.vstack([tetrahedron, spike]), np.array(faces))
    assert found.pairs.tolist() == [[0, 4], [3, 4]]
    np.testing.assert_allclose(found.places[:, 1], 0.6)
    assert found.places[0, 2] == pytest.approx(0)
    assert found.places[1].sum() == pytest.approx(3)


@pytest.mark.parametrize("name", ["pygeo/bwb.stl", "pygeo/c172.stl", "su2/onera_m6_surface.stl"])
def test_real_wings_do_not_cross_themselves_until_a_point_is_pulled_through(data, name):
    wing = io.read(data(name))
    assert len(self_intersections(wing.points, wing.faces).pairs) == 0
    points = wing.points.copy()
    low, high = points.min(axis=0), points.max(axis=0)
    inner = np.argmin(np.abs(points - (low + high) / 2).sum(axis=1))
    points[inner] += 2 * (points.mean(axis=0) - points[inner]) + 0.3 * (high - low)
    found = self_intersections(points, wing.faces).pairs
    assert len(found)
    assert np.any(wing.faces[found] == inner, axis=(1, 2)).all()  # the rest is still sound


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1.0, 1e30, 1e200])
def test_the_unit_does_not_matter(scale):
    second = CUBE_POINTS + np.array([0.5, 0.25, 0.125])
    points = np.vstack([CUBE_POINTS, second])
    assert pairs(points * scale, two_cubes([])) == pairs(points, two_cubes([]))


def test_a_large_offset_makes_no_intersections_where_faces_only_touch(ball):
    assert pairs(ball.points / 7 + 1e9, ball.faces) == []


@settings(max_examples=25, deadline=None)
@given(
    arrays(np.int64, (24, 3), elements=st.integers(0, 3)),
    st.lists(st.tuples(*[st.integers(0, 23)] * 3), min_size=2, max_size=9),
)
def test_triangles_with_corners_on_a_grid_are_told_as_by_linear_programming(points, faces):
    # on a grid every way to touch and to overlap comes up
    points, faces = points.astype(float), np.array(faces)
    assert pairs(points, faces) == brute_force(points, faces)


def test_of_many_triangles_with_corners_on_a_grid_the_same_cross_as_by_linear_programming():
    random = np.random.default_rng(2)
    points, faces = random.integers(0, 4, (90, 3)).astype(float), np.arange(90).reshape(-1, 3)
    expected = brute_force(points, faces)
    assert 30 < len(expected) < 300
    assert pairs(points, faces) == expected


def test_the_tree_finds_what_looking_at_every_pair_finds():
    random = np.random.default_rng(5)
    centres = random.uniform(0, 1, (70, 1, 3)) ** 3  # crowded at one corner
    corners = centres + random.normal(0, 1, (70, 3, 3)) * random.uniform(0.05, 0.3, (70, 1, 1))
    faces = np.arange(210).reshape(-1, 3)
    every = itertools.combinations(range(70), 2)
    alone = [[i, j] for i, j in every if pairs(corners[[i, j]].reshape(-1, 3))]
    assert 50 < len(alone) < 1000
    found = self_intersections(corners.reshape(-1, 3), faces)
    assert found.pairs.tolist() == alone
    for (i, j), place in zip(found.pairs.tolist(), found.places, strict=True):
        for one in (corners[i], corners[j]):
            weights = np.linalg.lstsq(np.vstack([one.T, np.ones(3)]), [*place, 1], rcond=None)[0]
            assert weights.min() > -1e-9
            np.testing.assert_allclose(weights @ one, place, atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.float64, (12, 3), elements=st.floats(width=64)),
    st.lists(st.tuples(*[st.integers(0, 11)] * 3), max_size=20),
)
def test_no_soup_makes_it_fail(points, faces):
    found = self_intersections(points, np.array(faces, int).reshape(-1, 3))
    assert np.isfinite(points[np.array(faces, int).reshape(-1, 3)[found.pairs]]).all()


def test_corners_that_rounding_puts_in_one_place_are_no_error():
    points = np.full((6, 3), -3e152)
    points[1, 0], points[2, 1], points[3, 1], points[4, 2] = 0.0, 3e164, 0.0, 1e141
    found = self_intersections(points, np.array([[1, 2, 4], [0, 3, 4]]))
    assert np.isfinite(found.places).all()


def test_the_search_stops_where_all_is_tangled():
    random = np.random.default_rng(0)
    points = random.normal(size=(3000, 3))
    found = self_intersections(points, np.arange(3000).reshape(-1, 3), most=500)
    assert len(found.pairs) == len(found.places) == 500


def test_a_surface_of_130_thousand_faces_is_searched_in_two_seconds(ball):
    pairs(cube().points, CUBE)  # compiled
    grid = np.arange(256)
    u, v = np.meshgrid(grid / 256 * 2 * math.pi, grid / 255, indexing="ij")
    tube = np.stack([np.cos(u), np.sin(u), 5 * v], axis=-1).reshape(-1, 3)
    one = (grid[:, None] * 256 + grid[:-1]).ravel()
    over = ((grid[:, None] + 1) % 256 * 256 + grid[:-1]).ravel()
    faces = np.vstack([np.stack([one, over, one + 1], 1), np.stack([over, over + 1, one + 1], 1)])
    began = time.perf_counter()
    assert pairs(tube, faces) == []
    assert time.perf_counter() - began < 2.0


def test_faces_that_were_meant_to_lie_in_one_plane_do_not_cross():
    along, across = np.meshgrid(np.linspace(0, 1, 41), np.linspace(0, 1, 31), indexing="ij")
    flat = np.stack([(1 + 2 * across) * along, across, 0 * along], axis=-1).reshape(-1, 3)
    number = np.arange(41 * 31).reshape(41, 31)
    a, b, c, d = (number[i, j].ravel() for i, j in CORNERS)
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    for seed in range(5):
        turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        assert len(self_intersections(flat @ turn + 0.3, faces).pairs) == 0


CORNERS = [
    (slice(None, -1), slice(None, -1)),
    (slice(1, None), slice(None, -1)),
    (slice(1, None), slice(1, None)),
    (slice(None, -1), slice(1, None)),
]
