"""Holes are filled by a smooth surface."""

import numpy as np
import pytest

import moldline as ml
from moldline.errors import GeometryError, ParameterError
from moldline.mesh import quality, topology
from moldline.mesh.fill import filled


def sheet(height, count=33, hole=0.35):
    """A square from -1 to 1, lifted, without what lies nearer to its middle than `hole`."""
    at = np.linspace(-1, 1, count)
    x, y = (a.ravel() for a in np.meshgrid(at, at, indexing="ij"))
    number = np.arange(count**2).reshape(count, count)
    a, b, c, d = (
        n.ravel() for n in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    )
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    far = np.hypot(x, y)[faces].min(axis=1) > hole
    used, own = np.unique(faces[far], return_inverse=True)
    points = np.stack([x, y, height(x, y)], axis=1)[used]
    return ml.Surface(points, own.reshape(-1, 3))


def inner(surface):
    return min(topology.boundary_loops(surface.faces), key=len)


def test_a_hole_in_a_plane_is_filled_by_that_plane():
    given = sheet(lambda x, y: 0.3 * x - 0.2 * y + 1)
    whole, told = filled(given, inner(given))
    x, y, z = whole.points.T
    np.testing.assert_allclose(z, 0.3 * x - 0.2 * y + 1, atol=1e-12)
    assert quality.area(whole) == pytest.approx(4 * np.sqrt(1 + 0.09 + 0.04), rel=1e-12)
    assert told.kink < 1e-6  # arccos near 1 knows no better
    assert len(topology.boundary_loops(whole.faces)) == 1


def off(count):
    """How far a filling of a bowl lies off it at most."""
    given = sheet(lambda x, y: 0.25 * (x**2 + y**2), count)
    whole, _ = filled(given, inner(given), rings=3)
    x, y, z = whole.points.T
    return np.abs(z - 0.25 * (x**2 + y**2)).max()


def test_a_filling_takes_over_slope_and_curvature_from_around_the_hole():
    """A flat filling would lie off by 0.03; what a finer surface says of its slopes is more."""
    assert off(33) < 2e-3
    assert off(65) < 0.6 * off(33)


def test_a_hole_in_a_ball_is_closed(ball):
    stays = np.all(ball.points[np.asarray(ball.faces), 2] < 0.9, axis=1)
    cut = ml.Surface(ball.points, np.asarray(ball.faces)[stays], None, ("ball",))
    whole, told = filled(cut)
    assert topology.is_closed(whole.faces)
    assert not len(topology.edges(whole.faces).misoriented)
    assert quality.signed_volume(whole) == pytest.approx(quality.signed_volume(ball), rel=1e-3)
    assert whole.components == ("ball", "filling")
    assert np.degrees(told.kink) < 15  # facets of the ball itself meet at up to 9
    radius = np.linalg.norm(whole.points[-told.points :], axis=1)
    np.testing.assert_allclose(radius, 1.0, atol=0.01)  # flat it would lie off by 0.1


def test_points_that_are_kept_are_kept_to_the_bit():
    given = sheet(lambda x, y: x * y)
    whole, told = filled(given, inner(given), clear=2)
    np.testing.assert_array_equal(whole.points[: len(told.kept)], given.points[told.kept])
    assert len(told.kept) < len(given.points)
    assert told.points == len(whole.points) - len(told.kept)


def test_what_is_cleared_away_is_still_known():
    """The filling passes by the places of the points that went."""
    given = sheet(lambda x, y: 0.25 * (x**2 + y**2))
    loop = inner(given)
    whole, told = filled(given, loop, clear=1, rings=1)
    gone = given.points[loop]
    assert told.cleared > 0
    assert not np.isin(loop, told.kept).any()
    x, y, z = whole.points.T
    np.testing.assert_allclose(z, 0.25 * (x**2 + y**2), atol=2e-3)
    assert len(gone) > 10


def test_spacing_is_that_of_the_edges_or_as_asked():
    given = sheet(lambda x, y: 0 * x)
    coarse, fine = (filled(given, inner(given), spacing=s)[1].points for s in (0.1, 0.05))
    assert 3.5 < fine / coarse < 6


@pytest.mark.parametrize(
    ("options", "error", "match"),
    [
        ({}, GeometryError, "has 2 openings: 128 points around"),
        ({"clear": -1}, ParameterError, "clear is 0 or more"),
        ({"spacing": 1e-5}, ParameterError, "is too small for a hole of"),
        ({"clear": 12}, GeometryError, "clear fewer rings"),
    ],
)
def test_what_cannot_be_filled_is_refused(options, error, match):
    given = sheet(lambda x, y: 0 * x)
    loop = {"loop": inner(given)} if options else {}
    with pytest.raises(error, match=match):
        filled(given, **(loop | options))


def test_the_end_of_a_pipe_is_no_hole_in_a_wall():
    angle = 2 * np.pi * np.arange(24) / 24
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    points = np.concatenate([ring + [0, 0, h] for h in (0.0, 0.5, 1.0)])
    number = np.arange(72).reshape(3, 24)
    a, b = number[:-1].ravel(), np.roll(number[:-1], -1, axis=1).ravel()
    d, c = number[1:].ravel(), np.roll(number[1:], -1, axis=1).ravel()
    pipe = ml.Surface(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    with pytest.raises(GeometryError, match="does not lie over one plane"):
        filled(pipe, topology.boundary_loops(pipe.faces)[0])
