"""A live Blender's armature modifier and our skeletons, on the same bones and points."""

import numpy as np
import pytest
from blender_process import bones_scene, lattice_scene

import moldline as ml
from moldline.deformers import bone_weights
from moldline.deformers.bones import Bone, Bones
from moldline.deformers.direct_skeleton import DirectSkeleton
from moldline.deformers.skeleton import Skeleton

BONES = Bones(
    (
        Bone("root", (0, -1, 0), (0.1, 0, 0), radii=(0.5, 0.3), distance=0.6),
        Bone(
            "middle", (0.1, 0, 0), (0.2, 0.8, 0.1), parent="root", up=(0.3, 0.1, 1),
            radii=(0.4, 0.3), distance=0.8, strength=2.0,
        ),
        Bone(
            "tip", (0.2, 0.8, 0.1), (0.1, 1.5, 0.2), parent="middle", radii=(0.3, 0.2), distance=0.7
        ),
        Bone(
            "fin", (0.2, 0.8, 0.1), (0.9, 0.9, 0.3), parent="middle", radii=(0.3, 0.1), distance=0.5
        ),
    )
)  # fmt: skip

BOX = ml.Lattice.box((-1, -1.2, -0.6), (1, 1.6, 0.8), (4, 7, 3), ends="blender", outside="extend")

BLENDS = ("linear", "dual quaternion")

ROUNDING = 4e-6
"""Blender's, for places around 2: some tens of roundings by 2**-23 through matrices and shares."""

# A parent that grows carries its children the same way in both, if they start at its tail and only
# its length grows; Blender's children also move by lengths that their parents' scale, so those of
# the parent that is stretched do not move by themselves.
POSES = {
    "turned": {"rotation": 0.5},
    "moved": {"rotation": 0.5, "translation": 0.15},
    "stretched": {"stretch": 0.3},
    "all but scaled": {"rotation": 0.5, "translation": 0.15, "stretch": 0.3},
    "all": {"rotation": 0.5, "translation": 0.15, "stretch": 0.3, "scale": 0.3},
}

pytestmark = pytest.mark.blender


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform([-1, -1.2, -0.6], [1, 1.6, 0.8], (1000, 3))


def posed(rotation=0.0, translation=0.0, stretch=0.0, scale=0.0):
    """Controls: all bones turn, all but the middle one move, ends are scaled too."""
    rng = np.random.default_rng(2)
    own = np.zeros((4, 10))
    own[:, :3] = rotation * rng.normal(size=(4, 3))
    own[[0, 2, 3], 3:6] = translation * rng.normal(size=(3, 3))
    own[[0, 2], 6] = stretch, -stretch / 2
    own[2:, 7:] = scale * rng.uniform(-1, 1, (2, 3))
    return own.ravel()


def assert_same(ours, theirs, points):
    assert np.abs(ours - points).max() > 0.2
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("weights", ["envelope", "distance"])
@pytest.mark.parametrize("blend", BLENDS)
def test_bones_that_move_a_lattice_give_blenders_points(blender, points, weights, blend):
    skeleton = Skeleton(BONES, BOX, weights=weights, blend=blend)
    binding = skeleton.bind(points)
    hand = None if weights == "envelope" else skeleton.weights
    for pose in POSES.values():
        controls = posed(**pose)
        lattice = lattice_scene(points, BOX, np.zeros(BOX.size))
        blender.open(**lattice, **bones_scene(BONES, controls, blend, hand))
        assert_same(np.asarray(binding(controls)), blender.deform()["deformed"], points)


@pytest.mark.parametrize("blend", BLENDS)
def test_bones_that_move_points_themselves_give_blenders_points(blender, points, blend):
    binding = DirectSkeleton(BONES, blend=blend).bind(points)
    for pose in POSES.values():
        controls = posed(**pose)
        blender.open(points=points, **bones_scene(BONES, controls, blend, binding.weights))
        assert_same(np.asarray(binding(controls)), blender.deform()["deformed"], points)


def test_envelopes_on_points_themselves_are_blenders(blender, points):
    """Bones with weights of Blender's own finding."""
    controls = posed(**POSES["all"])
    blender.open(points=points, **bones_scene(BONES, controls, "linear"))
    shares = np.asarray(bone_weights.by_envelope(BONES, points))
    assert np.any(shares.sum(axis=1) == 0)  # Blender leaves these where they are, too
    ours = points + DirectSkeleton(BONES).moves(points, shares, controls)
    assert_same(np.asarray(ours), blender.deform()["deformed"], points)
