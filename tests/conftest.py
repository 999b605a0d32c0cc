"""What all tests share."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest


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
