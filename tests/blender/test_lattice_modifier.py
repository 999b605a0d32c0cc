"""A live Blender's lattice modifier and ours, on the same points."""

import numpy as np
import pytest
from blender_process import lattice_scene
from scipy.spatial.transform import Rotation

import moldline as ml

LOW, HIGH = (-1, -1.1, -0.9), (1, 0.8, 1.2)

KINDS = {"BSPLINE": {"ends": "blender"}, "LINEAR": {"degree": 1}}
"""Blender's names of its splines, and what makes ours the same."""

SHAPES = [(3, 3, 3), (7, 4, 2), (1, 1, 5), (10, 2, 1)]

pytestmark = pytest.mark.blender


@pytest.fixture
def points():
    found = np.random.default_rng(1).uniform(-1.5, 1.5, (2000, 3))  # also outside the box
    found[:4] *= 10  # also far outside, where points follow the end
    return found


def assert_same(blender, lattice, points, kind):
    """What the two make of random displacements."""
    controls = 0.2 * np.random.default_rng(2).normal(size=lattice.size)
    blender.open(**lattice_scene(points, lattice, controls, kind))
    theirs = blender.deform()["deformed"]
    ours = np.asarray(lattice.bind(points)(controls))
    assert np.abs(ours - points).max() > 0.1
    # In single precision Blender adds the shares of up to 64 control points to a coordinate one by
    # one; each addition rounds by at most 2**-24 of it.
    coarse = 64 * 2.0**-24 * np.maximum(1, np.abs(points).max(axis=1, keepdims=True))
    assert np.all(np.abs(ours - theirs) < coarse)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@pytest.mark.parametrize("kind", KINDS)
def test_a_lattice_along_the_axes_gives_blenders_points(blender, points, shape, kind):
    lattice = ml.Lattice.box(LOW, HIGH, shape, outside="extend", **KINDS[kind])
    assert_same(blender, lattice, points, kind)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@pytest.mark.parametrize("kind", KINDS)
def test_a_lattice_object_that_is_turned_and_scaled_gives_blenders_points(
    blender, points, shape, kind
):
    turned = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix().T
    edges = turned * np.array([[2.0], [1.3], [0.7]])
    lattice = ml.Lattice((-0.8, -0.6, -0.3), edges, shape, outside="extend", **KINDS[kind])
    assert_same(blender, lattice, points, kind)


def test_a_lattice_object_that_is_sheared_gives_blenders_points(blender, points):
    edges = [[2, 0, 0], [0.5, 1, 0], [0.2, -0.3, 1]]
    lattice = ml.Lattice((-0.8, -0.6, -0.3), edges, (4, 3, 3), ends="blender", outside="extend")
    assert_same(blender, lattice, points, "BSPLINE")


def test_blender_refuses_control_points_that_are_not_evenly_spaced(blender):
    lattice = ml.Lattice.box(LOW, HIGH, (7, 4, 2), ends="clamped")
    with pytest.raises(RuntimeError, match="must rest evenly spaced in a box"):
        blender.open(**lattice_scene(np.zeros((1, 3)), lattice, np.zeros(lattice.size)))


def test_blender_is_timed_as_often_as_asked(blender):
    lattice = ml.Lattice.box(LOW, HIGH, (3, 3, 3), ends="blender")
    blender.open(**lattice_scene(np.zeros((10, 3)), lattice, np.zeros(lattice.size)))
    said = blender.deform(repeats=5)
    assert said["seconds"].shape == said["processor_seconds"].shape == (5,)
    assert np.all(said["seconds"] > 0)


@pytest.mark.parametrize("kind", ["bspline", "linear", "catmull_rom"])
@pytest.mark.parametrize("name", ["3x3x3", "7x4x2", "4x3x2", "10x2x1", "1x1x5"])
def test_the_process_gives_the_numbers_that_were_kept(blender, data, kind, name):
    """So that what the comparisons ask Blender for is what Blender was asked by hand."""
    found = np.load(data(f"blender/lattice_{kind}_{name}.npz"))
    shape, matrix = found["shape"].tolist(), found["lattice_to_world"]
    place, linear = matrix[:3, 3], matrix[:3, :3]
    rest, moved = (
        (found[key] @ linear.T + place).reshape(*shape[::-1], 3).transpose(2, 1, 0, 3)
        for key in ("rest", "moved")
    )
    spans = np.ptp(found["rest"], axis=0)
    blender.open(
        points=found["points"],
        lattice_rest=rest,
        lattice_moves=moved - rest,
        lattice_edges=(linear * np.where(spans > 0, spans, 1)).T,
        lattice_interpolation=f"KEY_{kind.upper()}",
    )
    again = blender.deform()["deformed"]
    assert np.abs(again - found["points"]).max() > 0.1
    # another matrix of the lattice for the same box; both work in single precision
    np.testing.assert_allclose(again, found["deformed"], rtol=0, atol=2e-6)
