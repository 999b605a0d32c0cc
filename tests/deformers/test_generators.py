"""Boxes that enclose what they are made for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import moldline as ml
from moldline.deformers.generators import along_wing, principal
from moldline.deformers.volume_frame import Box
from moldline.errors import GeometryError, ParameterError
from moldline.mesh.joined import joined_points
from moldline.mesh.planform import Planform

EDGE = 1e-12
"""What counts as on the border, in lengths of the box."""


def coordinates(lattice, points):
    """Box coordinates."""
    return (np.asarray(points) - lattice.origin) @ lattice.inverse


def encloses(lattice, points):
    u = coordinates(lattice, points)
    return bool(np.all((u >= -EDGE) & (u <= 1 + EDGE)))


def turn(angles):
    """A rotation about x, then y, then z."""
    out = np.eye(3)
    for i, angle in enumerate(angles):
        c, s = np.cos(angle), np.sin(angle)
        own = np.eye(3)
        j, k = (i + 1) % 3, (i + 2) % 3
        own[[j, j, k, k], [j, k, j, k]] = c, -s, s, c
        out = own @ out
    return out


def egg(axes=(3.0, 2.0, 1.0), ball=None):
    return ball.moved(np.asarray(ball.points) * axes)


@given(
    st.integers(2, 40),
    st.sampled_from([1e-6, 1e-3, 1.0, 1e4]),
    st.sampled_from([0.0, 1.0, -1e6]),
    st.sampled_from([(1, 1, 1), (1, 0, 1), (1e-3, 1, 1e-6), (1, 0, 0)]),
    st.sampled_from([0.0, 0.02, 1.0]),
    st.sampled_from(["axes", "principal"]),
    st.integers(0, 10**6),
)
@settings(max_examples=150, deadline=None)
def test_a_box_encloses_any_cloud_or_says_that_it_is_flat(
    count, size, offset, stretch, margin, align, seed
):
    rng = np.random.default_rng(seed)
    cloud = rng.uniform(-1, 1, (count, 3)) * stretch @ turn(rng.uniform(-3, 3, 3)) * size + offset
    try:
        lattice = ml.Lattice.over(cloud, (3, 3, 3), margin, align=align)
    except GeometryError as error:
        assert "is flat along" in str(error)
        # only where there is no thickness but what rounding leaves
        assert align == "principal"
        spread = np.linalg.svd(cloud - cloud.mean(axis=0), compute_uv=False)[-1]
        assert spread < 1e-12 * np.abs(cloud).max() * count or count < 4
        return
    assert encloses(lattice, cloud)
    if align == "axes":
        np.testing.assert_array_equal(lattice.edges, np.diag(np.diag(lattice.edges)))
    assert np.linalg.det(lattice.edges) > 0


def test_a_flat_cloud_gets_a_flat_lattice_where_asked():
    cloud = np.random.default_rng(0).uniform(0, 1, (50, 3)) * [3, 1, 0] @ turn((0, 0.5, 0.2)) + 10
    with pytest.raises(GeometryError, match="flat along z; give that axis one control point"):
        ml.Lattice.over(cloud, (4, 3, 2), align="principal")
    lattice = ml.Lattice.over(cloud, (4, 3, 1), align="principal")
    u = coordinates(lattice, cloud)[:, :2]
    assert u.min() > 0 and u.max() < 1
    assert np.abs(np.linalg.norm(lattice.edges[:2], axis=1) - [3.1, 1.0]).max() < 0.3


@pytest.mark.parametrize("angles", [(0, 0, 0), (0.2, -0.3, 0.4), (0, 0, -0.6), (0.1, 0.5, 0)])
def test_principal_axes_are_the_body_s_own(ball, angles):
    """An ellipsoid, turned: its axes are known; the box is as tight as along them."""
    body = egg(ball=ball)
    axes = turn(angles)
    there = body.moved(np.asarray(body.points) @ axes.T + [7, -2, 1])
    lattice = ml.Lattice.over(there, (4, 3, 3), 0.0, align="principal")
    rows = lattice.edges / np.linalg.norm(lattice.edges, axis=1, keepdims=True)
    # the ball's triangles have the symmetry of a cube: its moments are exact to the bias
    np.testing.assert_allclose(rows, axes.T, rtol=0, atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(lattice.edges, axis=1), [6, 4, 2], rtol=1e-7)
    assert encloses(lattice, there.points)


def test_principal_axes_are_those_of_the_area_not_of_the_points(ball):
    """More points at one end of a rod across do not turn the box."""
    rng = np.random.default_rng(0)
    flat = ml.Surface([[0, 0, 0], [4, 0, 0], [4, 1, 0.0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    loose = np.concatenate([flat.points, rng.uniform(0, 1, (500, 3)) * [0.1, 1, 0] + [3.9, 0, 0]])
    np.testing.assert_allclose(
        ml.Lattice.over(ml.Surface(loose, flat.faces), (3, 3, 1), align="principal").edges[:2]
        / [[4.16], [1.04]],
        np.eye(3)[:2],
        atol=1e-6,
    )
    own = principal(np.repeat(loose[:, None], 3, axis=1))
    assert np.abs(own[0, 1]) > 0.01


def test_a_body_of_revolution_gets_the_axes_of_space(ball):
    """Any two axes across are principal: those of space are taken."""
    body = egg((5.0, 1.0, 1.0), ball)
    lattice = ml.Lattice.over(body, (4, 3, 3), align="principal")
    np.testing.assert_allclose(lattice.edges, np.diag([10.4, 2.08, 2.08]), atol=1e-6)


def test_axes_are_right_handed_and_nearest_to_those_of_space(ball):
    tall = egg((1.0, 2.0, 3.0), ball)
    lattice = ml.Lattice.over(tall, (3, 3, 3), align="principal")
    np.testing.assert_allclose(lattice.edges, np.diag([2.08, 4.16, 6.24]), atol=1e-6)


def two_parts(ball):
    """A body of two components that nothing joins, side by side."""
    points = np.asarray(ball.points)
    return ml.Surface(
        np.concatenate([points, points * 0.3 + [5, 0, 0]]),
        np.concatenate([ball.faces, np.asarray(ball.faces) + len(points)]),
        np.repeat([0, 1], len(ball.faces)),
        ("body", "pod"),
    )


def test_a_box_over_a_component_encloses_it_alone(ball):
    both = two_parts(ball)
    lattice = ml.Lattice.over(both, (4, 4, 4), component="pod")
    own = both.component("pod")
    u = coordinates(lattice, both.points)
    inside = np.all((u >= 0) & (u <= 1), axis=1)
    np.testing.assert_array_equal(np.flatnonzero(inside), own)
    assert not lattice.frozen.any()
    same = ml.Lattice.around(both, (4, 4, 4), component="pod")
    np.testing.assert_array_equal(lattice.rest, same.rest)


def gaps(lattice, surface):
    edges = joined_points(surface)
    return lattice.tears(surface.points, edges, np.ones(lattice.size))[1]


def test_a_region_ends_where_one_says_and_nothing_tears(ball):
    region = [[0.2, -np.inf, -2], [np.inf, 0.5, 2]]
    lattice = ml.Lattice.over(ball, (8, 8, 5), region=region)
    assert lattice.origin[0] == 0.2
    assert lattice.origin[1] + lattice.edges[1, 1] == 0.5
    assert lattice.origin[0] + lattice.edges[0, 0] > 1
    frozen = lattice.frozen
    assert frozen[:3].all() and frozen[:, -3:].all()
    assert not frozen[3:, :5].any()
    covered = ball.points[np.all((ball.points >= region[0]) & (ball.points <= region[1]), axis=1)]
    assert encloses(lattice, covered)
    assert gaps(lattice, ball).max() < 1e-12
    torn = ml.Lattice.over(ball, (8, 8, 5), region=region, freeze=())
    assert gaps(torn, ball).max() > 0.5


def test_a_turned_box_over_a_region_does_not_tear_either(ball):
    body = egg((4.0, 1.0, 0.5), ball)
    turned = body.moved(np.asarray(body.points) @ turn((0.1, 0.2, 0.5)).T)
    lattice = ml.Lattice.over(
        turned, (8, 8, 8), region=[[0.5, -9, -9], [9, 9, 9]], align="principal"
    )
    assert lattice.frozen.any() and not lattice.frozen.all()
    assert gaps(lattice, turned).max() < 1e-12
    assert np.abs(lattice.edges[0, 1]) > 0.1


def test_a_region_on_the_plane_of_symmetry_freezes_nothing_there(ball):
    half = ball.moved(np.abs(ball.points))
    lattice = ml.Lattice.over(half, (4, 4, 4), region=[[-9, 0, -9], [9, 9, 9]])
    assert not lattice.frozen.any()
    assert lattice.origin[1] == 0.0


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        ({"region": [[0, 0, 0], [1, 1]]}, ParameterError, "two corners"),
        ({"region": [[0, 0, 0], [1, 0, 1]]}, ParameterError, "first below the second"),
        ({"region": [[0, 0, np.nan], [1, 1, 1]]}, ParameterError, "two corners"),
        ({"region": [[5, 5, 5], [6, 6, 6]]}, GeometryError, r"none of 1026 points .* they span \["),
        ({"align": "wing"}, ParameterError, "one of axes, principal, got 'wing'"),
        ({"component": "tail"}, GeometryError, "no component named 'tail'"),
        ({"margin": -0.1}, ParameterError, "of at least 0, got -0.1"),
        ({"margin": (0.1, 0.1)}, ParameterError, "one fraction or three"),
        (
            {"region": [[0, -2, -2], [2, 2, 2]], "shape": (3, 3, 3), "degree": 3},
            None,
            None,
        ),
        (
            {"region": [[0, -2, -2], [0.5, 2, 2]], "shape": (3, 3, 3)},
            ParameterError,
            "mesh crosses the sides x-, x\\+ of the box, which are therefore to stay: freezing",
        ),
    ],
)  # fmt: skip
def test_what_gives_no_box_is_refused(ball, options, error, said):
    options = {"shape": (4, 4, 4)} | options
    if error is None:
        assert ml.Lattice.over(ball, **options).frozen[:2].all()
        return
    with pytest.raises(error, match=said):
        ml.Lattice.over(ball, **options)


@pytest.mark.parametrize("align", ["axes", "principal"])
def test_points_that_cannot_be_enclosed_are_named(align):
    points = np.random.default_rng(0).uniform(0, 1, (10, 3))
    points[4, 1] = np.nan
    with pytest.raises(GeometryError, match=r"point 4 at \[.*nan.* not finite"):
        ml.Lattice.over(points, (3, 3, 3), align=align)
    with pytest.raises(GeometryError, match="none of 0 points"):
        ml.Lattice.over(np.empty((0, 3)), (3, 3, 3), align=align)
    with pytest.raises(GeometryError, match="flat along x"):
        ml.Lattice.over(np.ones((5, 3)), (3, 3, 3), align=align)


def test_a_case_file_takes_regions_and_principal_axes(ball):
    region = ((0.0, -2.0, -2.0), (2.0, 2.0, 2.0))
    built = ml.Lattice.build(ball, shape=(7, 4, 4), region=region)
    assert built.frozen[:3].all() and not built.frozen[3:].any()
    free = ml.Lattice.build(ball, shape=(7, 4, 4), region=region, freeze=())
    assert not free.frozen.any()
    turned = egg(ball=ball)
    turned = turned.moved(np.asarray(turned.points) @ turn((0, 0.4, 0)).T)
    own = ml.Lattice.build(turned, shape=(4, 4, 4), align="principal")
    assert np.abs(own.edges[0, 2]) > 0.1
    with pytest.raises(ParameterError, match="not with low and high"):
        ml.Lattice.build(
            ball, shape=(4, 4, 4), region=region, low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0)
        )
    with pytest.raises(ParameterError, match="where it is streamed"):
        ml.Lattice.build(ml.Cloud(ball.points), shape=(4, 4, 4), region=region)


def wing(tip=0.3, sweep=0.5, twist=-0.08, dihedral=0.1, kink=0.4, span=8.0, rounded=True):
    """Sections with a kink in the trailing edge, and its planform."""
    eta = np.linspace(0, 1, 41)
    chord = np.interp(eta, [0, kink, 1], [2.0, 1.0, 2.0 * tip])
    if rounded:
        chord = chord * np.sqrt(np.clip(1 - ((eta - 0.95) / 0.05).clip(0) ** 2 * 0.99, 0, 1))
    y = eta * span
    leading = np.stack([np.tan(sweep) * y, y, np.tan(dihedral) * y], axis=1)
    along = np.stack([np.cos(twist * eta), 0 * eta, -np.sin(twist * eta)], axis=1)
    trailing = leading + chord[:, None] * along
    t = np.linspace(0, 2 * np.pi, 41)
    s, h = (1 - np.cos(t)) / 2, 0.06 * np.sin(t) + 0.02 * np.sin(t / 2)
    up = np.stack([-along[:, 2], 0 * eta, along[:, 0]], axis=1)
    points = leading[:, None] + chord[:, None, None] * (
        s[:, None] * along[:, None] + h[:, None] * up[:, None]
    )
    low, high = points[..., 2].min(axis=1), points[..., 2].max(axis=1)
    return points.reshape(-1, 3), Planform(y, leading, trailing, low, high)


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("spanwise", [2, 3, 5, 9])
@pytest.mark.parametrize("options", [{}, {"tip": 0.0}, {"sweep": -0.6, "twist": 0.3}])
def test_a_wing_s_box_encloses_it_whatever_the_spline(degree, spanwise, options):
    points, plan = wing(**options)
    box = along_wing(points, plan, (5, spanwise, 3), 0.01, (degree,) * 3)
    volume = ml.ControlVolume([Box.of("wing", box, degree)])
    volume.bind(points)  # refuses points outside
    assert box[..., 1].min() == 0.0
    assert box[..., 1].max() > points[:, 1].max()


def test_a_wing_s_box_is_swept_tapered_and_tight():
    points, plan = wing(rounded=False)
    box = along_wing(points, plan, (4, 9, 2), 0.02, (3, 3, 3))
    hull = np.prod(np.ptp(points, axis=0))
    chord = box[-1, :, 0, 0] - box[0, :, 0, 0]
    height = box[0, :, -1, 2] - box[0, :, 0, 2]
    volume = np.trapezoid(chord * height, box[0, :, 0, 1])
    assert volume < 0.1 * hull
    assert chord[-1] < 0.45 * chord[0]
    own = np.interp(box[0, :, 0, 1], plan.stations, plan.chord)
    assert np.all(chord > own) and np.all(chord < 1.25 * own + 0.1)
    assert np.tan(0.5) == pytest.approx(
        (box[0, -2, 0, 0] - box[0, 1, 0, 0]) / np.ptp(box[0, 1:-1, 0, 1]), rel=0.05
    )


@pytest.mark.parametrize("mirror", [False, True])
def test_whole_wings_and_left_halves_are_enclosed_too(mirror):
    points, plan = wing()
    left = points * [1, -1, 1]
    both = left if mirror else np.concatenate([points, left])
    box = along_wing(both, plan, (4, 8, 2), 0.02, (3, 3, 3))
    ml.ControlVolume([Box.of("wing", box)]).bind(both)
    if mirror:
        assert box[..., 1].max() == 0.0
    else:
        np.testing.assert_allclose(box[:, ::-1] * [1, -1, 1], box, rtol=0, atol=1e-9)


def test_stations_of_a_wing_s_box_are_chosen():
    points, plan = wing()
    rows = (0.0, 2.0, 3.2, 6.0, 8.1)
    box = along_wing(points, plan, (4, 5, 2), 0.02, (3, 1, 3), rows)
    np.testing.assert_array_equal(box[0, :, 0, 1], rows)
    ml.ControlVolume([Box.of("wing", box, (3, 1, 3))]).bind(points)
    cubic = along_wing(points, plan, (4, 5, 2), 0.02, (3, 3, 3), rows)
    ml.ControlVolume([Box.of("wing", cubic)]).bind(points)
    with pytest.raises(ParameterError, match=r"as many as its 5 .* that take in 0..8, got"):
        along_wing(points, plan, (4, 5, 2), 0.02, (3, 1, 3), (0, 1, 2, 3, 7))


def surface_of(points, sections=41):
    """The wing's skin as triangles, open at both ends."""
    number = np.arange(len(points)).reshape(sections, -1)
    a, b, c, d = (
        number[i : i - 1 or None, j : j - 1 or None] for i, j in ((0, 0), (0, 1), (1, 1), (1, 0))
    )
    faces = np.stack([[a, d, b], [d, c, b]]).reshape(2, 3, -1).transpose(0, 2, 1)
    return ml.Surface(points, faces.reshape(-1, 3))


