"""Blender's own numbers, kept, and what ours gives without a Blender.

B-spline lattices are in tests/deformers/test_lattice.py, skeletons in test_skeleton.py.
"""

import numpy as np
import pytest

import moldline as ml


@pytest.mark.parametrize("name", ["3x3x3", "7x4x2", "4x3x2", "10x2x1", "1x1x5"])
def test_a_lattice_of_degree_one_gives_blenders_linear_one(data, name):
    found = np.load(data(f"blender/lattice_linear_{name}.npz"))
    shape, matrix = found["shape"].tolist(), found["lattice_to_world"]
    rest, moved = (
        (found[key] @ matrix[:3, :3].T + matrix[:3, 3]).reshape(*shape[::-1], 3)
        for key in ("rest", "moved")
    )
    spans = np.ptp(found["rest"], axis=0)
    edges = (matrix[:3, :3] * np.where(spans > 0, spans, 1)).T
    lattice = ml.Lattice(rest[0, 0, 0], edges, shape, degree=1, outside="extend")
    controls = (moved - rest).transpose(2, 1, 0, 3).ravel()  # Blender's first index runs fastest
    ours = np.asarray(lattice.bind(found["points"])(controls))
    assert np.abs(ours - found["points"]).max() > 0.1
    # Blender computes in single precision: a few roundings of numbers around 1
    np.testing.assert_allclose(ours, found["deformed"], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "largest", "typical"),
    [("cage26_cube_p5", 0.012, 1.2e-3), ("cage26_slab_p6", 0.015, 1.2e-3)],
)
def test_a_cage_moves_points_as_blenders_does_but_for_its_cells(data, name, largest, typical):
    """In the largest displacement of a vertex; what is left is its grid's error."""
    found = np.load(data(f"blender/{name}.npz"))
    corners = found["cage"]
    moves = found["moved"] - corners
    typicals = []
    for cells in (12, 24, 48):
        cage = ml.Cage(corners, found["faces"], cells=cells)
        off = cage.bind(found["points"])(moves.ravel()) - found["deformed"]
        off = np.abs(np.asarray(off)) / np.abs(moves).max()
        typicals.append(np.sqrt(np.mean(off**2)))
    assert typicals[0] > typicals[1] > typicals[2]
    assert typicals[2] < typical
    assert off.max() < largest
