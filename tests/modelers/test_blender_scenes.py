"""A live Blender as a stage: every kind of modifier, its derivatives, and what is refused."""

import os
import signal

import jax
import numpy as np
import pytest

import moldline as ml
from moldline import links
from moldline.errors import FileError, GeometryError, ParameterError, TaskError
from moldline.modelers.blender import Blender

pytestmark = pytest.mark.blender

ANGLE = 'objects["wing"].modifiers["Twist"].angle'
SIZE = 'objects["wing"].modifiers["Nodes"]["Size"]'
SWELL = 'shape_keys["Key"].key_blocks["Swell"].value'


@pytest.fixture
def scene(scenes, blender):
    """Makes modelers of the small scenes, and ends their processes."""
    made = []

    def make(name, object="wing", **options):
        one = Blender(
            scenes / f"{name}.blend", object, **{"workers": 1, "python": blender} | options
        )
        made.append(one)
        return one

    yield make
    for one in made:
        one.close()


def columns(making, at):
    """Derivatives by each number, and what is told about their errors."""
    found = [jax.jvp(making, (at,), (row,))[1] for row in np.eye(len(at))]
    return found, [slope.error for slope in making.accuracy.values()]


def twisted(points, angle):
    """Blender's Simple Deform along z, over a column from z = 0 to 1."""
    turn = angle * points[:, 2]
    x, y = points[:, 0], points[:, 1]
    return np.stack(
        [x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), points[:, 2]], 1
    )


def twist_slope(points, angle):
    turn, z = angle * points[:, 2], points[:, 2]
    x, y = points[:, 0], points[:, 1]
    return np.stack(
        [
            -z * (x * np.sin(turn) + y * np.cos(turn)),
            z * (x * np.cos(turn) - y * np.sin(turn)),
            0 * z,
        ],
        1,
    )


LOW, SPAN = np.array([0.1, -0.05, 0.0]), np.array([2.0, 2.2, 2.4])


def own_lattice():
    """Ours, where the one of the scene is, and the order of its control points in Blender's."""
    c, s = np.cos(np.float32(0.3)), np.sin(np.float32(0.3))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    edges = (turn * SPAN).T
    net = ml.Lattice(
        LOW - edges.sum(axis=0) / 2, edges, (4, 3, 2), ends="blender", outside="extend"
    )
    order = np.arange(24).reshape(4, 3, 2).transpose(2, 1, 0).ravel()
    return net, order


