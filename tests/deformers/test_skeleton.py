"""Skeletons: how bones move, how points follow them, and what Blender makes of the same."""

import json
import math

import jax
import numpy as np
import pytest
from numerics.cages import box
from scipy.spatial.transform import Rotation

import moldline as ml
from moldline.deformers import bone_motion, bone_weights, dual_quaternions
from moldline.deformers.bones import Bone, Bones
from moldline.deformers.contract import check, prove
from moldline.deformers.direct_skeleton import DirectSkeleton
from moldline.deformers.skeleton import Skeleton
from moldline.errors import ParameterError

BLENDS, AXES = ("linear", "dual quaternion"), ("bone", "global")

TREE = Bones(
    (
        Bone("tip", (0.1, 0.3, 0), (0, 0.9, 0.1), parent="root", reach=1.5),
        Bone("root", (0, -0.9, 0), (0, 0.3, 0)),
        Bone("fin", (0, 0.1, 0), (0.1, 0.1, 0.8), parent="root", radii=(0.2, 0.05)),
    )
)

LINE = Bones((Bone("in", (0, 0, 0), (0, 2, 0)), Bone("out", (0, 2, 0), (0, 4, 0), parent="in")))

BOX = ml.Lattice.box((-1, -1, -1), (1, 1, 1), (4, 5, 3))


@pytest.fixture(scope="module")
def cloud():
    return np.random.default_rng(0).uniform(-0.95, 0.95, (40, 3))


def controls(deformer, **parts):
    """Controls with some parts given, such as in_rotation = [0, 0, 1]."""
    found = np.zeros(deformer.size)
    for name, value in parts.items():
        found[deformer.parameters[name.replace("_", ".")]] = value
    return found


