"""Half models: closed beyond their plane, united, and opened again."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from overlapping import body, box, wing

import moldline as ml
from moldline.errors import GeometryError
from moldline.measures.volume import Volume
from moldline.mesh import quality, symmetric, topology
from moldline.mesh.cap import capped
from moldline.mesh.health import health
from moldline.modelers.union import Union
from moldline.numerics.taylor import remainder

NONE = np.zeros(0)
HALF = np.linspace(-np.pi / 2, np.pi / 2, 16)
TRANSPORT = Path(__file__).parents[2] / "examples/data/transport_wing.tri"


def half_ball(centre, radius, along=21, around=20) -> ml.Surface:
    """Half a sphere at y >= 0, open at y = 0."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, around)
    found = body(along=along, radius=radius, length=2 * radius, angles=angles)
    return found.moved(found.points + np.asarray(centre) - [0.1 * radius, 0, 0])


def whole(half: ml.Surface) -> ml.Surface:
    return symmetric.joined(np.asarray(half.points), np.asarray(half.faces))


PAIRS = {
    "wing on body": (wing(closed_root=False), body(angles=HALF)),
    "ball in ball": (half_ball([0, 0, 0], 1.0), half_ball([1.1, 0, 0.13], 0.9, 17, 15)),
    "body and pod": (body(angles=HALF), wing(root=0.3, tip=1.5)),
}


@pytest.fixture(scope="module", params=list(PAIRS))
def halves(request):
    parts = PAIRS[request.param]
    return parts, Union(symmetry="y").bind(*parts)


def test_a_half_is_open_in_the_plane_only(halves):
    _, made = halves
    points, faces = np.asarray(made.geometry.points), made.geometry.faces
    edges = topology.edges(faces)
    assert len(edges.open) > 0
    assert np.all(points[edges.open][..., 1] == 0)
    assert points[:, 1].min() == 0
    assert made.report.is_watertight and made.report.openings == 1
    assert (made.report.genus, made.report.pieces) == (0, 1)
    closed, _ = capped(made.geometry)
    assert health(closed).is_sound
    assert quality.signed_volume(closed) == pytest.approx(made.report.volume, rel=1e-12)


def test_a_half_is_half_of_the_whole(halves):
    parts, made = halves
    images = [whole(part) if len(topology.edges(part.faces).open) else None for part in parts]
    if None in images:  # what does not reach the plane has an image apart from it
        pod = parts[images.index(None)]
        points, faces = symmetric.with_image(np.asarray(pod.points), np.asarray(pod.faces))
        images[images.index(None)] = ml.Surface(points, faces)
    both = Union().bind(*images)
    assert 2 * made.report.volume == pytest.approx(both.report.volume, rel=1e-12)
    assert 2 * made.report.area == pytest.approx(both.report.area, rel=1e-12)
    mine = np.asarray(made.geometry.points)
    theirs = np.asarray(both.geometry.points)
    theirs = theirs[theirs[:, 1] >= -1e-12]
    from scipy.spatial import cKDTree

    assert cKDTree(theirs).query(mine)[0].max() < 1e-12
    assert cKDTree(mine).query(theirs)[0].max() < 1e-12


def test_points_in_the_plane_stay_there_whatever_moves_along_it(halves):
    parts, made = halves
    moved = tuple(np.asarray(p.points) + [2e-5, 0, -4e-5 * k] for k, p in enumerate(parts))
    assert made.holds(*moved)
    in_plane = np.asarray(made.geometry.points)[:, 1] == 0
    assert np.all(np.asarray(made(NONE, *moved))[in_plane, 1] == 0)
    anew = Union(symmetry="y").bind(*(s.moved(p) for s, p in zip(parts, moved, strict=True)))
    np.testing.assert_allclose(
        np.asarray(made(NONE, *moved)), np.asarray(anew.geometry.points), rtol=0, atol=1e-12
    )


