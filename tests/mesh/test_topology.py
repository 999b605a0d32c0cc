"""Edges, loops, pieces and doubles."""

import numpy as np
import pytest
from shapes import CUBE, CUBE_POINTS, two_cubes

from moldline.mesh import topology


def test_a_cube_is_closed_manifold_and_obeys_euler():
    edges = topology.edges(CUBE)
    assert len(CUBE_POINTS) - len(edges.ends) + len(CUBE) == 2
    assert topology.is_closed(CUBE)
    assert not len(edges.open) and not len(edges.nonmanifold) and not len(edges.misoriented)
    assert not len(topology.nonmanifold_vertices(CUBE))
    assert topology.pieces(CUBE)[0] == 1


def test_no_faces_have_no_edges():
    none = np.empty((0, 3), np.int32)
    assert len(topology.edges(none).ends) == 0
    assert topology.boundary_loops(none) == []
    assert topology.pieces(none)[0] == 0
    assert not len(topology.nonmanifold_vertices(none))
    assert not len(topology.duplicate_faces(none))


def test_a_missing_face_leaves_a_loop_along_its_neighbours():
    (loop,) = topology.boundary_loops(np.delete(CUBE, 2, axis=0))  # without 4, 5, 6
    start = loop.tolist().index(4)
    assert np.roll(loop, -start).tolist() == [4, 6, 5]
    assert not topology.is_closed(CUBE[1:])


def test_two_holes_that_touch_are_two_loops():
    loops = topology.boundary_loops(CUBE[[2, 3, *range(4, 12)]])  # no bottom
    assert [sorted(loop.tolist()) for loop in loops] == [[0, 1, 2, 3]]
    touching = np.delete(CUBE, [1, 10], axis=0)  # 0, 2, 1 and 3, 0, 4 have only point 0 in common
    assert sorted(map(len, topology.boundary_loops(touching))) == [3, 3]


def test_a_loop_closes_even_where_faces_are_turned_over():
    square = np.array([[0, 1, 2], [0, 3, 2]])
    (loop,) = topology.boundary_loops(square)
    assert sorted(loop.tolist()) == [0, 1, 2, 3]
    np.testing.assert_array_equal(topology.edges(square).misoriented, [[0, 2]])


def test_cubes_that_touch_at_a_point_or_along_an_edge_are_told():
    assert topology.nonmanifold_vertices(two_cubes([0])).tolist() == [0]
    assert topology.pieces(two_cubes([0]))[0] == 2
    along = two_cubes([0, 1])
    np.testing.assert_array_equal(topology.edges(along).nonmanifold, [[0, 1]])
    assert topology.pieces(along)[0] == 1


def test_pieces_number_each_face():
    number, piece = topology.pieces(two_cubes([]))
    assert number == 2
    assert piece.tolist() == [0] * 12 + [1] * 12


def test_a_face_that_uses_a_point_twice_does_not_count():
    collapsed = np.concatenate([CUBE, [[0, 0, 1]]])
    assert len(topology.edges(collapsed).nonmanifold) == 0
    assert len(topology.nonmanifold_vertices(collapsed)) == 0
    assert topology.pieces(collapsed)[1][-1] == -1


def test_doubles_are_those_after_the_first():
    doubled = np.concatenate([CUBE, CUBE[3:4, [1, 0, 2]]])
    assert topology.duplicate_faces(doubled).tolist() == [12]
    points = np.concatenate([CUBE_POINTS, CUBE_POINTS[:2] - 0.0])
    assert topology.duplicate_points(points).tolist() == [8, 9]


def test_welding_keeps_the_first_and_the_order():
    points = np.array([[1.0, 0, 0], [0, 0, 0], [1, 0, 0], [-0.0, 0, 0], [1 + 1e-6, 0, 0]])
    kept, index = topology.weld(points)
    assert (kept.tolist(), index.tolist()) == ([0, 1, 4], [0, 1, 0, 1, 2])
    kept, index = topology.weld(points, tolerance=1e-5)
    assert (kept.tolist(), index.tolist()) == ([0, 1], [0, 1, 0, 1, 0])


@pytest.mark.parametrize("tolerance", [0.0, 1e-12])
def test_welding_undoes_the_splitting_of_a_cube(tolerance):
    soup = CUBE_POINTS[CUBE].reshape(-1, 3)
    kept, index = topology.weld(soup, tolerance)
    assert len(kept) == 8
    np.testing.assert_array_equal(soup[kept][index], soup)
    assert topology.is_closed(index.reshape(-1, 3))


def test_neighbours_lie_across_edges_of_two_faces_only():
    near = topology.neighbours(CUBE)
    assert len(near.one) == 18 and near.is_oriented.all()
    faces = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4], [2, 1, 5], [2, 5, 6], [5, 7, 2]])
    near = topology.neighbours(faces)  # 0-1 and 2-5 have three faces
    assert [(near.one.tolist()), near.other.tolist(), near.is_oriented.tolist()] == [
        [0],
        [3],
        [True],
    ]


def test_turns_are_told_from_the_first_face_of_each_patch():
    faces = CUBE.copy()
    faces[[0, 7]] = faces[[0, 7], ::-1]
    found = topology.turns(faces)
    assert np.flatnonzero(found.is_turned).tolist() == [1, 2, 3, 4, 5, 6, 8, 9, 10, 11]
    assert found.is_orientable.tolist() == [True]
    assert len(topology.turns(np.empty((0, 3), int)).patch) == 0


def test_the_sense_of_a_face_is_that_of_its_points_in_a_circle():
    faces = np.array([[0, 1, 2], [1, 2, 0], [2, 1, 0], [0, 2, 1], [3, 4, 5], [5, 4, 3]])
    assert topology.duplicate_faces(faces).tolist() == [1, 2, 3, 5]
    assert topology.back_to_back_faces(faces).tolist() == [2, 5]
