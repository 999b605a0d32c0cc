"""Random content with the doubles that are hardest to write."""

import numpy as np
import pytest

from moldline.mesh.grid import Grid
from moldline.mesh.surface import Surface

HARD = [5e-324, -0.0, 1e300, -2.2250738585072014e-308, 1.7976931348623157e308, 0.1, 1 / 3, -1e-5]


def hard_points(count: int) -> np.ndarray:
    rng = np.random.default_rng(7)
    points = rng.standard_normal((count, 3)) * 10.0 ** rng.integers(-30, 30, (count, 3))
    points.ravel()[: len(HARD)] = HARD
    return points


@pytest.fixture
def surface() -> Surface:
    """Every point has a face, every component too; faces are in the components' order."""
    rng = np.random.default_rng(8)
    faces = np.concatenate([np.arange(30).reshape(-1, 3), rng.integers(0, 30, (20, 3))])
    return Surface(hard_points(30), faces, np.arange(30) // 12, ("1", "2", "7"))


@pytest.fixture
def grid() -> Grid:
    return Grid(hard_points(24 + 6 + 5), ((2, 3, 4), (3, 2, 1), (1, 5, 1)))


def same_bits(one, other) -> bool:
    one, other = np.asarray(one), np.asarray(other)
    return (
        one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    )
