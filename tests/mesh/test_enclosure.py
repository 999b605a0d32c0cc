"""Cages made around surfaces: closed, clear of what they enclose, even."""

import numpy as np
import pytest
from bodies import capsule, fuselage, supersonic_wing
from hypothesis import given, settings
from hypothesis import strategies as st
from numerics.cages import elbow, wing

import moldline as ml
from moldline.errors import GeometryError, ParameterError
from moldline.mesh.enclosure import clear_of, enclosure
from moldline.mesh.health import health
from moldline.mesh.rings import body_rings, wing_rings


def torus():
    u, v = np.meshgrid(*(2 * np.pi * np.arange(n) / n for n in (48, 24)), indexing="ij")
    radius = 2 + 0.5 * np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), 0.5 * np.sin(v)], axis=-1)
    number = np.arange(48 * 24).reshape(48, 24)
    a, b = number, np.roll(number, -1, axis=0)
    d, c = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    faces = [np.stack([x.ravel() for x in t], axis=1) for t in ((a, b, c), (a, c, d))]
    return ml.Surface(points.reshape(-1, 3), np.concatenate(faces))


SHAPES = {
    "ball": None,
    "elbow": lambda: ml.Surface(*elbow()),
    "thin wing": lambda: ml.Surface(*wing()),
    "torus": torus,
    "capsule": lambda: capsule(48, 8),
    "open": lambda: ml.Surface(capsule(48, 8).points, capsule(48, 8).faces[500:]),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_cage_encloses_is_sound_and_has_about_as_many_faces(name, ball):
    shape = SHAPES[name]() if SHAPES[name] else ball
    found = enclosure(shape, 150, 0.06)
    report = health(found.surface)
    assert report.is_sound and report.volume > 0
    assert 100 <= len(found.surface.faces) <= 300
    size = np.linalg.norm(np.ptp(shape.points, axis=0))
    assert 0.01 * size < found.clearance <= 0.07 * size
    assert np.degrees(report.smallest_angle) > 12


def test_two_bodies_apart_get_a_cage_of_two_pieces_or_one(ball):
    points = np.concatenate([ball.points, np.asarray(ball.points) + [6.0, 0, 0]])
    both = ml.Surface(points, np.concatenate([ball.faces, ball.faces + len(ball.points)]))
    found = enclosure(both, 300, 0.04)
    assert found.clearance > 0
    assert health(found.surface).pieces == 2


def test_it_is_denser_where_asked_for(ball):
    there = np.array([1.0, 0, 0])
    count = []
    for denser in ((), [((1.0, 0, 0), 1.0, 3.0)]):
        found = enclosure(ball, 200, 0.08, denser=denser)
        count.append(np.sum(np.linalg.norm(found.surface.points - there, axis=1) < 0.9))
    assert count[1] > 1.6 * count[0]


def test_the_same_is_made_every_time(ball):
    one, other = enclosure(ball, 80), enclosure(ball, 80)
    assert np.array_equal(one.surface.points, other.surface.points)
    assert np.array_equal(one.surface.faces, other.surface.faces)


def test_a_cage_that_cuts_in_is_seen(ball):
    points, faces = np.asarray(ball.points), np.asarray(ball.faces)
    assert clear_of(ml.Surface(1.2 * points, faces), points, faces) == pytest.approx(0.2, abs=0.01)
    assert clear_of(ml.Surface(0.9 * points, faces), points, faces) == 0.0
    assert clear_of(ml.Surface(1.2 * points + [0.5, 0, 0], faces), points, faces) == 0.0
    assert clear_of(ml.Surface(1.2 * points, faces[1:]), points, faces) == 0.0


def test_wrong_wishes_are_refused(ball):
    with pytest.raises(ParameterError, match="20 faces or more and an offset of 0 to 1, got 5"):
        enclosure(ball, 5)
    with pytest.raises(GeometryError, match="without extent"):
        enclosure(ml.Surface(np.zeros((3, 3)), np.array([[0, 1, 2]])))
    with pytest.raises(GeometryError, match="is too small for a geometry of"):
        enclosure(ball, 200, 1e-5)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**31), st.floats(1e-4, 1e4), st.floats(-1e3, 1e3))
def test_any_triangles_are_enclosed(seed, size, offset):
    rng = np.random.default_rng(seed)
    points = size * (rng.normal(size=(12, 3)) * rng.uniform(0.1, 1, 3) + offset)
    soup = ml.Surface(points, rng.permuted(np.arange(12)).reshape(4, 3))
    assert enclosure(soup, 120, 0.15).clearance > 0