def around(bones, count=24, radius=0.25, start=0.05, end=3.95):
    """A closed tube along y, as points and triangles."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    y = np.linspace(start, end, 80)
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.array([[x, h, z] for h in y for x, z in ring])
    index = np.arange(len(points)).reshape(len(y), count)
    a, b = index[:-1], index[1:]
    sides = [np.stack(t, axis=-1).reshape(-1, 3) for t in (
        (a, np.roll(a, -1, 1), b), (np.roll(a, -1, 1), np.roll(b, -1, 1), b)
    )]  # fmt: skip
    return points, np.concatenate(sides)


def narrowest(points, count=24):
    """Smallest distance between opposite points of a tube's rings, over that at its end."""
    rings = np.asarray(points).reshape(-1, count, 3)
    widths = np.linalg.norm(rings[:, : count // 2] - rings[:, count // 2 :], axis=2).min(axis=1)
    return widths.min() / widths[0]


def test_a_skeleton_keeps_the_contract(cloud):
    check(Skeleton(TREE, BOX, axes="global", weights="envelope"), cloud)


def test_a_direct_skeleton_keeps_the_contract(cloud):
    check(DirectSkeleton(TREE, blend="dual quaternion"), cloud)


@pytest.mark.parametrize(("blend", "axes"), list(zip(BLENDS, AXES, strict=True)))
def test_a_pose_is_exactly_differentiable_at_rest_and_at_right_angles(blend, axes):
    skeleton = Skeleton(TREE, BOX, blend=blend, axes=axes)
    pose = jax.jit(lambda c: skeleton.pose(c))
    bent = controls(skeleton, tip_rotation=[math.pi / 2, 0, 0], root_rotation=[0, 0, -math.pi / 2])
    along = 0.1 * np.random.default_rng(1).normal(size=skeleton.size)
    assert np.all(np.asarray(pose(np.zeros(skeleton.size))) == 0)
    for at in (np.zeros(skeleton.size), bent + 0.1 * along):
        prove(pose, at, along)


@pytest.mark.parametrize("blend", BLENDS)
def test_second_derivatives_at_rest_are_those_of_differences(blend):
    skeleton = Skeleton(TREE, BOX, blend=blend)
    along = np.random.default_rng(1).normal(size=skeleton.size)

    def path(t):
        return skeleton.pose(t * along)

    step = 1e-4
    known = (path(step) - 2 * path(0.0) + path(-step)) / step**2
    found = jax.jit(jax.jacfwd(jax.jacfwd(path)))(0.0)
    np.testing.assert_allclose(found, known, rtol=0, atol=1e-5)


@pytest.mark.parametrize("blend", BLENDS)
def test_one_bone_moves_a_clamped_lattice_as_it_moves_itself(blend):
    """A rotation of 90 degrees, then one with stretch and scale: the geometry's is the same map."""
    bone = Bone("b", (0.2, -0.5, 0.1), (0.4, 0.6, 0.3))
    skeleton = Skeleton(Bones((bone,)), BOX, blend=blend)
    points = np.random.default_rng(0).uniform(-1, 1, (300, 3))
    turn = np.array([0.3, -0.8, 0.5])
    turn *= np.pi / 2 / np.linalg.norm(turn)
    matrix = Rotation.from_rotvec(bone.axes @ turn).as_matrix()
    bind = skeleton.bind(points)
    known = bone.head + (points - bone.head) @ matrix.T
    np.testing.assert_allclose(bind(controls(skeleton, b_rotation=turn)), known, rtol=0, atol=1e-13)
    grown = bone.axes @ np.diag([1.1, 1.3 * 1.2, 0.9]) @ bone.axes.T
    known = bone.head + bone.axes @ [0.1, 0.2, 0.3] + (points - bone.head) @ (matrix @ grown).T
    given = controls(
        skeleton,
        b_rotation=turn,
        b_translation=[0.1, 0.2, 0.3],
        b_stretch=0.3,
        b_scale=[0.1, 0.2, -0.1],
    )
    np.testing.assert_allclose(bind(given), known, rtol=0, atol=1e-13)


def test_blenders_ends_err_by_a_sixth_of_a_cell():
    """Of what the motion changes over it, at the end: here a stretch by a tenth."""
    box = ml.Lattice.box((0, 0, 0), (1, 3, 1), (2, 4, 2), ends="blender", outside="extend")
    skeleton = Skeleton(Bones((Bone("b", (0, 0, 0), (0, 1, 0)),)), box)
    moved = skeleton(np.array([[0.5, 3.0, 0.5]]), controls(skeleton, b_stretch=0.1))
    assert 3.3 - moved[0, 1] == pytest.approx(0.1 / 6)


@pytest.mark.parametrize("blend", BLENDS)
@pytest.mark.parametrize("weights", ["distance", "hand"])
def test_what_follows_one_bone_stays_rigid_at_right_angles(blend, weights):
    """Beyond the other's reach, or by hand; both bones are turned by 90 degrees."""
    bones = Bones((Bone("in", (0, 0, 0), (0, 2, 0), reach=0.9), LINE[1]))
    box = ml.Lattice.box((-0.3, 0, -0.3), (0.3, 4, 0.3), (2, 20, 2))
    hand = np.stack([box.rest[..., 1] < 2, box.rest[..., 1] >= 2], axis=-1).reshape(-1, 2)
    skeleton = Skeleton(bones, box, blend=blend, weights=hand if weights == "hand" else weights)
    points = np.random.default_rng(0).uniform([-0.3, 3.6, -0.3], [0.3, 4, 0.3], (60, 3))
    bent = controls(skeleton, in_rotation=[0, 0, np.pi / 2], out_rotation=[np.pi / 2, 0, 0])
    moved = np.asarray(skeleton.bind(points)(bent))
    first = Rotation.from_rotvec([0, 0, np.pi / 2])
    known = first.apply([0, 2, 0]) + (first * Rotation.from_rotvec([np.pi / 2, 0, 0])).apply(
        points - [0, 2, 0]
    )
    np.testing.assert_allclose(moved, known, rtol=0, atol=1e-12)


@pytest.mark.parametrize("axes", AXES)
def test_a_child_is_carried_by_its_parents_tail(axes):
    """Turned by a right angle and stretched by half, but not scaled."""
    given = controls(
        DirectSkeleton(LINE),
        in_rotation=[0, 0, -np.pi / 2],
        in_stretch=0.5,
        in_scale=[0.2, 0.4, 0.6],
        out_rotation=[np.pi / 2, 0, 0],
        out_translation=[0, 0.25, 0],
    )
    motion = bone_motion.motion(LINE, axes, given)
    own = np.eye(2, dtype=int)  # each row follows one bone
    places = np.array([[0, 2.0, 0], [0, 3.0, 0]])
    tail, middle = places + np.asarray(
        bone_motion.displaced(LINE, motion, 1.0 * own, places, "linear")
    )
    np.testing.assert_allclose(tail, [1.5 * 1.4 * 2, 0, 0], rtol=0, atol=1e-15 * 10)
    # by its own axes the child turns out of the parent's plane; by those of space about their x,
    # along which the parent has laid it
    known = {"bone": [3 + 0.25, 0, 1], "global": [3 + 1, 0.25, 0]}[axes]
    np.testing.assert_allclose(middle, known, rtol=0, atol=1e-14)


def test_dual_quaternions_keep_a_twisted_tube_open():
    """By half a turn the linear blend draws its middle to a point; the rigid blend does not."""
    points, _ = around(LINE)
    widths = {}
    for blend in BLENDS:
        direct = DirectSkeleton(LINE, blend=blend)
        widths[blend] = narrowest(direct(points, controls(direct, out_rotation=[0, 3.1, 0])))
    assert widths["linear"] < 0.1
    assert widths["dual quaternion"] > 0.999


@pytest.mark.parametrize("angle", [60, 90, 120])
def test_dual_quaternions_keep_more_volume_at_a_bent_joint(angle):
    points, faces = around(LINE)

    def volume(moved):
        a, b, c = np.moveaxis(np.asarray(moved)[faces], 1, 0)
        return abs(np.sum(a * np.cross(b, c)) / 6 + caps(np.asarray(moved)))

    def caps(moved):
        ends = moved.reshape(-1, 24, 3)[[0, -1]]
        flux = 0.0
        for ring, sign in zip(ends, (-1, 1), strict=True):
            middle = ring.mean(axis=0)
            flux += sign * np.sum(middle * np.cross(ring, np.roll(ring, -1, 0))) / 6
        return flux

    lost = {}
    for blend in BLENDS:
        direct = DirectSkeleton(LINE, blend=blend)
        bent = direct(points, controls(direct, out_rotation=[math.radians(angle), 0, 0]))
        lost[blend] = abs(1 - volume(bent) / volume(points))
    assert lost["dual quaternion"] < 0.05 * lost["linear"]


@pytest.mark.parametrize("blend", BLENDS)
def test_two_bones_that_move_alike_move_all_points_so(blend):
    points = np.random.default_rng(0).uniform([-1, 0, -1], [1, 4, 1], (50, 3))
    direct = DirectSkeleton(LINE, blend=blend)
    moved = direct(points, controls(direct, in_rotation=[1.2, -0.3, 0.4]))
    known = Rotation.from_rotvec([1.2, -0.3, 0.4]).apply(points)
    np.testing.assert_allclose(moved, known, rtol=0, atol=2e-15 * 4)


def test_shares_by_distance_sum_to_one_and_favour_the_nearest():
    points = np.random.default_rng(0).uniform(-2, 2, (500, 3))
    shares = np.asarray(bone_weights.by_distance(TREE, points))
    np.testing.assert_allclose(shares.sum(axis=1), 1, rtol=0, atol=1e-15)
    assert shares.min() >= 0
    near = np.array([bone.head for bone in TREE]) * 0.3 + 0.7 * TREE.tails
    found = np.asarray(bone_weights.by_distance(TREE, near))
    assert np.all(np.diag(found) > 0.9)


def test_shares_by_distance_have_no_kinks_at_the_ends_of_bones_or_of_reach():
    """Along a line past both, slopes change by no more than the step does."""
    line = np.stack([np.full(4001, 0.3), np.linspace(-2, 2, 4001), np.full(4001, 0.1)], axis=1)
    shares = np.asarray(bone_weights.by_distance(TREE, line))
    bends = np.abs(np.diff(shares, 2, axis=0)).max() / 0.001**2
    finer = np.stack(
        [np.full(4001, 0.3), np.linspace(-0.2, 0.2, 4001) + 0.3, np.full(4001, 0.1)], 1
    )
    fine = np.abs(np.diff(np.asarray(bone_weights.by_distance(TREE, finer)), 2, axis=0)).max()
    assert 1 < bends < 30  # a kink would show as its jump over the step, thousands
    assert fine / 0.0001**2 < 30


def test_envelopes_are_those_of_blender():
    """At known distances from a bone whose radius goes from 0.2 to 0.4; closed form."""
    bone = Bone("b", (0, 0, 0), (0, 2, 0), radii=(0.2, 0.4), distance=0.5, strength=3.0)
    other = Bone("o", (9, 0, 0), (9, 2, 0), radii=(8.5, 8.5), distance=0.0)
    places = np.array([[x, 1.0, 0] for x in (0.25, 0.3, 0.55, 0.7999, 0.8)] + [[0, -0.3, 0]])
    raw = 3 * np.array([1, 1, 0.75, 1 - 0.9998**2, 0, 1 - 0.2**2])
    others = (9 - places[:, 0] < 8.5) * 1.0
    found = np.asarray(bone_weights.by_envelope(Bones((bone, other)), places))
    np.testing.assert_allclose(found[:, 0], raw / np.maximum(raw + others, 1e-9), atol=1e-12)
    np.testing.assert_allclose(found.sum(axis=1), (raw + others) > 1e-4, atol=1e-12)


def test_control_points_that_no_bone_reaches_stay():
    bone = Bone("b", (0, 0, 0), (0, 0.5, 0), radii=(0.4, 0.4), distance=0.2)
    for blend in BLENDS:
        skeleton = Skeleton(Bones((bone,)), BOX, weights="envelope", blend=blend)
        moved = np.asarray(
            skeleton.pose(controls(skeleton, b_rotation=[3, 1, 1], b_scale=[1, 1, 1]))
        )
        stays = np.linalg.norm(BOX.rest.reshape(-1, 3) - [0, 0.25, 0], axis=1) > 0.85
        assert np.all(moved.reshape(-1, 3)[stays] == 0)
        assert np.any(moved != 0)


def test_parameters_name_every_control_once():
    skeleton = Skeleton(TREE, BOX)
    numbers = np.concatenate(list(skeleton.parameters.values()))
    assert sorted(numbers) == list(range(skeleton.size))
    assert list(skeleton.parameters)[:4] == [
        "tip.rotation", "tip.translation", "tip.stretch", "tip.scale"
    ]  # fmt: skip
    assert skeleton.values[skeleton.parameters["fin.stretch"]] == 1


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"weights": "near"}, "weights must be distance, envelope or an array, got 'near'"),
        ({"weights": np.ones((3, 3))}, "a row of 3 for each of 60 control points"),
        ({"weights": -np.eye(60, 3)}, "got -1 for control point 0 and bone 'tip'"),
        ({"weights": np.full((60, 3), np.nan)}, "got nan for control point 0"),
        ({"blend": "dual"}, "blend must be one of linear, dual quaternion, got 'dual'"),
        ({"axes": "space"}, "axes must be one of bone, global, got 'space'"),
    ],
)
def test_what_is_no_skeleton_is_refused(options, said):
    with pytest.raises(ParameterError, match=said):
        Skeleton(TREE, BOX, **options)