def test_a_lattice_on_a_given_geometry_is_ours_with_errors_no_larger_than_told(scene, ball):
    net, order = own_lattice()
    given = ml.Surface(0.7 * np.asarray(ball.points) + 1e-9, ball.faces)
    blend = scene("lattice", controls={"net": {"object": "net", "points": [5, 6, 17]}})
    making = blend.bind(given)
    rng = np.random.default_rng(0)
    at = 0.2 * rng.normal(size=9)
    controls = np.zeros((24, 3))
    controls[order[[5, 6, 17]]] = at.reshape(3, 3)
    bound = net.bind(given.points)
    assert making.geometry.components == given.components
    np.testing.assert_array_equal(making.geometry.points, given.points)  # nothing moves yet
    np.testing.assert_allclose(making(at), bound(controls.ravel()), rtol=0, atol=1e-6)
    found, errors = columns(making, at)
    for k in range(9):
        row = np.zeros((24, 3))
        row[order[[5, 6, 17][k // 3]], k % 3] = 1.0
        exact = jax.jvp(bound, (controls.ravel(),), (row.ravel(),))[1]
        worst = float(np.abs(found[k] - exact).max())
        assert worst < 2 * errors[k] < 1e-5


def test_derivatives_by_the_points_of_a_given_geometry_go_along_motions_of_them(scene, ball):
    net, order = own_lattice()
    points = 0.7 * np.asarray(ball.points)
    blend = scene("lattice", controls={"net": {"object": "net", "points": [5], "axes": "z"}})
    making = blend.bind(ml.Surface(points, ball.faces))
    at = np.array([0.4])
    controls = np.zeros((24, 3))
    controls[order[5], 2] = 0.4
    moves = np.random.default_rng(1).normal(size=points.shape)
    exact = jax.jvp(lambda p: net(p, controls.ravel()), (points,), (moves,))[1]
    motion = jax.jvp(making, (at, points), (np.zeros(1), moves))[1]
    error = making.accuracy["points of the file in"].error * np.abs(moves).max()
    worst = float(np.abs(motion - exact).max())
    assert worst < 2 * error < 1e-3
    with pytest.raises(ParameterError, match=r"known by directions only.*Pipeline\.pullback"):
        jax.vjp(making, at, points)[1](points)


def test_groups_move_together_by_their_weights_and_reverse_mode_agrees(scene):
    each = scene(
        "lattice", controls={"tip": {"object": "net", "points": [3, 7, 11, 2], "axes": "z"}}
    )
    group = {"object": "net", "group": "tip", "axes": "z", "together": True}
    together = scene("lattice", controls={"tip": group})
    assert together.scene.labels == ("tip[together.z]",)
    making = together.bind()
    np.testing.assert_allclose(
        making(np.array([0.3])), each.bind()(0.3 * np.array([1, 1, 1, 0.5])), rtol=0, atol=1e-7
    )
    weights = np.random.default_rng(2).normal(size=making.geometry.points.shape)
    pulled = jax.vjp(making, np.array([0.3]))[1](weights)[0]
    pushed = jax.jvp(making, (np.array([0.3]),), (np.array([1.0]),))[1]
    np.testing.assert_allclose(pulled, [np.vdot(pushed, weights)], rtol=1e-12)


def test_a_shape_key_is_linear_and_kept_between_its_limits(scene):
    blend = scene("keys", parameters={"swell": SWELL})
    making = blend.bind()
    assert making.geometry.components == ("skin", "glass")
    exact = np.zeros((24, 3))
    exact[:, 0] = 0.1 * np.arange(24)
    for at in (0.0, 0.5, 1.0):  # at a limit to one side only
        found, errors = columns(making, np.array([at]))
        assert np.abs(found[0] - exact).max() < 2 * errors[0] < 2e-5
    with pytest.raises(ParameterError, match=r"swell is 1.5; Blender keeps it from 0 to 1"):
        blend.check(np.array([1.5]))
    with pytest.raises(TaskError, match=r"was set to \[1.5\] and is \[1.0\]: out of limits"):
        making(np.array([1.5]))


def test_shape_keys_keep_their_differences_on_a_given_geometry(scene, scenes):
    blend = scene("keys", parameters={"swell": SWELL})
    rest = blend.bind().geometry
    moved = rest.moved(np.asarray(rest.points) + [0.0, 3.0, 1e-9])
    making = blend.bind(moved)
    np.testing.assert_array_equal(making.geometry.points, moved.points)
    motion = np.asarray(making(np.array([1.0]))) - moved.points
    np.testing.assert_allclose(motion[:, 0], 0.1 * np.arange(24), atol=1e-6)


def test_a_twist_is_curved_and_right_to_what_is_told(scene):
    blend = scene("twist", parameters={"angle": ANGLE})
    making = blend.bind()
    flat = np.asarray(scene("twist", parameters={"angle": ANGLE}, values={"angle": 0.0}).bind()
                      .geometry.points)  # fmt: skip
    for angle in (0.5, 2.0):
        np.testing.assert_allclose(making(np.array([angle])), twisted(flat, angle), atol=1e-6)
        found, errors = columns(making, np.array([angle]))
        worst = np.abs(found[0] - twist_slope(flat, angle)).max()
        assert worst < 2 * errors[0] < 2e-4


def test_what_a_driver_sets_is_told_and_what_drives_it_is_turned(scene):
    blend = scene("driven", parameters={"turn": 'objects["wing"]["turn"]'})
    making = blend.bind()
    flat = np.asarray(making(np.array([0.0])))
    np.testing.assert_allclose(making(np.array([0.3])), twisted(flat, 0.6), atol=1e-6)
    with pytest.raises(ParameterError, match=r"is set by a driver, '2 \* turn'"):
        scene("driven", parameters={"angle": ANGLE})


def test_geometry_nodes_behind_a_subdivision_are_turned_by_the_names_that_users_see(scene):
    blend = scene("nodes", parameters={"size": SIZE})
    making = blend.bind()
    assert blend.values == pytest.approx([0.25]) and len(making.geometry.points) == 26
    start = np.asarray(making.geometry.points) / 1.25
    found, errors = columns(making, blend.values)
    assert np.abs(found[0] - start).max() < 2 * errors[0] < 2e-5


def test_a_given_geometry_is_subdivided_with_slopes_by_its_points(scene):
    tetrahedron = ml.Surface(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]],
        [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    )
    making = scene("nodes", parameters={"size": SIZE}).bind(tetrahedron)
    points = np.asarray(tetrahedron.points)
    assert making.geometry.points.shape == (14, 3) and making.geometry.faces.shape == (24, 3)
    shift = np.tile([1.0, -2.0, 0.5], (4, 1))
    motion = jax.jvp(making, (np.array([0.25]), points), (np.zeros(1), shift))[1]
    np.testing.assert_allclose(motion, 1.25 * np.tile(shift[0], (14, 1)), atol=2e-5)


def test_bones_turn_and_shift_what_is_theirs(scene):
    turn = {"object": "rig", "bones": ["tip"], "motion": "rotation", "axes": "z"}
    shift = {"object": "rig", "bones": ["root"], "axes": "y"}
    blend = scene("arm", controls={"turn": turn, "shift": shift})
    making = blend.bind()
    rest = np.asarray(making.geometry.points)
    at = np.array([0.4, 0.3])
    own = np.isin(np.arange(8), [4, 5, 6, 7])[:, None]

    c, s = np.cos(0.4), np.sin(0.4)  # about the bone's own z, which is that of space
    arm = rest - [1.0, 0, 0]
    turned = arm @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + [1.0, 0, 0]
    exact = np.where(own, arm @ np.array([[-s, -c, 0], [c, -s, 0], [0, 0, 0]]).T, 0)
    moved = np.where(own, turned, rest) + [0.3, 0, 0]
    np.testing.assert_allclose(making(at), moved, rtol=0, atol=1e-6)
    found, errors = columns(making, at)
    assert np.abs(found[0] - exact).max() < 2 * errors[0] < 2e-4
    assert np.abs(found[1] - np.array([1.0, 0, 0])).max() < 2 * errors[1] < 2e-4


def test_vertices_of_a_cage_are_controls_and_a_cage_that_is_not_bound_is_told(scene):
    whole = {"object": "cage", "together": True}
    making = scene("cage", controls={"all": whole}).bind()
    motion = np.asarray(making(np.array([0.1, -0.2, 0.3]))) - making.geometry.points
    np.testing.assert_allclose(motion, np.tile([0.1, -0.2, 0.3], (8, 1)), atol=1e-6)
    with pytest.raises(GeometryError, match=r"'Cage' is not bound to its cage.*bind it in Blender"):
        scene("cage", "loose").bind()


def test_a_curve_is_evaluated_as_a_tube(scene):
    making = scene("curve", "tube", parameters={"bevel": 'curves["tube"].bevel_depth'}).bind()
    assert len(making.geometry.faces) > 8
    wider = np.asarray(making(np.array([0.2])))
    np.testing.assert_allclose(
        wider[:, 1:], 2 * np.asarray(making.geometry.points)[:, 1:], atol=1e-6
    )


def test_what_is_hidden_is_shrunk_onto_a_target_that_moves(scene):
    path = 'objects["plane"].location'
    blend = scene("wrap", parameters={"place": path, "high": f"{path}[2]"})
    np.testing.assert_allclose(blend.values, [0, 0, -0.5, -0.5])
    making = blend.bind()
    assert np.ptp(np.asarray(making.geometry.points)[:, 2]) < 1e-6
    found, errors = columns(making, np.array([0, 0, 0.3, -0.25]))
    low = making(np.array([0, 0, 0.3, -0.25]))[:, 2]
    np.testing.assert_allclose(low, -0.25, atol=1e-6)  # the last one that is set
    for k, z in enumerate((0.0, 0.0, 0.0, 1.0)):
        assert np.abs(found[k] - np.array([0, 0, z])).max() < 2 * errors[k] < 1e-5
    with pytest.raises(ParameterError, match=r"lattice 'keyed' has shape keys.*turn their values"):
        scene("wrap", controls={"a": {"object": "keyed"}})


def test_a_changed_topology_is_told(scene):
    path = 'objects["wing"].modifiers["Fewer"].ratio'
    making = scene("decimate", parameters={"ratio": path}).bind()
    with pytest.raises(GeometryError, match=r"and 98 and 96 for its own values.*must never change"):
        making(np.array([0.5]))


@pytest.mark.parametrize(
    ("options", "error", "match"),
    [
        ({"object": "wings"}, ParameterError, r"no object 'wings'; there are 'net', 'wing'"),
        ({"parameters": {"a": 'objects["win"].location'}}, ParameterError,
         r"the file has nothing named 'win'|has nothing named 'win'; there are 'net', 'wing'"),
        ({"parameters": {"a": 'objects["wing"].modifiers["Lattice"].stren'}}, ParameterError,
         r"Lattice' has no property 'stren'; there are 'strength'"),
        ({"parameters": {"a": 'objects["wing"].modifiers["Lattice"]. strength'}}, ParameterError,
         r"stops making sense at '\. strength'"),
        ({"parameters": {"a": 'objects["net"].data.points_u'}}, ParameterError,
         r"is 4, a whole number or a choice"),
        ({"parameters": {"a": 'objects["wing"].location[3]'}}, ParameterError,
         r"has no number 3; it has 3"),
        ({"controls": {"a": {"object": "net", "points": [24]}}}, ParameterError,
         r"'net' has no point 24; it has 24"),
        ({"controls": {"a": {"object": "net", "group": "top"}}}, ParameterError,
         r"no vertex group 'top'; there are 'tip'"),
        ({"controls": {"a": {"object": "net", "bones": ["b"]}}}, ParameterError,
         r"has points, which have a location only"),
        ({"values": {"b": 1.0}}, ParameterError, r"values name 'b', which is neither"),
    ],
)  # fmt: skip
def test_what_is_not_there_is_told_with_what_is(scene, options, error, match):
    with pytest.raises(error, match=match):
        scene("lattice", **options)


def test_files_that_are_absent_or_no_blend_are_told(scene, scenes):
    with pytest.raises(FileError, match=r"none\.blend: there is no such file"):
        scene("none")
    (scenes / "text.blend").write_text("no Blender file")
    with pytest.raises(FileError, match=r"text\.blend: Blender cannot open it"):
        scene("text")


def test_a_killed_process_is_replaced_and_what_it_was_asked_is_asked_again(scene):
    blend = scene("twist", parameters={"angle": ANGLE})
    making = blend.bind()
    before = np.asarray(making(np.array([0.7])))
    (process,) = blend.scene.pool.idle
    os.kill(process.process.pid, signal.SIGKILL)
    after = np.asarray(blend.bind()(np.array([0.7])))
    np.testing.assert_array_equal(before, after)
    (other,) = blend.scene.pool.idle
    assert other.process.pid != process.process.pid


def test_a_pipeline_with_ours_before_and_behind_agrees_in_both_modes(scene, ball):
    given = ml.Surface(0.7 * np.asarray(ball.points), ball.faces)
    box = ml.Lattice.box((-1, -1, -1), (1, 1, 1), (2, 2, 2))
    blend = scene("lattice", controls={"net": {"object": "net", "points": [5], "axes": "z"}})
    bend = ml.variable("bend", size=2, typical=0.1)
    lift = ml.variable("lift", size=1, typical=0.1)
    case = ml.Pipeline(
        {"body": given},
        [
            ml.Stage(box, {bend: links.camber(box, "x", "z")}, on="body"),
            ml.Construction(blend, {lift: links.named(blend, "net")}, "wing", of=["body"]),
            ml.Stage(box, {bend: links.camber(box, "y", "z")}, on="wing"),
        ],
    )
    values = case.values({"bend": [0.1, -0.05], "lift": [0.2]})
    along = {"bend": np.array([1.0, 0.5]), "lift": np.array([0.3])}
    weights = np.random.default_rng(3).normal(size=given.points.shape)
    pushed = np.vdot(case.pushforward(values, along), weights)
    pulled = case.pullback(values, weights)
    dotted = sum(np.vdot(pulled[name], along[name]) for name in along)
    assert dotted == pytest.approx(float(pushed), rel=1e-5)