def test_derivatives_of_halves_are_exact(halves):
    parts, made = halves
    points = tuple(np.asarray(p.points) for p in parts)
    along = tuple(
        5e-5 * np.sin(p @ np.array([[1.0, 0, 2], [2, 0, 1], [0.5, 0, -1]]) + k) * [1, 0, 1]
        for k, p in enumerate(points)
    )
    volume = Volume(made.geometry.faces)

    def moved(s):
        return tuple(p + s[0] * d for p, d in zip(points, along, strict=True))

    found = remainder(lambda s: made(NONE, *moved(s)), jnp.zeros(1), jnp.ones(1))
    assert found.is_right
    h = 0.1

    def anew(s):
        return (
            Union(symmetry="y")
            .bind(*(p.moved(x) for p, x in zip(parts, moved([s]), strict=True)))
            .report.volume
        )

    slope = jax.grad(lambda s: volume.of(made(NONE, *moved(s)))[0])(jnp.zeros(1))
    assert float(slope[0]) == pytest.approx((anew(h) - anew(-h)) / (2 * h), rel=1e-7, abs=1e-10)


def test_it_does_not_hold_when_points_leave_the_plane():
    parts = PAIRS["wing on body"]
    made = Union(symmetry="y").bind(*parts)
    points = [np.asarray(p.points) for p in parts]
    assert not made.holds(points[0] + [0, 1e-3, 0], points[1])


def test_openings_that_cross_in_other_edges_do_not_hold():
    parts = PAIRS["ball in ball"]
    made = Union(symmetry="y").bind(*parts)
    points = [np.asarray(p.points) for p in parts]
    assert len(made.recipe.walls) == 2
    assert made.holds(points[0] + [1e-5, 0, 0], points[1])
    assert not made.holds(points[0] + [0.05, 0, 0.02], points[1])


def test_a_half_on_the_other_side_is_taken_as_well():
    parts = PAIRS["wing on body"]
    mirrored = [
        ml.Surface(np.asarray(p.points) * [1, -1, 1], np.asarray(p.faces)[:, ::-1]) for p in parts
    ]
    one, other = Union(symmetry="y").bind(*parts), Union(symmetry="y").bind(*mirrored)
    assert other.report.volume == pytest.approx(one.report.volume, rel=1e-13)
    assert np.asarray(other.geometry.points)[:, 1].max() == 0


@pytest.mark.parametrize("axis", ["x", "z"])
def test_the_plane_may_be_another(axis):
    turn = {"x": [1, 2, 0], "z": [2, 0, 1]}[axis]
    parts = PAIRS["wing on body"]
    turned = [p.moved(np.asarray(p.points)[:, turn]) for p in parts]
    made = Union(symmetry=axis).bind(*turned)
    assert made.report.volume == pytest.approx(
        Union(symmetry="y").bind(*parts).report.volume, rel=1e-13
    )


def test_faces_in_the_plane_are_a_cap_and_go():
    half = capped(PAIRS["wing on body"][1], tag="symmetry")[0]
    made = Union(symmetry="y").bind(PAIRS["wing on body"][0], half, names=["wing", "body"])
    plain = Union(symmetry="y").bind(*PAIRS["wing on body"], names=["wing", "body"])
    assert made.report.volume == pytest.approx(plain.report.volume, rel=1e-14)
    assert made.report.openings == 1
    # of two components the one in the plane is gone
    assert made.geometry.components == ("wing", "1")


def test_the_half_wing_of_the_examples_joins_a_half_body():
    wing_half = ml.read(TRANSPORT)
    points = np.asarray(wing_half.points)
    root = points[points[:, 1] == 0]
    middle = (root.max(axis=0) + root.min(axis=0)) / 2
    fuselage = body(60, angles=np.linspace(-np.pi / 2, np.pi / 2, 40), radius=4.1, length=70.0)
    fuselage = fuselage.moved(fuselage.points + middle)
    made = Union(symmetry="y").bind(wing_half, fuselage, names=["wing", "fuselage"])
    assert made.report.is_watertight and made.report.openings == 1
    assert made.geometry.components == ("1", "fuselage")
    assert health(capped(made.geometry)[0]).is_sound


def test_what_reaches_beyond_the_plane_is_refused():
    with pytest.raises(GeometryError, match=r"fin: 4 points lie beyond the symmetry plane y = 0"):
        Union(symmetry="y").bind(
            body(angles=HALF), box([0, -0.1, 0.2], [0.3, 0.1, 0.9]), names=["body", "fin"]
        )


def test_an_opening_elsewhere_is_refused():
    part = wing(closed_root=False, root=0.1)
    with pytest.raises(GeometryError, match=r"wing: an opening of 24 edges does not lie in"):
        Union(symmetry="y").bind(part, body(angles=HALF), names=["wing", "body"])