def test_bones_that_all_have_a_reach_would_tear_a_surface():
    with pytest.raises(ParameterError, match="every bone has a reach"):
        DirectSkeleton(Bones((TREE[0], Bone("b", (0, 0, 0), (0, 1, 0), reach=2.0))[1:]))


def test_a_skeleton_is_built_from_a_file_in_a_lattice_around_the_geometry(ball, tmp_path):
    TREE.write(tmp_path / "bones.toml")
    made = Skeleton.build(ball, bones=tmp_path / "bones.toml", shape=(4, 5, 3), axes="global")
    assert made.bones == TREE
    assert made.net.shape == (4, 5, 3)
    assert made.net.rest.min() < -1 < 1 < made.net.rest.max()
    given = {"bones": tmp_path / "bones.toml", "shape": (4, 5, 3), "cage": tmp_path / "cage.stl"}
    for left_out in ({"bones": given["bones"]}, given):
        with pytest.raises(ParameterError, match="either cage, a file, or shape"):
            Skeleton.build(ball, **left_out)


@pytest.mark.parametrize("given", ["distance", "hand"])
def test_a_case_file_poses_a_cage_and_keeps_its_weights_beside_it(given, tmp_path, monkeypatch):
    (tmp_path / "case").mkdir()
    monkeypatch.chdir(tmp_path)
    points, faces = box((2, 3, 2), (2.0, 4.0, 2.0))
    ml.write(tmp_path / "case/cage.obj", ml.Surface(points, faces))
    ml.write(tmp_path / "case/body.obj", ml.Surface(0.5 * points + [0, 1, 0], faces))
    LINE.write(tmp_path / "case/bones.toml")
    hand = np.stack([points[:, 1] < 2, points[:, 1] >= 2], axis=1).astype(float)
    weights = json.dumps(hand.tolist() if given == "hand" else given)
    (tmp_path / "case/case.toml").write_text(
        f"""moldline = 1
[geometry.body]
file = "body.obj"
[variable.turn]
value = [0.0, 0.0, 0.5]
[[stage]]
deformer = "skeleton"
bones = "bones.toml"
cage = "cage.obj"
weights = {weights}
[[stage.link]]
variable = "turn"
link = "named"
parameter = "out.rotation"
"""
    )
    pipeline = ml.load("case/case.toml").pipeline
    moved = np.asarray(pipeline.points())
    own = Skeleton(LINE, ml.Cage(points, faces), weights=hand if given == "hand" else given)
    turned = own.bind(np.asarray(pipeline.geometry.points))(controls(own, out_rotation=[0, 0, 0.5]))
    np.testing.assert_allclose(moved, turned, rtol=0, atol=1e-9)
    assert list((tmp_path / "case/.moldline").iterdir())
    assert not (tmp_path / ".moldline").exists()


