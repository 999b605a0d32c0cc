"""Every deformer keeps the contract."""

import re
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import moldline as ml
from moldline import registry
from moldline.deformers.contract import CLAUSES, check, derivatives_by_points_are_right
from moldline.deformers.volume_frame import Box

SHEARED = [[2.0, 0.0, 0.0], [1.0, 3.0, 0.2], [0.0, 0.3, 1.0]]

LATTICES = {
    "clamped": ml.Lattice.box((-1, -1, -1), (1, 1, 1), (7, 4, 3)),
    "flat": ml.Lattice.box((-1, -1, -1), (1, 1, 1), (5, 1, 2)),
    "line": ml.Lattice.box((-1, -1, -1), (1, 1, 1), (1, 1, 5)),
    "sheared": ml.Lattice((-1, -1, -0.5), SHEARED, (5, 4, 4), outside="extend"),
    "blender": ml.Lattice.box((-1, -1, -1), (1, 1, 1), (4, 3, 5), ends="blender"),
    "blender-extend": ml.Lattice.box(
        (-1, -1, -1), (1, 1, 1), (4, 3, 5), ends="blender", outside="extend"
    ),
    "bernstein": ml.Lattice.box((-1, -1, -1), (1, 1, 1), (6, 3, 4), basis="bernstein"),
    "quintic": ml.Lattice.box((-1, -1, -1), (1, 1, 1), (8, 2, 7), degree=5),
    "uneven": ml.Lattice.box((-1, -1, -1), (1, 1, 1), (6, 2, 2), knots=([0.1, 0.6], None, None)),
    "frozen": ml.Lattice.box((-1, -1, -1), (1, 1, 1), (7, 8, 2), freeze=("x+", "y-", "y+")),
}


def bent(counts, low=-1.2, high=1.2, **options):
    """A curved box around the cloud."""
    lines = [np.linspace(low, high, counts[0]), *(np.linspace(-1.2, 1.2, n) for n in counts[1:])]
    x, y, z = np.meshgrid(*lines, indexing="ij")
    points = np.stack([x + 0.1 * y * z, y + 0.1 * np.sin(2 * x), z + 0.05 * x * y], axis=-1)
    return Box.of(options.pop("name", "1"), points, **options)


def turned(box):
    """The same box with its axes in another order and direction."""
    return Box.of("2", box.points[:, ::-1].transpose(1, 2, 0, 3))


VOLUMES = {
    "bent": ml.ControlVolume([bent((6, 5, 4))], outside="keep"),
    "bernstein": ml.ControlVolume([bent((5, 3, 2), degree=9)], outside="keep"),
    "two": ml.ControlVolume(
        [bent((4, 4, 3), -1.2, 0.1), turned(bent((4, 4, 3), 0.1, 1.2))], outside="keep"
    ),
    "frozen": ml.ControlVolume([bent((8, 4, 4))], outside="keep", freeze=("i+",)),
}


APART = {
    "cage": "test_cage.py",
    "pilots": "test_pilots.py",
    "skeleton": "test_skeleton.py",
    "direct_skeleton": "test_skeleton.py",
    "hinge": "test_hinge.py",
    "wing_skeleton": "test_wing_skeleton.py",
    "body_skeleton": "test_body_skeleton.py",
}
"""Those that need points of their own to be tried, and the files where they are."""

EXAMPLES = {"lattice": LATTICES, "control_volume": VOLUMES}
"""Variants of each deformer of ours, by the name it is registered under."""

CASES = [
    pytest.param(deformer, id=f"{name}-{variant}")
    for name, variants in EXAMPLES.items()
    for variant, deformer in variants.items()
]


class Swell(ml.AbstractDeformer):
    """A plug-in in JAX: only a definition."""

    @property
    def size(self):
        return 2

    def __call__(self, points, controls):
        return points * (1 + controls[0] * jnp.sin(points[:, :1])) + controls[1] ** 2 * points**2


class Wave(ml.AbstractNumpyDeformer):
    """A plug-in in NumPy that lets complex numbers through."""

    @property
    def size(self):
        return 2

    def move(self, points, controls):
        moved = points + 0 * controls[0]
        moved[:, 2] = points[:, 2] + controls[0] * np.sin(points[:, 0] + controls[1])
        return moved


class Fold(ml.AbstractNumpyDeformer):
    """A plug-in in NumPy that does not."""

    @property
    def size(self):
        return 1

    def move(self, points, controls):
        moved = np.array(points, float)
        moved[:, 2] += controls[0] * np.sin(np.asarray(points[:, 0], float))
        return moved


OTHERS = {"swell": Swell(), "wave": Wave(), "fold": Fold()}


@pytest.fixture(scope="module")
def cloud():
    """Inside and outside the boxes, and on their faces, edges and corners."""
    rng = np.random.default_rng(0)
    corners = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 3)
    return np.concatenate([rng.uniform(-0.95, 0.95, (60, 3)), rng.uniform(-2, 2, (40, 3)), corners])


@pytest.mark.parametrize("clause", CLAUSES, ids=lambda c: c.__name__)
@pytest.mark.parametrize("deformer", CASES)
def test_a_deformer_keeps_the_contract(deformer, clause, cloud):
    if clause is derivatives_by_points_are_right:
        cloud = cloud[:60]  # "keep" jumps at the faces of the box
    clause(deformer, cloud)


@pytest.mark.parametrize("name", OTHERS)
def test_a_plug_in_keeps_the_contract(name, cloud):
    check(OTHERS[name], cloud[:60])


def test_every_deformer_of_ours_is_tried():
    classes = {name: registry.deformer(name) for name in registry.deformers()}
    ours = {name for name, one in classes.items() if one.__module__.startswith("moldline.")}
    assert ours == set(EXAMPLES) | set(APART)
    for name, where in APART.items():
        text = (Path(__file__).parent / where).read_text()
        assert classes[name].__name__ in text and re.search(r"^    check\(", text, re.MULTILINE)
    for name, variants in EXAMPLES.items():
        assert {type(deformer) for deformer in variants.values()} == {classes[name]}


def test_a_numpy_plug_in_says_how_it_is_differentiated(cloud):
    assert OTHERS["wave"].method(cloud, np.array([0.1, 0.2])) == "complex step"


def test_a_numpy_plug_in_that_drops_imaginary_parts_falls_back(cloud):
    assert OTHERS["fold"].method(cloud, np.array([0.1])) == "central differences"


def test_the_contract_catches_a_wrong_deformer(cloud):
    class Greedy(ml.AbstractDeformer):
        """Looks at the other points."""

        @property
        def size(self):
            return 1

        def __call__(self, points, controls):
            return points + controls[0] * points.mean(axis=0)

    with pytest.raises(AssertionError, match="moves otherwise when it is alone"):
        check(Greedy(), cloud)


def test_an_unknown_deformer_is_told_with_what_there_is():
    with pytest.raises(ml.errors.ParameterError, match="no deformers named 'lattce'; installed: "):
        registry.deformer("lattce")