@pytest.mark.parametrize("shape", [capsule(48, 8), fuselage(48, 81)], ids=["capsule", "fuselage"])
def test_rings_go_around_a_body(shape):
    found = body_rings(shape, stations=6, around=8)
    assert found.numbers.shape == (8, 8) and found.clearance > 0
    assert health(found.surface).is_sound
    rings = np.asarray(found.surface.points)[found.numbers]
    assert np.ptp(rings[..., 0], axis=1).max() < 1e-12  # each lies across x
    assert np.all(np.diff(rings[:, 0, 0]) > 0)
    assert np.all(rings[:, 0, 2] >= rings[..., 2].max(axis=1) - 1e-9)  # the first above


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rings_go_around_a_half_wing(side):
    shape = supersonic_wing(21, 15)
    if side < 0:
        shape = ml.Surface(np.asarray(shape.points) * [1, -1, 1], np.asarray(shape.faces)[:, ::-1])
    found = wing_rings(shape, stations=4, chordwise=5)
    assert found.numbers.shape == (4, 10) and found.clearance > 0
    assert health(found.surface).is_sound
    rings = np.asarray(found.surface.points)[found.numbers]
    assert np.all(np.diff(rings[:, :5, 0], axis=1) > 0)  # above, along the chord
    assert np.all(rings[:, :5, 2] > rings[:, :4:-1, 2])


def test_a_cage_made_around_a_body_moves_it():
    body = capsule(48, 8)
    for cage in (ml.Cage.around(body, 80), ml.Cage.around_body(body, 5, 6)):
        shift = np.tile([0.1, 0.2, 0.3], len(cage.rest))
        moved = np.asarray(cage.bind(body.points)(shift))
        np.testing.assert_allclose(moved, body.points + np.array([0.1, 0.2, 0.3]), atol=1e-9)
    swept = supersonic_wing(21, 15)
    assert len(ml.Cage.around_wing(swept, 3, 4).rest) == 3 * 8 + 2


def half(surface):
    """The triangles of a symmetric surface at y >= 0, its points moved onto the plane there."""
    points, faces = np.array(surface.points), np.asarray(surface.faces)
    points[np.abs(points[:, 1]) < 1e-12, 1] = 0.0
    kept, index = np.unique(faces[np.all(points[faces, 1] >= 0, axis=1)], return_inverse=True)
    return ml.Surface(points[kept], index.reshape(-1, 3))


HALVES = {
    "ball": lambda ball: enclosure(half(ball), 120, 0.06, symmetric=True),
    "few": lambda ball: enclosure(half(ball), 24, 0.1, symmetric=True),
    "wing": lambda ball: enclosure(supersonic_wing(21, 15), 150, 0.05, symmetric=True),
    "other side": lambda ball: enclosure(
        ml.Surface(half(ball).points * np.array([1.0, -1.0, 1.0]), half(ball).faces),
        100, 0.05, symmetric=True,
    ),
    "wing rings": lambda ball: wing_rings(supersonic_wing(21, 15), 4, 5, symmetric=True),
    "body": lambda ball: enclosure(half(fuselage(48, 81)), 100, 0.05, symmetric=True),
    "body rings": lambda ball: body_rings(half(fuselage(48, 81)), 6, 8, symmetric=True),
}  # fmt: skip


@pytest.mark.parametrize("name", HALVES)
def test_a_symmetric_cage_is_its_own_image_to_the_bit(name, ball):
    found = HALVES[name](ball)
    points, faces = np.asarray(found.surface.points), np.asarray(found.surface.faces)
    assert health(found.surface).is_sound and found.clearance > 0
    places = {tuple(p): n for n, p in enumerate(points.tolist())}
    image = np.array([places[tuple(p)] for p in (points * [1.0, -1.0, 1.0] + 0.0).tolist()])

    def turning(triangles):
        first = triangles.argmin(axis=1)[:, None]
        return {*map(tuple, np.take_along_axis(triangles, (first + [0, 1, 2]) % 3, 1).tolist())}

    assert turning(image[faces][:, ::-1]) == turning(faces)
    if name == "ball":
        assert 90 < len(faces) < 150


def test_a_symmetric_ring_has_as_many_points_on_either_side():
    with pytest.raises(ParameterError, match="an even number where it is symmetric, got 7"):
        body_rings(half(fuselage(48, 81)), 6, 7, symmetric=True)
