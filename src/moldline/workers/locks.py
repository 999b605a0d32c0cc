"""One at a time, over processes: a lock that ends with whoever holds it."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path

from ..errors import TaskError
from .attempt import is_cancelled

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

POLL = 0.05
"""How often a lock is tried [s]."""


@contextlib.contextmanager
def locked(path: Path, is_patient: bool = True) -> Iterator[None]:
    """Hold the lock of a file, which is made; one who is not patient gets an error at once.

    The system frees it when its holder dies. Where the system has no such locks, nothing is held.
    """
    with path.open("w") as file:
        while not _taken(file.fileno()):
            if not is_patient:
                raise TaskError(f"{path}: another process works here; wait for it, or end it")
            if is_cancelled():
                raise TaskError(f"{path}: was cancelled while another process worked here")
            time.sleep(POLL)
        yield


def _taken(file: int) -> bool:
    if fcntl is None:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
