"""Edges through faces, against every pair tried."""

import numpy as np
import pytest
from shapes import CUBE, CUBE_POINTS

from moldline.mesh.crossings import Search, overlaps
from moldline.mesh.topology import edges


def soup(count, seed):
    """Small triangles anywhere in a unit cube."""
    rng = np.random.default_rng(seed)
    middles = rng.random((count, 1, 3))
    points = (middles + 0.15 * rng.normal(size=(count, 3, 3))).reshape(-1, 3)
    return points, np.arange(3 * count).reshape(-1, 3)


def by_brute_force(points, one, other, first):
    """Ends of each edge of one that runs through a face of other, the face, the side."""
    found = set()
    for p, q in edges(one).ends.tolist():
        for number, face in enumerate(other.tolist()):
            a, b, c = points[face]
            columns = np.stack([points[p] - points[q], b - a, c - a], axis=1)
            t, u, v = np.linalg.solve(columns, points[p] - a)
            if 0 < t < 1 and u > 0 and v > 0 and u + v < 1:
                is_out = np.dot(np.cross(b - a, c - a), points[p] - a) > 0
                found.add((p, q, first + number, 1 if is_out else -1))
    return found


@pytest.mark.parametrize("seed", range(3))
def test_all_crossings_are_found_and_no_others(seed):
    (x, f), (y, g) = soup(60, seed), soup(45, seed + 100)
    points, g = np.concatenate([x, y]), g + len(x)
    found = Search(points, [f, g])(points)
    expected = by_brute_force(points, f, g, len(f)) | by_brute_force(points, g, f, 0)
    assert len(expected) > 30
    assert set(map(tuple, found.pairs.tolist())) == expected
    assert len(found.pairs) == len(expected)


def test_crossings_follow_the_points_and_stand_in_order():
    (x, f), (y, g) = soup(60, 7), soup(45, 8)
    points, g = np.concatenate([x, y]), g + len(x)
    search = Search(points, [f, g])
    moved = points + 0.1 * np.sin(3 * points[:, [1, 2, 0]])
    found, fresh = search(moved), Search(moved, [f, g])(moved)
    assert np.array_equal(found.pairs, fresh.pairs)
    same = (np.diff(found.pairs[:, :2], axis=0) == 0).all(axis=1)
    assert same.any() and np.all(np.diff(found.places)[same] >= 0)
    start, end = moved[found.pairs[:, 0]], moved[found.pairs[:, 1]]
    place = start + found.places[:, None] * (end - start)
    a, b, c = (moved[np.concatenate([f, g])[found.pairs[:, 2], k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    off = np.einsum("ij,ij->i", place - a, normal) / np.linalg.norm(normal, axis=1)
    assert np.abs(off).max() < 1e-14


def test_an_edge_through_what_two_faces_share_is_found_once():
    # the middle of each side lies on its diagonal
    bar = (CUBE_POINTS - 0.5) * [0.25, 0.25, 4.0] + [0.625, 0.625, 0.5]
    points = np.concatenate([CUBE_POINTS, bar])
    found = Search(points, [CUBE, CUBE + 8])(points)
    ends = found.pairs[found.pairs[:, 0] >= 8]
    through, count = np.unique(ends[:, :2], axis=0, return_counts=True)
    upright = [row for row in through.tolist() if {row[0] % 8 + 4, row[1] % 8} == {row[1] % 8}]
    assert len(upright) == 4
    assert all(count[through.tolist().index(row)] == 2 for row in upright)  # top and bottom


def test_faces_in_one_plane_are_told():
    beside = CUBE_POINTS * 0.5 + [1.0, 0.25, 0.25]
    points = np.concatenate([CUBE_POINTS, beside])
    search = Search(points, [CUBE, CUBE + 8])
    pairs = search(points).coplanar
    areas, places = overlaps(points, search.faces, pairs)
    assert areas.sum() == pytest.approx(0.25, rel=1e-14)
    assert np.all(places[areas > 0][:, 0] == 1)
    apart = np.concatenate([CUBE_POINTS, beside + [1e-3, 0, 0]])
    assert len(search(apart).coplanar) == 0


def test_edges_in_a_plane_cross_in_the_plane_only():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], float)
    points = np.concatenate([square, square + [0.5, 0, 0.4], [[0.5, 1, 0.5]] * 2])
    ring = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    faces = np.array([[0, 1, 8], [1, 2, 8], [2, 3, 8], [3, 0, 8]])
    other = np.array([[4, 5, 9], [5, 6, 9], [6, 7, 9], [7, 4, 9]])
    search = Search(points, [faces, other], 1, [ring, ring + 4])
    found = search(points)
    in_plane = found.pairs[found.pairs[:, 2] < 0]
    assert {(p, q, -1 - e) for p, q, e, _ in in_plane.tolist()} == {
        (1, 2, 4), (2, 3, 7), (4, 5, 1), (4, 7, 2),
    }  # fmt: skip
    lifted = points.copy()
    lifted[:4, 1] += 1e-9  # whatever the coordinate across
    pairs = search(lifted).pairs
    assert np.array_equal(pairs[pairs[:, 2] < 0], in_plane)
