"""What all tests share."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import moldline as ml


@pytest.fixture
def data() -> Callable[[str], Path]:
    """Finds a real file by name, in MOLDLINE_DATA or beside the repository; else skips."""
    beside = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("MOLDLINE_DATA", beside))

    def find(name: str) -> Path:
        if not (folder / name).exists():
            pytest.skip(f"real data file {name} is absent; say where with MOLDLINE_DATA")
        return folder / name

    return find


@pytest.fixture(scope="module", autouse=True)
def _forgetting():
    """Drop what JAX compiled for a module's tests, or all of them together take gigabytes."""
    yield
    if "jax" in sys.modules:
        sys.modules["jax"].clear_caches()


@pytest.fixture(scope="session")
def ball():
    """A closed unit sphere of triangles, 642 points."""
    corners = np.vstack([np.eye(3), -np.eye(3)])
    faces = np.array(
        [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    )
    for _ in range(4):
        pairs = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        unique, inverse = np.unique(pairs, axis=0, return_inverse=True)
        middle = inverse.reshape(-1, 3) + len(corners)
        corners = np.vstack([corners, corners[unique].sum(axis=1)])
        corners /= np.linalg.norm(corners, axis=1, keepdims=True)
        a, b, c = faces.T
        ab, bc, ca = middle.T
        quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        faces = np.concatenate([np.stack(q, axis=1) for q in quarters])
    return ml.Surface(corners, faces)
