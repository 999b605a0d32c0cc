"""Surfaces whose topology and volume are known."""

import numpy as np

from moldline.mesh.surface import Surface

CUBE_POINTS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float
)
CUBE_SIDES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
CUBE = np.array([[a, *pair] for a, b, c, d in CUBE_SIDES for pair in ([b, c], [c, d])])


def cube(offset: float = 0.0) -> Surface:
    return Surface(CUBE_POINTS + offset, CUBE)


def two_cubes(shared: list[int]) -> np.ndarray:
    """Faces of two cubes that have some of their points in common."""
    second = np.arange(8, 16)
    second[shared] = shared
    return np.concatenate([CUBE, second[CUBE]])
