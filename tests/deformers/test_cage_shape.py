"""What a cage is made of: sides, holes, polygons, and why some surfaces are none."""

import numpy as np
import pytest
from numerics.cages import box

import moldline as ml
from moldline.deformers.cage_shape import shaped
from moldline.errors import GeometryError
from moldline.numerics.winding import winding

POINTS, FACES = box((2, 2, 2), (2.0, 2.0, 2.0))
POINTS = POINTS - POINTS.mean(axis=0)


def nested(*scales, flip=()):
    """Boxes inside one another, the ones in `flip` looking inwards."""
    points = np.concatenate([s * POINTS for s in scales])
    faces = [
        f[:, ::-1] if i in flip else f
        for i, f in enumerate([FACES + 8 * i for i in range(len(scales))])
    ]
    return points, np.concatenate(faces)


@pytest.mark.parametrize("flip", [(), (0,), (1,), (0, 1, 2)])
def test_a_box_in_a_box_is_a_hole_and_a_box_in_that_none_whatever_sides_they_show(flip):
    shape = shaped(*nested(1.0, 0.6, 0.2, flip=flip))
    along = np.array([[0.0, 0, 0], [0.4, 0, 0], [0.8, 0, 0], [1.2, 0, 0]])
    around = winding(along, shape.points, shape.faces)
    np.testing.assert_allclose(around, [1, 0, 1, 0], rtol=0, atol=1e-14)


@pytest.mark.parametrize("flip", [(), (1,)])
def test_points_in_a_hole_are_refused(flip):
    cage = ml.Cage(*nested(1.0, 0.4, flip=flip), cells=16)
    between, hole = np.array([[0.7, 0.1, 0.1]]), np.array([[0.0, 0.1, 0.2]])
    controls = np.tile([0.1, 0.2, 0.3], 16)
    moved = cage.bind(between)(controls)
    np.testing.assert_allclose(moved, between + np.array([[0.1, 0.2, 0.3]]), rtol=0, atol=1e-12)
    with pytest.raises(GeometryError, match=r"1 of 1 points lie outside the cage: point 0"):
        cage.bind(hole)
    assert np.array_equal(cage(hole, controls), hole)


def test_places_of_open_edges_are_their_middles_and_three_at_most():
    points, faces = box((3, 3, 3), (2.0, 2.0, 2.0))
    message = (
        r"is open at 9 edges, near \((\S+, ){2}\S+\); \((\S+, ){2}\S+\); \((\S+, ){2}\S+\) \.\.\."
    )
    keep = np.ones(len(faces), bool)
    keep[[0, 10, 20]] = False
    with pytest.raises(GeometryError, match=message) as told:
        shaped(points, faces[keep])
    places = str(told.value).split("near ")[1].split(" ...")[0].split("; ")
    assert len(set(places)) == 3


@pytest.mark.parametrize(
    "face", [[0.5, 1.5, 2.5], ["a", "b", "c"], [0, 1], [], [0, 1, 1], [0, 1, -1], [0, 1, 8]]
)
def test_faces_that_are_none_are_refused(face):
    with pytest.raises(GeometryError, match=r"face 0 of the cage is .* different points of 0 to 7"):
        shaped(POINTS, [face, *FACES.tolist()])


@pytest.mark.parametrize("kind", ["harmonic", "mean value"])
def test_points_that_are_nowhere_are_refused(kind):
    cage = ml.Cage(POINTS, FACES, coordinates=kind, cells=6)
    points = np.array([[0.0, 0, 0], [0.1, np.nan, 0], [np.inf, 0, 0]])
    with pytest.raises(GeometryError, match=r"2 of 3 points .* not finite \(first: point 1\)"):
        cage.bind(points)


def test_a_cage_that_is_turned_inside_out_by_one_face_is_told():
    faces = FACES.copy()
    faces[4] = faces[4, ::-1]
    with pytest.raises(GeometryError, match="has faces of different sides at 3 edges"):
        shaped(POINTS, faces)


def test_a_polygon_that_is_not_convex_is_cut_inside_itself():
    outline = np.array([[0, 0], [3, 0], [3, 3], [1.5, 0.5], [0, 3]], float)
    points = np.concatenate([np.c_[outline, np.full(5, z)] for z in (0.0, 1.0)])
    sides = [[i, (i + 1) % 5, (i + 1) % 5 + 5, i + 5] for i in range(5)]
    shape = shaped(points, [[4, 3, 2, 1, 0], [5, 6, 7, 8, 9], *sides])
    a, b, c = (shape.points[shape.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    flat = np.ptp(shape.points[shape.faces][..., 2], axis=1) == 0
    own = 9 - 3 * 2.5 / 2  # the notch
    np.testing.assert_allclose(area[flat].sum(), 2 * own, rtol=1e-14)
    assert len(shape.lines) == 15