@pytest.mark.parametrize("side", [1, -1])
def test_a_control_volume_along_a_wing_encloses_it(side):
    surface = surface_of(wing()[0] * [1, side, 1])
    volume = ml.ControlVolume.along_wing(surface, (6, 5, 2))
    assert volume.frame.boxes[0].points.shape == (6, 5, 2, 3)
    moved = np.asarray(volume.bind(surface.points)(np.full(volume.size, 0.1)))
    np.testing.assert_allclose(moved, surface.points + 0.1, rtol=0, atol=1e-12)
    built = ml.ControlVolume.build(surface, wing=True, shape=(6, 5, 2))
    np.testing.assert_array_equal(built.rest, volume.rest)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({}, "either file, or wing = true and shape"),
        ({"wing": True}, "either file, or wing = true and shape"),
        ({"wing": True, "shape": (4, 4, 1)}, r"needs 2 control points each way, got \(4, 4, 1\)"),
        ({"wing": True, "shape": (4, 4, 2), "component": "tail"}, "no component named 'tail'"),
        ({"wing": True, "shape": (4, 4, 2), "margin": -1.0}, "of at least 0, got -1.0"),
    ],
)
def test_what_gives_no_box_along_a_wing_is_refused(options, said):
    with pytest.raises((ParameterError, GeometryError), match=said):
        ml.ControlVolume.build(surface_of(wing()[0]), **options)


def test_a_wing_s_box_needs_a_surface():
    with pytest.raises(GeometryError, match="needs a surface, got a Cloud"):
        ml.ControlVolume.along_wing(ml.Cloud(wing()[0]), (4, 4, 2))
