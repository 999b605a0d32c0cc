"""Control volumes: embedding, shared faces, what is refused, files of other programs."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import BSpline

import moldline as ml
from moldline import links
from moldline.deformers.volume_frame import Box
from moldline.errors import GeometryError, ParameterError
from moldline.mesh.io.su2_boxes import read_boxes


def grid(counts, low=(0, 0, 0), high=(1, 1, 1)):
    """Evenly spaced control points."""
    lines = [np.linspace(a, b, n) for a, b, n in zip(low, high, counts, strict=True)]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)


def swept(counts=(6, 3, 5)):
    """A tapered, swept and bent box such as one puts around a wing."""
    u, v, w = np.moveaxis(grid(counts), -1, 0)
    chord = 3 - 2 * w
    return np.stack([2 * w + chord * u, chord * 0.2 * (v - 0.5) + 0.3 * w**2, 8 * w], axis=-1)


def weights(count, degree, u):
    """Clamped uniform B-splines as SciPy has them."""
    degree = min(degree, count - 1)
    inner = np.linspace(0, 1, count - degree + 1)[1:-1]
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    return BSpline.design_matrix(u, knots, degree).toarray()


def place(points, u, degree=3):
    """Where box coordinates lie in space."""
    w = [weights(n, degree, u[:, i]) for i, n in enumerate(points.shape[:3])]
    return np.einsum("ni,nj,nk,ijkd->nd", *w, points)


@pytest.fixture
def inside():
    """Box coordinates, some on the faces, edges and corners."""
    u = np.random.default_rng(0).uniform(0, 1, (300, 3))
    u[:50, 0], u[25:75, 1], u[40:60, 2] = 0.0, 1.0, 0.0
    return u


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_points_are_found_where_they_were_put(inside, degree):
    box = swept()
    found = ml.ControlVolume([Box.of("wing", box, degree)]).embedded(place(box, inside, degree))
    assert np.all(found.volume == 0)
    np.testing.assert_allclose(found.u, inside, rtol=0, atol=1e-12)
    assert found.miss.max() < 1e-14 * 10
    assert found.steps.max() <= 12


def test_points_move_as_the_spline_of_the_moved_control_points(inside):
    box = swept()
    volume = ml.ControlVolume([Box.of("wing", box)])
    moves = 0.1 * np.random.default_rng(1).normal(size=(*box.shape[:3], 3))
    moved = volume.bind(place(box, inside))(moves.ravel())
    np.testing.assert_allclose(moved, place(box + moves, inside), rtol=0, atol=1e-14 * 20)


def test_a_straight_box_moves_points_as_a_lattice_does():
    """With its control points where the lattice has its own."""
    lattice = ml.Lattice.box((0, 0, 0), (2, 1, 1), (5, 4, 3))
    volume = ml.ControlVolume([Box.of("1", lattice.rest)])
    points = np.random.default_rng(0).uniform(0, 1, (100, 3)) * [2, 1, 1]
    controls = np.random.default_rng(1).normal(size=lattice.size)
    np.testing.assert_allclose(
        volume.bind(points)(controls), lattice.bind(points)(controls), rtol=0, atol=1e-13
    )


def test_control_points_on_a_shared_face_are_one():
    left = Box.of("left", grid((4, 4, 4)))
    right = Box.of("right", grid((4, 4, 4), low=(1, 0, 0), high=(3, 1, 1))[::-1, ::-1])
    volume = ml.ControlVolume([left, right])
    assert len(volume.rest) == 4 * 4 * 7
    y, z = np.random.default_rng(0).uniform(0.1, 0.9, (2, 50))
    near = 1e-9
    both = [np.stack([np.full(50, x), y, z], axis=1) for x in (1 - near, 1 + near)]
    controls = np.random.default_rng(1).normal(size=volume.size)
    one, other = (np.asarray(volume.bind(p)(controls)) - p for p in both)
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-7)
    assert np.abs(one).max() > 0.1


def test_collapsed_edges_are_found_in():
    """A wedge: one face of the box is an edge."""
    points = grid((4, 3, 3))
    points[..., 1] *= points[..., 0]
    u = np.random.default_rng(0).uniform(0, 1, (200, 3))
    u[:20, 0] = 0.0
    x = place(points, u)
    found = ml.ControlVolume([Box.of("wedge", points)]).embedded(x)
    assert np.all(found.volume == 0)
    np.testing.assert_allclose(place(points, found.u), x, rtol=0, atol=1e-9)


def test_points_outside_are_refused_by_name():
    volume = ml.ControlVolume([Box.of("1", grid((3, 3, 3)))])
    points = np.array([[0.5, 0.5, 0.5], [0.5, 1.25, 0.5], [9.0, 0, 0]])
    with pytest.raises(GeometryError) as told:
        volume.bind(points)
    assert (
        "2 of 3 points lie outside the control volume (first: point 1 at (0.5, 1.25, 0.5)"
        in str(told.value)
    )
    assert 'outside = "keep"' in str(told.value)


def test_points_outside_stay_if_one_wants_them_to():
    volume = ml.ControlVolume([Box.of("1", swept())], outside="keep")
    points = np.random.default_rng(0).uniform(-1, 8, (500, 3))
    lost = volume.embedded(points).volume < 0
    assert 0 < lost.sum() < 500
    controls = np.random.default_rng(1).normal(size=volume.size)
    moved = np.asarray(volume.bind(points)(controls))
    assert np.array_equal(moved[lost], points[lost])
    assert np.all(np.any(moved[~lost] != points[~lost], axis=1))


def test_how_far_a_point_is_outside_is_told():
    volume = ml.ControlVolume([Box.of("1", swept())], outside="keep")
    above = np.array([[2.0, 0.35, 4.0]])
    found = volume.embedded(above)
    assert found.volume[0] == -1
    line = np.linspace(0.4, 0.6, 200)
    top = np.stack(np.meshgrid(line, [1.0], line), axis=-1).reshape(-1, 3)
    nearest = np.linalg.norm(place(swept(), top) - above, axis=1).min()
    assert found.miss[0] == pytest.approx(nearest, rel=0.01)


def test_a_plane_box_moves_a_section():
    """One layer of control points: nothing depends on the third coordinate."""
    volume = ml.ControlVolume([Box.of("1", grid((5, 3, 1), high=(1, 1, 0)))])
    points = np.zeros((50, 3))
    points[:, :2] = np.random.default_rng(0).uniform(0, 1, (50, 2))
    controls = np.random.default_rng(1).normal(size=volume.size)
    along = np.random.default_rng(2).normal(size=points.shape) * [1, 1, 0]
    moved = volume.bind(points)(controls)
    np.testing.assert_allclose(volume(points, controls), moved, rtol=0, atol=1e-13)
    step = 1e-6
    _, slope = jax.jvp(lambda p: volume(p, jnp.asarray(controls)), (points,), (along,))
    ahead = np.asarray(volume(points + step * along, controls))
    behind = np.asarray(volume(points - step * along, controls))
    np.testing.assert_allclose(slope, (ahead - behind) / (2 * step), rtol=0, atol=1e-6)


def test_second_derivatives_by_points_are_right():
    volume = ml.ControlVolume([Box.of("1", swept())])
    points = jnp.asarray(place(swept(), np.random.default_rng(0).uniform(0.1, 0.9, (5, 3))))
    controls = jnp.asarray(0.1 * np.random.default_rng(1).normal(size=volume.size))
    along = jnp.asarray(np.random.default_rng(2).normal(size=points.shape))

    def slope(p):
        return jax.jvp(lambda q: volume(q, controls), (p,), (along,))[1]

    _, curve = jax.jvp(slope, (points,), (along,))
    step = 1e-5
    expected = (slope(points + step * along) - slope(points - step * along)) / (2 * step)
    np.testing.assert_allclose(curve, expected, rtol=0, atol=1e-6 * float(jnp.abs(curve).max()))


def test_the_jacobian_is_the_binding_s():
    volume = ml.ControlVolume(
        [Box.of("a", grid((4, 4, 4))), Box.of("b", grid((4, 4, 4), (1, 0, 0), (2, 1, 1)))],
        freeze=("a:i-",),
    )
    binding = volume.bind(np.random.default_rng(0).uniform(0, 1, (40, 3)) * [2, 1, 1])
    controls = np.random.default_rng(1).normal(size=volume.size)
    linear = binding.jacobian() @ controls
    moved = np.asarray(binding(controls)) - np.asarray(binding(np.zeros(volume.size)))
    np.testing.assert_allclose(linear.reshape(-1, 3), moved, rtol=0, atol=1e-13)


def test_frozen_sides_leave_points_beside_them():
    volume = ml.ControlVolume([Box.of("root", grid((8, 4, 4)))], freeze=("root:i-",))
    assert volume.frozen.sum() == 3 * 4 * 4
    points = np.array([[0.0, 0.5, 0.5], [1.0, 0.5, 0.5]])
    moved = np.asarray(volume.bind(points)(np.ones(volume.size)))
    assert np.array_equal(moved[0], points[0])
    assert np.all(moved[1] > points[1])


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: ml.ControlVolume([]), "needs a box"),
        (lambda: Box.of("1", np.zeros((2, 2, 3))), r"shape \(ni, nj, nk, 3\)"),
        (lambda: Box.of("1", np.full((2, 2, 2, 3), np.nan)), "finite"),
        (lambda: ml.ControlVolume([Box.of("1", np.ones((2, 2, 2, 3)))]), "single point"),
        (lambda: Box.of("1", grid((3, 3, 3)), 0), "at least 1, got 0"),
        (lambda: ml.ControlVolume([Box.of("1", grid((3, 3, 3)))], outside="clip"), "got 'clip'"),
        (lambda: ml.ControlVolume([Box.of("1", grid((3, 3, 3)))], freeze=("u-",)), "got 'u-'"),
        (lambda: ml.ControlVolume([Box.of("1", grid((3, 3, 3)))], freeze=("i-", "i+")), "no free"),
        (lambda: ml.ControlVolume([Box.of("1", grid((2, 2, 2)))], freeze=("i-", "i+")), "no free"),
        (lambda: ml.ControlVolume([Box.of("1", grid((2, 2, 2)))], freeze=("2:i-",)), "got '2:i-'"),
    ],
)  # fmt: skip
def test_what_is_no_control_volume_is_refused(make, said):
    with pytest.raises((GeometryError, ParameterError), match=said):
        make()


def test_links_choose_control_points_of_boxes():
    volume = ml.ControlVolume(
        [Box.of("a", grid((4, 2, 2))), Box.of("b", grid((4, 2, 2), (1, 0, 0), (2, 1, 1)))]
    )
    link = links.group(volume, "y", index=[(0, 3, 0, 0), (1, 0, 1, 1)])
    moved = np.flatnonzero(link.matrix.reshape(-1, 3)[:, 1])
    np.testing.assert_array_equal(volume.rest[moved], [[1, 0, 0], [1, 1, 1]])
    assert links.each(volume, "z").size == len(volume.rest)
    with pytest.raises(ParameterError, match=r"\(box, i, j, k\)"):
        links.group(volume, "y", index=[(3, 0, 0)])


def test_a_half_model_stays_on_its_plane():
    box = grid((4, 3, 4), (0, 0, 0), (1, 2, 1))
    volume = ml.ControlVolume([Box.of("1", box)])
    free = links.mirrored(volume, links.controls(volume), "y")
    points = np.random.default_rng(0).uniform(0, 1, (40, 3)) * [1, 2, 1]
    points[:20, 1] = 0.0
    pipeline = ml.Pipeline(
        ml.Surface(points, np.array([[0, 1, 2]])),
        [ml.Stage(volume, {ml.variable("all", size=volume.size): free})],
    )
    moved = np.asarray(pipeline.points({"all": np.random.default_rng(1).normal(size=volume.size)}))
    assert np.all(moved[:20, 1] == 0.0)
    assert np.all(moved[20:, 1] != points[20:, 1])


def test_boxes_are_read_from_plot3d(tmp_path):
    blocks = [swept((4, 3, 5)), swept((4, 3, 5)) + np.array([0, 0, 8])]
    flat = [b.transpose(2, 1, 0, 3).reshape(-1, 3) for b in blocks]
    made = ml.Grid(np.concatenate(flat), tuple(b.shape[:3] for b in blocks))
    ml.write(tmp_path / "boxes.xyz", made)
    volume = ml.ControlVolume.read(tmp_path / "boxes.xyz", units="in")
    assert [box.name for box in volume.frame.boxes] == ["1", "2"]
    np.testing.assert_allclose(volume.frame.boxes[1].points, 0.0254 * blocks[1], rtol=1e-15)
    one = ml.ControlVolume.read(tmp_path / "boxes.xyz", names=["2"], degree=(2, 1, 3))
    assert [axis.terms - 1 for axis in one.frame.boxes[0].axes] == [2, 1, 3]
    with pytest.raises(ParameterError, match="no box named 'wing'; it has: 1, 2"):
        ml.ControlVolume.read(tmp_path / "boxes.xyz", names=["wing"])


def test_files_without_boxes_are_refused(tmp_path, ball):
    ml.write(tmp_path / "ball.tri", ball)
    with pytest.raises(GeometryError, match="PLOT3D or SU2, got a Surface"):
        ml.ControlVolume.read(tmp_path / "ball.tri")


def test_a_tear_is_found_where_the_mesh_leaves_the_box():
    volume = ml.ControlVolume([Box.of("1", swept())], outside="keep")
    ends = np.array([place(swept(), np.array([[0.5, 0.5, 0.9]]))[0], [1e3, 0.3, 8.0]])
    ends[1] = ends[0] + [0, 0, 3.0]
    controls = np.zeros((volume.size // 3, 3))
    controls[:, 1] = 0.25
    places, gaps = volume.tears(ends, np.array([[1, 0]]), controls.ravel())
    assert places[0, 2] == pytest.approx(8.0, abs=1e-6)
    assert gaps[0] == pytest.approx(0.25)


@pytest.mark.parametrize("name", ["bwb", "c172"])
def test_real_bodies_are_embedded_in_their_boxes(data, name):
    surface = ml.read(data(f"pygeo/{name}.stl"), units="mm" if name == "c172" else None)
    found = ml.ControlVolume.read(data(f"pygeo/{name}.xyz")).embedded(surface.points)
    size = np.linalg.norm(np.ptp(surface.points, axis=0))
    assert np.all(found.volume >= 0)
    assert found.miss.max() < 1e-14 * size
    assert found.steps.max() <= 20


def test_a_body_of_several_boxes_shares_their_faces(data):
    volume = ml.ControlVolume.read(data("pygeo/bodyFFD.xyz"))
    assert len(volume.frame.boxes) == 5
    assert len(volume.rest) == 24 < 5 * 8


@pytest.mark.parametrize("name", ["rae2822_turbulent_ffd", "brick_tets_ffd", "brick_prism_ffd"])
def test_points_lie_where_su2_found_them(data, name):
    path = data(f"su2/{name}.su2")
    (box,) = read_boxes(path)
    points = np.asarray(ml.read(path).points)[box.nodes]
    found = ml.ControlVolume.read(path).embedded(points)
    np.testing.assert_allclose(found.u, box.coordinates, rtol=0, atol=1e-14)
