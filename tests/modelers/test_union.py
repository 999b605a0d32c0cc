"""The wetted surface: values, provenance, and when it must be made anew."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from overlapping import body, box, rotation, sphere, wing

import moldline as ml
from moldline.errors import GeometryError
from moldline.measures.volume import Volume
from moldline.mesh import quality, topology
from moldline.mesh.health import health
from moldline.modelers.union import Union
from moldline.numerics.taylor import remainder

NONE = np.zeros(0)
SMALL = {"transport": 1e-3, "spheres": 2e-4}  # amplitudes at which nothing crosses anew [m]


@pytest.fixture(scope="module")
def transport():
    """A wing through a body, whose curve runs through faces of every shape."""
    parts = wing(), body()
    return parts, Union().bind(*parts, names=["wing", "fuselage"])


@pytest.fixture(scope="module")
def spheres():
    """Three that overlap, with two points where all three meet."""
    parts = sphere(), sphere([1, 0.1, 0], turn=0.3), sphere([0.4, 1, 0.2], turn=0.7)
    return parts, Union().bind(*parts)


def points_of(parts):
    return tuple(np.asarray(p.points) for p in parts)


def swayed(parts, size, seed=0):
    """Smoothly moved, each part in another way."""
    rng = np.random.default_rng(seed)
    out = []
    for part in parts:
        p = np.asarray(part.points)
        waves, phase = rng.normal(size=(3, 3)), rng.normal(size=3)
        out.append(p + size * np.sin(p @ waves + phase))
    return tuple(out)


def test_volume_and_area_of_two_boxes_are_right():
    made = Union().bind(box([0, 0, 0], [1, 1, 1]), box([0.5, 0.4, 0.3], [1.5, 1.5, 1.5]))
    shared = 0.5 * 0.6 * 0.7
    sides = 2 * (0.5 * 0.6 + 0.6 * 0.7 + 0.7 * 0.5)
    others = 2 * (1.0 * 1.1 + 1.1 * 1.2 + 1.2 * 1.0)
    assert made.report.volume == pytest.approx(1 + 1.0 * 1.1 * 1.2 - shared, rel=1e-14)
    # what of either lies inside the other is together the whole surface of what they share
    assert made.report.area == pytest.approx(6 + others - sides, rel=1e-14)
    assert made.report.is_watertight
    assert (made.report.genus, made.report.pieces) == (0, 1)


def test_a_ball_on_a_box_adds_a_cap():
    ball = sphere([0.5, 0.5, 1.1], 0.3, level=5)
    made = Union().bind(box([0, 0, 0], [1, 1, 1], 3), ball)
    h = 0.4  # of the part of the ball above the box
    cap = np.pi * h**2 * (3 * 0.3 - h) / 3
    assert made.report.volume == pytest.approx(1 + cap, abs=2e-4)  # faces lie inside the ball


def test_a_bar_through_a_box_makes_no_handle_but_four_bars_make_one():
    bars = [
        box([0, 0, 0], [4, 1, 1]),
        box([3.1, 0.1, 0.1], [3.9, 4.1, 0.9]),
        box([0.2, 3.2, 0.2], [3.7, 4.3, 0.8]),
        box([0.1, 0.3, 0.15], [0.8, 3.9, 0.85]),
    ]
    assert Union().bind(*bars[:2]).report.genus == 0
    assert Union().bind(*bars).report.genus == 1


def test_a_wetted_surface_is_sound_and_keeps_its_names(transport):
    parts, made = transport
    assert health(made.geometry).is_sound
    assert made.geometry.components == ("wing", "fuselage")
    tags = np.asarray(made.geometry.tags)
    middle = np.asarray(made.geometry.points)[made.geometry.faces].mean(axis=1)
    assert np.all(middle[tags == 0][:, 1] > 0.3)
    assert made.report.components["wing"] == np.sum(tags == 0)
    whole = [quality.signed_volume(p) for p in parts]
    assert max(whole) < made.report.volume < sum(whole)


def test_points_of_the_components_are_kept_to_the_bit(transport):
    parts, made = transport
    own = {tuple(row) for part in parts for row in np.asarray(part.points)}
    points = np.asarray(made.geometry.points)
    assert all(tuple(row) in own for row in points[: made.report.kept])
    used = {tuple(row) for row in points[made.report.kept :]}
    assert not used & own
    moved = swayed(parts, 0.002)
    new = np.asarray(made(NONE, *moved))
    for keep, part, at in zip(
        made.recipe.kept, moved, np.cumsum([0, len(made.recipe.kept[0])]), strict=True
    ):
        assert np.array_equal(new[at : at + len(keep)], part[keep])


def test_points_on_the_curve_lie_on_both_components(transport):
    parts, made = transport
    curve = np.asarray(made.geometry.points)[made.report.kept :]
    for part in parts:
        corners = np.asarray(part.points)[part.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        off = np.abs(np.einsum("fi,pfi->pf", normal, curve[:, None] - corners[None, :, 0]))
        assert off.min(axis=1).max() < 1e-14
    assert made.report.residual < 1e-14


def test_three_spheres_meet_in_two_points(spheres):
    _, made = spheres
    assert made.report.on_triples == 2
    assert health(made.geometry).is_sound
    assert made.report.genus == 0
    triples = np.asarray(made.geometry.points)[-2:]
    centres = np.array([[0, 0, 0], [1, 0.1, 0], [0.4, 1, 0.2]])
    distances = np.linalg.norm(triples[:, None] - centres, axis=2)
    assert np.all((distances > 0.95) & (distances < 1))  # on faces, a little inside the spheres


def test_the_order_of_the_components_does_not_matter(spheres):
    parts, made = spheres
    other = Union().bind(*parts[::-1])
    assert other.report.volume == pytest.approx(made.report.volume, rel=1e-14)
    assert other.report.area == pytest.approx(made.report.area, rel=1e-13)
    assert other.report.points == made.report.points


def test_a_call_with_the_points_that_it_was_bound_to_gives_its_geometry(spheres):
    parts, made = spheres
    again = np.asarray(made(NONE, *points_of(parts)))
    assert np.array_equal(again, np.asarray(made.geometry.points))


@pytest.mark.parametrize("which", ["transport", "spheres"])
def test_following_gives_what_a_new_union_gives(which, request):
    parts, made = request.getfixturevalue(which)
    moved = swayed(parts, SMALL[which])
    assert made.holds(*moved)
    anew = Union().bind(*(s.moved(p) for s, p in zip(parts, moved, strict=True)))
    np.testing.assert_allclose(
        np.asarray(made(NONE, *moved)), np.asarray(anew.geometry.points), rtol=0, atol=1e-12
    )
    follower = made.geometry.moved(made(NONE, *moved))
    assert quality.signed_volume(follower) == pytest.approx(anew.report.volume, rel=1e-13)
    assert quality.area(follower) == pytest.approx(anew.report.area, rel=1e-12)


@pytest.mark.parametrize("which", ["transport", "spheres"])
def test_derivatives_are_exact(which, request):
    parts, made = request.getfixturevalue(which)
    points = points_of(parts)
    along = tuple(b - a for a, b in zip(points, swayed(parts, SMALL[which]), strict=True))
    volume = Volume(made.geometry.faces)

    def moved(s):
        return tuple(p + s * d for p, d in zip(points, along, strict=True))

    found = remainder(lambda s: made(NONE, *moved(s[0])), jnp.zeros(1), jnp.ones(1))
    assert found.is_right and not found.is_linear
    found = remainder(lambda s: volume.of(made(NONE, *moved(s[0]))), jnp.zeros(1), jnp.ones(1))
    assert found.is_right


def test_forward_and_reverse_agree(spheres):
    parts, made = spheres
    points = tuple(jnp.asarray(p) for p in points_of(parts))
    rng = np.random.default_rng(2)
    along = tuple(jnp.asarray(rng.normal(size=p.shape)) for p in points)
    weights = jnp.asarray(rng.normal(size=made.geometry.points.shape))
    forward = jax.jit(lambda p, d: jax.jvp(lambda *x: made(NONE, *x), p, d)[1])(points, along)
    reverse = jax.jit(lambda p: jax.vjp(lambda *x: made(NONE, *x), *p)[1](weights))(points)
    one = float(jnp.vdot(weights, forward))
    other = sum(float(jnp.vdot(r, d)) for r, d in zip(reverse, along, strict=True))
    assert one == pytest.approx(other, rel=1e-12)


def test_second_derivatives_come_along(spheres):
    parts, made = spheres
    points = tuple(jnp.asarray(p) for p in points_of(parts))
    along = tuple(jnp.asarray(b - a) for a, b in zip(points, swayed(parts, 1.0), strict=True))
    volume = Volume(made.geometry.faces)

    def slope(s):
        def value(t):
            return volume.of(made(NONE, *(p + t * d for p, d in zip(points, along, strict=True))))[
                0
            ]

        return jax.grad(value)(s)

    h = 1e-4
    second = float(jax.grad(slope)(0.0))
    assert second == pytest.approx(float(slope(h) - slope(-h)) / (2 * h), rel=1e-5)


@pytest.mark.parametrize("which", ["transport", "spheres"])
def test_volume_and_area_change_as_unions_made_anew_do(which, request):
    parts, made = request.getfixturevalue(which)
    points = points_of(parts)
    along = tuple(b - a for a, b in zip(points, swayed(parts, 1.0), strict=True))
    faces = made.geometry.faces

    def at(h):
        return (
            Union(crossings="allow")
            .bind(*(s.moved(p + h * d) for s, p, d in zip(parts, points, along, strict=True)))
            .report
        )

    def area(p):
        a, b, c = (p[faces[:, i]] for i in range(3))
        return jnp.sum(jnp.linalg.norm(jnp.cross(b - a, c - a), axis=1)) / 2

    dx = jax.jvp(lambda *p: made(NONE, *p), points, along)[1]
    x = jnp.asarray(made.geometry.points)
    h = 1e-6
    up, down = at(h), at(-h)
    slopes = {
        "volume": jax.jvp(lambda p: Volume(faces).of(p)[0], (x,), (dx,))[1],
        "area": jax.jvp(area, (x,), (dx,))[1],
    }
    for name, slope in slopes.items():
        difference = (getattr(up, name) - getattr(down, name)) / (2 * h)
        assert float(slope) == pytest.approx(difference, rel=1e-7, abs=1e-8)


def test_it_holds_for_small_motions_only(transport):
    parts, made = transport
    assert made.holds(*points_of(parts))
    assert made.holds(*swayed(parts, 1e-4))
    assert not made.holds(*swayed(parts, 0.1))


def test_it_does_not_hold_when_parts_meet_in_another_place():
    # the wing's far tip dips into a bump of the body, where nothing crossed before
    one = box([0, 0, 0], [1, 1, 1], 4)
    other = sphere([0.5, 0.47, 1.02], 0.3)
    far = sphere([0.5, 0.47, -0.5], 0.3)
    both = ml.Surface(
        np.concatenate([other.points, far.points]),
        np.concatenate([other.faces, far.faces + len(other.points)]),
    )
    made = Union().bind(one, both)
    near = np.array(both.points)
    near[len(other.points) :, 2] += 0.19
    assert made.holds(one.points, near)  # still short of the box by 1 cm
    near[len(other.points) :, 2] += 0.02
    assert not made.holds(one.points, near)


def test_it_does_not_hold_when_a_free_piece_goes_inside():
    one = box([0, 0, 0], [1, 1, 1])
    other = sphere([0.5, 0.47, 1.02], 0.2)
    far = sphere([0.5, 0.47, -0.5], 0.2)
    both = ml.Surface(
        np.concatenate([other.points, far.points]),
        np.concatenate([other.faces, far.faces + len(other.points)]),
    )
    made = Union().bind(one, both)
    gone = np.array(both.points)
    gone[len(other.points) :, 2] += 0.8  # crosses nothing there either
    assert not made.holds(one.points, gone)


def test_where_it_no_longer_holds_a_call_says_so(transport):
    parts, made = transport
    wing_points, body_points = points_of(parts)
    lifted = wing_points + [0, 0, 0.1]
    with pytest.raises(GeometryError, match=r"no longer cross .* pipeline.at\(values\)"):
        made(NONE, lifted, body_points)
    with pytest.raises(Exception, match="no longer cross where they did"):
        jax.jit(lambda p: made(NONE, p, body_points))(lifted).block_until_ready()


def test_edges_that_meet_edges_are_traced_to_the_sharp_one():
    # sides of either run through the diagonals of the other's faces
    made = Union().bind(box([0, 0, 0], [1, 1, 1]), box([0.5, 0.5, 0.5], [1.5, 1.5, 1.5]))
    assert made.report.volume == pytest.approx(1.875, rel=1e-14)
    assert made.report.residual < 1e-15
    low, high = points_of((box([0, 0, 0], [1, 1, 1]), box([0.5, 0.5, 0.5], [1.5, 1.5, 1.5])))
    lift = np.broadcast_to([0.0, 0.0, 1.0], high.shape)
    dx = jax.jvp(lambda p: made(NONE, low, p), (high,), (lift,))[1]
    slope = jax.jvp(
        lambda p: Volume(made.geometry.faces).of(p)[0], (jnp.asarray(made.geometry.points),), (dx,)
    )[1]
    assert float(slope) == pytest.approx(0.25, rel=1e-12)  # what they share loses its bottom


def test_pieces_turned_in_space_change_nothing(transport):
    parts, made = transport
    turn = rotation(0.4)
    turned = [s.moved(np.asarray(s.points) @ turn.T + [3.0, -2.0, 5.0]) for s in parts]
    other = Union().bind(*turned)
    assert other.report.volume == pytest.approx(made.report.volume, rel=1e-12)
    assert other.report.points == made.report.points


def test_the_report_tells_figures_and_sentences(transport):
    _, made = transport
    told = " ".join(made.report.sentences())
    assert "wetted surface of wing (" in told and "watertight, 1 piece, genus 0" in told
    assert made.report.as_dict()["on_edges"] == len(made.recipe.edges)
    assert made.report.points == len(made.geometry.points)
    assert topology.is_closed(made.geometry.faces)