def test_rows_of_weights_have_one_length(ball, tmp_path):
    TREE.write(tmp_path / "bones.toml")
    with pytest.raises(ParameterError, match="rows of one length, got rows of 2 and 3"):
        Skeleton.build(
            ball,
            bones=tmp_path / "bones.toml",
            shape=(2, 2, 2),
            weights=((1.0, 0.0, 0.0), (1.0, 0.0)),
        )


def test_a_large_tree_is_compiled_in_seconds():
    chain = [
        Bone(f"b{i}", (0, i, 0), (0, i + 1, 0), parent=f"b{i - 1}" if i else None)
        for i in range(400)
    ]
    direct = DirectSkeleton(Bones(tuple(chain)))
    given = np.zeros((400, 10))
    given[:, 2] = np.pi / 2 / 400
    end = direct(np.array([[0.0, 400.0, 0]]), given.ravel())
    radius = 400 / (np.pi / 2)  # the chain lies on a quarter of a circle
    np.testing.assert_allclose(end, [[-radius, radius, 0]], rtol=0, atol=0.7)


class Scene:
    """A mesh in a lattice on bones, and what Blender made of it."""

    def __init__(self, path):
        self.found = np.load(path)
        counts = self.found["lattice_shape"].tolist()
        rest = self.found["lattice_rest"] @ self.found["lattice_to_world"][:3, :3].T
        self.net = ml.Lattice.box(
            rest.min(0), rest.max(0), counts, ends="blender", outside="extend"
        )
        # Blender's first index runs fastest
        order = np.arange(len(rest)).reshape(counts[::-1]).transpose(2, 1, 0).ravel()
        self.weights = self.found["weights"][order]
        ends = zip(self.found["heads"], self.found["tails"], self.found["parents"], strict=True)
        self.bones = Bones(
            tuple(
                Bone(f"{i}", head, tail, None if parent < 0 else f"{parent}")
                for i, (head, tail, parent) in enumerate(ends)
            )
        )

    def assert_same(self, moved):
        assert np.abs(moved - self.found["points"]).max() > 0.1
        # Blender works in single precision
        np.testing.assert_allclose(moved, self.found["deformed"], rtol=0, atol=2e-6)


def test_dual_quaternions_give_blenders_points(data):
    scene = Scene(data("blender/skeleton_dual_quaternion.npz"))
    skeleton = Skeleton(scene.bones, scene.net, weights=scene.weights, blend="dual quaternion")
    given = np.zeros((3, 10))
    given[:, :3] = Rotation.from_euler("xyz", scene.found["euler_xyz"]).as_rotvec()
    given[:, 3:6] = scene.found["location"]
    scene.assert_same(np.asarray(skeleton.bind(scene.found["points"])(given.ravel())))


def test_linear_blending_gives_blenders_points(data):
    """Blender's children take their parents' scale, so its own matrices are blended."""
    scene = Scene(data("blender/skeleton_linear.npz"))
    moves = scene.found["pose_matrices"] @ np.linalg.inv(scene.found["rest_matrices"])
    shares = bone_weights.by_hand(scene.weights, len(scene.weights), scene.bones)
    rest = scene.net.rest.reshape(-1, 3)
    found = dual_quaternions.linear(rest, shares, moves[:, :3, :3] - np.eye(3), moves[:, :3, 3])
    scene.assert_same(np.asarray(scene.net.bind(scene.found["points"])(found.ravel())))
