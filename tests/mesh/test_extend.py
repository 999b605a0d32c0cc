"""Open ends go straight on to a plane."""

import numpy as np
import pytest

import moldline as ml
from moldline.errors import GeometryError, ParameterError
from moldline.mesh import parts, quality, topology
from moldline.mesh.cap import capped
from moldline.mesh.extend import extended

AROUND = 12


def cone(rings=(3.0, 2.0, 1.5), tip=4.0):
    """Rings about the y axis, of the radius y / 2, closed at the far end; open at the last ring."""
    y = np.array([tip, *rings])
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    circle = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    points = np.concatenate([[0, h, 0] + h / 2 * circle for h in y])
    number = np.arange(len(points)).reshape(len(y), AROUND)
    a, b = number[:-1], np.roll(number[:-1], -1, axis=1)
    d, c = number[1:], np.roll(number[1:], -1, axis=1)
    cells = np.concatenate([np.stack([a, b, c], 2), np.stack([a, c, d], 2)]).reshape(-1, 3)
    count = np.arange(1, AROUND - 1)
    lid = np.stack([0 * count, count, count + 1], axis=1)
    faces = np.concatenate([cells, lid[:, ::-1]])
    shape = ml.Surface(points, faces)
    tags = np.append(np.zeros(len(cells), int), np.ones(len(lid), int))
    data = {"y": points[:, 1]}
    turned = ml.Surface(
        points, faces, tags, ("side", "lid"), data, {"number": np.arange(len(faces))}
    )
    assert len(topology.edges(shape.faces).misoriented) == 0
    return turned


def test_a_cone_stays_one_when_it_is_extended():
    longer, told = extended(cone(), "y", 0.5, (0.0, 0.4, 1.0))
    y = longer.points[:, 1]
    np.testing.assert_allclose(
        np.hypot(longer.points[:, 0], longer.points[:, 2]), y / 2, atol=1e-15
    )
    assert np.all(y[told.end] == 0.5)  # to the bit
    assert (told.points, told.faces) == (2 * AROUND, 4 * AROUND)
    assert told.longest == pytest.approx(np.hypot(1.0, 0.5))
    assert told.steepest == pytest.approx(np.arctan(0.5))


def test_an_extended_and_capped_cone_has_a_frustums_volume():
    longer, _ = extended(cone(), "y", 0.5)
    closed, _ = capped(longer, "end", "y", 0.5)
    side = AROUND / 2 * np.sin(2 * np.pi / AROUND) / 4  # area of the polygon at y = 1
    (piece,) = parts.pieces(closed)
    assert piece.is_closed
    assert abs(piece.volume) == pytest.approx(side * (4**3 - 0.5**3) / 3, rel=1e-13)


def test_points_of_the_opening_may_slide_on_along_their_edges():
    given = cone()
    (loop,) = topology.boundary_loops(given.faces)
    longer, _ = extended(given, "y", 0.5, (0.3, 1.0))
    moved = longer.points[loop]
    np.testing.assert_allclose(moved[:, 1], 1.5 - 0.3, atol=1e-15)
    # the old place lies on the edge that now runs through it: on the cone at 1.5
    np.testing.assert_allclose(moved * (1.5 / 1.2), given.points[loop], atol=1e-15)


def test_components_and_data_go_along():
    given = cone()
    longer, told = extended(given, "y", 0.5)
    new = np.asarray(longer.tags)[len(given.faces) :]
    assert np.all(new == 0)
    np.testing.assert_array_equal(longer.point_data["y"][told.end], np.full(AROUND, 1.5))
    assert len(longer.face_data["number"]) == len(longer.faces)


def test_an_end_without_lines_goes_on_square_to_itself(ball):
    """A ball of triangles, cut ragged: the next ring has fewer points."""
    keeps = np.all(ball.points[np.asarray(ball.faces), 1] < 0.45, axis=1)
    cut = ml.Surface(ball.points, np.asarray(ball.faces)[keeps])
    longer, told = extended(cut, "y", 1.0)
    closed, _ = capped(longer, "end", "y", 1.0)
    assert np.all(longer.points[told.end, 1] == 1.0)
    assert topology.is_closed(closed.faces)
    assert quality.signed_volume(closed) > 4 * np.pi / 3 * 0.9


@pytest.mark.parametrize(
    ("options", "error", "match"),
    [
        ({"at": 2.0}, GeometryError, "does not go on to the plane y = 2"),
        ({"plane": "x", "at": 9.0}, GeometryError, "does not go on"),
        ({"rows": (0.5, 0.2, 1.0)}, ParameterError, "must ascend"),
        ({"rows": (0.0, 0.5)}, ParameterError, "from 0 or more to 1"),
        ({"loop": np.arange(3)}, ParameterError, "none of the surface's 1 openings"),
    ],
)
def test_what_cannot_be_extended_is_refused(options, error, match):
    with pytest.raises(error, match=match):
        extended(cone(), **({"plane": "y", "at": 0.5} | options))


def test_a_closed_surface_has_no_end(ball):
    with pytest.raises(GeometryError, match="has 0 openings"):
        extended(ball, "y", 2.0)
