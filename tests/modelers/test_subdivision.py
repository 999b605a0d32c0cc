"""Loop's subdivision: weights, borders, creases, data and derivatives."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

import moldline as ml
from moldline.errors import GeometryError, ParameterError
from moldline.mesh import topology
from moldline.mesh.quality import signed_volume
from moldline.modelers.subdivision import Subdivision
from moldline.numerics.taylor import remainder

NONE = np.zeros(0)


def icosahedron():
    solid = trimesh.creation.icosahedron()
    return ml.Surface(np.asarray(solid.vertices), np.asarray(solid.faces))


def plate(across=8):
    """A flat square of regular triangles, x and y from 0 to 1."""
    i, j = np.meshgrid(np.arange(across + 1), np.arange(across + 1), indexing="ij")
    points = np.stack([i.ravel(), j.ravel(), 0 * i.ravel()], axis=1) / across
    a = (i[:-1, :-1] * (across + 1) + j[:-1, :-1]).ravel()
    b, c, d = a + across + 1, a + across + 2, a + 1
    return ml.Surface(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def box():
    solid = trimesh.creation.box()
    return ml.Surface(np.asarray(solid.vertices), np.asarray(solid.faces))


def bound(surface, *given, **options):
    return Subdivision(*given, **options).bind(surface)


def moved_data(surface, tags, names, **data):
    return ml.Surface(surface.points, surface.faces, tags, names, **data)


@pytest.mark.parametrize("levels", [1, 2, 3])
@pytest.mark.parametrize("shape", ["icosahedron", "ball"])
def test_a_closed_surface_is_refined_as_trimesh_does(shape, levels, ball):
    surface = icosahedron() if shape == "icosahedron" else ball
    mine = bound(surface, levels).geometry
    theirs, faces = trimesh.remesh.subdivide_loop(
        np.asarray(surface.points), np.asarray(surface.faces), iterations=levels
    )
    assert len(mine.faces) == len(faces) == 4**levels * len(surface.faces)
    far, partner = cKDTree(theirs).query(mine.points)
    assert far.max() < 1e-14
    assert len(np.unique(partner)) == len(theirs) == len(mine.points)


def test_on_a_regular_mesh_quadratic_heights_stay_quadratic_with_the_same_bends():
    """The limit is a quartic box spline: it keeps affine heights, and shifts quadratic ones."""
    coarse = plate(12)
    matrix = bound(coarse, 1).matrix

    def heights(points):
        x, y, _ = np.asarray(points).T
        return np.stack([x - 2 * y, x**2, x * y, y**2], axis=1)

    fine = matrix @ np.asarray(coarse.points)
    inside = np.all(np.abs(fine[:, :2] - 0.5) < 0.3, axis=1)
    shift = (matrix @ heights(coarse.points) - heights(fine))[inside]
    np.testing.assert_allclose(shift, np.broadcast_to(shift[:1], shift.shape), rtol=0, atol=1e-15)
    assert abs(shift[0, 0]) < 1e-15 < shift[0, 1]


@pytest.mark.parametrize("levels", [1, 3])
def test_a_border_is_refined_as_a_cubic_b_spline_whatever_lies_inside(levels):
    surface = plate(4)
    rim = topology.boundary_loops(surface.faces)[0]
    heights = 0.3 * np.sin(7 * np.arange(len(surface.points)))
    points = np.asarray(surface.points) + heights[:, None] * [0.1, 0.2, 1]
    fine = bound(surface.moved(points), levels).geometry
    curve = points[rim]
    for _ in range(levels):
        before, after = np.roll(curve, 1, axis=0), np.roll(curve, -1, axis=0)
        pairs = np.stack([0.125 * before + 0.75 * curve + 0.125 * after, (curve + after) / 2], 1)
        curve = pairs.reshape(-1, 3)
    found = np.asarray(fine.points)[np.unique(topology.edges(fine.faces).open)]
    assert len(found) == len(curve)
    assert cKDTree(curve).query(found)[0].max() < 1e-15


def test_weights_of_each_point_sum_to_one_and_affine_maps_commute(ball):
    made = bound(ball, 2, sharp_angle=0.12)
    np.testing.assert_allclose(made.matrix.sum(axis=1), 1, rtol=0, atol=5e-15)
    points, turn = np.asarray(ball.points), np.array([[1, 2, 0], [0, 0.5, 1], [3, 0, 1.0]])
    shift = np.array([1.0, 2, 3])
    np.testing.assert_allclose(
        made(NONE, points @ turn + shift), made(NONE, points) @ turn + shift, rtol=0, atol=1e-13
    )


def test_closed_stays_closed_and_an_icosahedron_becomes_round():
    coarse = icosahedron()
    fine = bound(coarse, 4).geometry
    edges = topology.edges(fine.faces)
    assert topology.is_closed(fine.faces)
    assert not len(edges.misoriented)
    assert len(fine.points) - len(edges.ends) + len(fine.faces) == 2
    radius = np.linalg.norm(np.asarray(fine.points), axis=1)
    assert np.ptp(radius) < 0.02 * radius.mean()
    assert signed_volume(fine) > 0


def test_a_box_with_all_edges_sharp_stays_a_box():
    coarse = box()
    fine = bound(coarse, 3, sharp_angle=1.0).geometry
    np.testing.assert_array_equal(fine.points[:8], coarse.points)
    assert np.all(np.abs(np.asarray(fine.points)).max(axis=1) == 0.5)
    assert signed_volume(fine) == pytest.approx(1.0, abs=1e-14)
    assert signed_volume(bound(coarse, 3).geometry) < 0.5


def test_listed_creases_are_what_the_angle_finds():
    coarse = box()
    edges = topology.edges(coarse.faces).ends
    lengths = np.linalg.norm(np.diff(np.asarray(coarse.points)[edges], axis=1)[:, 0], axis=1)
    listed = bound(coarse, 2, creases=edges[lengths < 1.1][:, ::-1])
    found = bound(coarse, 2, sharp_angle=1.0)
    assert abs(listed.matrix - found.matrix).max() == 0


def test_a_crease_stays_sharp_and_runs_as_a_b_spline():
    """A tent's ridge: the normals' angle across it stays, and only its own points place it."""
    flat = plate(6)
    points = np.asarray(flat.points).copy()
    points[:, 2] = 0.5 - np.abs(points[:, 0] - 0.5)
    tent = flat.moved(points)
    ridge = np.flatnonzero(points[:, 0] == 0.5)
    made = bound(tent, 3, creases=np.stack([ridge[:-1], ridge[1:]], axis=1))
    fine = np.asarray(made.geometry.points)
    on_ridge = np.flatnonzero(np.isclose(fine[:, 0], 0.5, rtol=0, atol=1e-14))
    np.testing.assert_allclose(fine[on_ridge, 2], 0.5, rtol=0, atol=1e-14)
    weights = made.matrix[on_ridge].tocoo()
    assert set(weights.col[weights.data > 0]) == set(ridge)
    smooth = np.asarray(bound(tent, 3).geometry.points)
    assert smooth[:, 2].max() < 0.48


def test_three_creases_make_a_corner_and_one_ends_softly():
    flat = plate(6)
    middle = 3 * 7 + 3
    around = [middle + 7, middle + 1, middle - 8]
    creases = [[middle, k] for k in around]
    assert np.array_equal(
        bound(flat, 1, creases=creases).geometry.points[middle], flat.points[middle]
    )
    row = bound(flat, 1, creases=creases[:1]).matrix[[middle]].tocoo()
    assert sorted(row.data) == pytest.approx([1 / 16] * 6 + [10 / 16])


def test_corners_stay_and_so_do_lone_points():
    flat = plate(2)
    lone = ml.Surface(np.append(flat.points, [[5.0, 5, 5]], axis=0), flat.faces)
    fine = np.asarray(bound(lone, 2, corners=[0, 8]).geometry.points)
    np.testing.assert_array_equal(fine[[0, 8, 9]], np.asarray(lone.points)[[0, 8, 9]])
    assert not np.array_equal(fine[2], flat.points[2])


def test_components_and_data_go_to_the_children(ball):
    points = np.asarray(ball.points)
    middle = points[np.asarray(ball.faces)].mean(axis=1)
    tags = (middle[:, 2] > 0).astype(int)
    data = {"heat": middle[:, 0], "zone": np.arange(len(tags))}
    own = {"height": points[:, 2], "number": np.arange(len(points))}
    surface = moved_data(ball, tags, ("low", "high"), face_data=data, point_data=own)
    smooth, sharp = (bound(surface, 2, component_borders=b).geometry for b in (False, True))
    assert smooth.components == ("low", "high")
    np.testing.assert_array_equal(smooth.tags, np.repeat(tags, 16))
    np.testing.assert_array_equal(smooth.face_data["zone"], np.repeat(np.arange(len(tags)), 16))
    assert list(smooth.point_data) == ["height"]
    np.testing.assert_allclose(smooth.point_data["height"], smooth.points[:, 2], atol=1e-15)
    rim = np.intersect1d(sharp.component("low"), sharp.component("high"))
    np.testing.assert_array_equal(np.asarray(sharp.points)[rim, 2], 0)
    radius = np.linalg.norm(np.asarray(sharp.points)[rim], axis=1)
    assert radius.min() > np.linalg.norm(np.asarray(smooth.points)[rim], axis=1).max()


def test_the_matrix_is_the_derivative_in_both_modes(ball):
    made, points = bound(ball, 2), np.asarray(ball.points)
    along = np.sin(5 * points)
    told = remainder(lambda p: made(NONE, p), points, along)
    assert told.is_linear
    _, tangent = jax.jvp(lambda p: made(NONE, p), (points,), (along,))
    np.testing.assert_allclose(tangent, made.matrix @ along, rtol=0, atol=1e-14)
    value, pull = jax.vjp(lambda p: made(NONE, p), points)
    np.testing.assert_allclose(pull(value)[0], made.matrix.T @ np.asarray(value), atol=1e-13)
    np.testing.assert_allclose(jax.jit(lambda p: made(NONE, p))(points), value, atol=1e-15)
    np.testing.assert_allclose(made.product.plain(points)[0], value, rtol=0, atol=1e-14)
    np.testing.assert_allclose(made.geometry.points, value, rtol=0, atol=0)
    assert made.holds(points)


def test_a_refined_measure_has_its_exact_derivative(ball):
    made, points = bound(ball, 1), np.asarray(ball.points)

    def volume(coarse):
        a, b, c = (made(NONE, coarse)[made.geometry.faces[:, k]] for k in range(3))
        return jnp.sum(a * jnp.cross(b, c))[None] / 6

    assert volume(points)[0] == pytest.approx(signed_volume(made.geometry), rel=1e-12)
    assert remainder(volume, points, 0.1 * np.cos(points)).is_right


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"levels": 0}, "levels must be 1 to 12, got 0"),
        ({"sharp_angle": 4.0}, r"between 0 and pi \[rad\], got 4.0"),
        ({"creases": [0, 1]}, "pairs of points"),
        ({"creases": [[0.5, 1]]}, "pairs of points"),
        ({"levels": 12}, "give fewer levels"),
    ],
)
def test_other_options_are_refused(options, said, ball):
    with pytest.raises(ParameterError, match=said):
        bound(ball, **options)


def test_rows_of_different_lengths_in_a_case_are_told():
    with pytest.raises(ParameterError, match="creases must be numbers, in rows of one length"):
        Subdivision.build(Path(), creases=[[0, 1], [2]])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"creases": [[0, 3]]}, "1 of 1 creases are no edges.*joins the points 0 and 3"),
        ({"creases": [[0, 3000]]}, "crease 0 refers to 3000"),
        ({"corners": [-1]}, "corner 0 refers to -1"),
    ],
)
def test_creases_that_are_not_there_are_refused(options, said, ball):
    with pytest.raises(GeometryError, match=said):
        bound(ball, **options)


def test_only_one_surface_of_real_triangles_is_refined(ball):
    with pytest.raises(GeometryError, match="refines one surface, got Surface, Surface"):
        Subdivision().bind(ball, ball)
    with pytest.raises(GeometryError, match="refines one surface, got Section"):
        Subdivision().bind(ml.Section(np.eye(3)))
    with pytest.raises(GeometryError, match=r"face 1 uses a point twice \(\[0, 0, 1\]\)"):
        Subdivision().bind(ml.Surface(np.eye(3), [[0, 1, 2], [0, 0, 1]]))
    assert Subdivision().takes == (1, 1)
    assert Subdivision().size == 0
