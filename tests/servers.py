"""Servers in processes of their own, and a small case for them."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

CASE = """\
moldline = 1

[geometry.ball]
file = "ball.tri"
units = "m"

[variable.lift]
size = 2
bounds = [-1.0, 1.0]
unit = "m"

[[stage]]
name = "box"
deformer = "lattice"
shape = [2, 3, 2]
margin = [0.1, 0.1, 0.1]

[[stage.link]]
variable = "lift"
link = "camber"
along = "x"
axis = "z"

[measure.volume]
measure = "volume"
bounds = [1.0, inf]
"""


@contextmanager
def serving(*arguments: str) -> Iterator[subprocess.Popen]:
    """A server as a user starts it; it ends well when it is told to."""
    server = subprocess.Popen(
        [sys.executable, "-m", "moldline", "serve", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield server
    finally:
        server.terminate()
        _, told = server.communicate(timeout=30)
        assert server.returncode == 0, told
        assert "Traceback" not in told and "leaked" not in told, told


def until(condition: Callable[[], object], seconds: float = 30.0) -> None:
    """Wait for something that is to become true."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.02)


def is_shared(name: str) -> bool:
    """Whether a segment of shared memory is there."""
    return (Path("/dev/shm") / name).exists()
