"""A live Blender for the tests that compare with it."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))

import blender_process


@pytest.fixture(scope="session")
def imports_bpy():
    """Skips, and says why, where there is no Blender to run."""
    reason = blender_process.lacking()
    if reason:
        pytest.skip(reason)


@pytest.fixture(scope="session")
def blender(imports_bpy):
    """One Blender process for all tests."""
    with blender_process.Blender(patience=120.0) as process:
        yield process
