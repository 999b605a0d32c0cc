"""Memory that processes of one machine share, so that large arrays need not be sent.

Standard library and NumPy only. The server's front process makes every segment and removes it
when its client leaves; clients and workers only look into it, and remove nothing.
"""

import os
import secrets
import sys
import threading
from collections.abc import Mapping
from multiprocessing import resource_tracker
from multiprocessing.shared_memory import SharedMemory
from typing import Any, NamedTuple

import numpy as np

from .protocol import entry, flat, padded

LARGEST = 2**30
"""Bytes of one segment."""

_ATTACHING = threading.Lock()


def create(size: int) -> SharedMemory:
    """A new segment of our own, its memory set aside: a full disk is an error, not a crash."""
    memory = SharedMemory(f"moldline_{secrets.token_hex(8)}", create=True, size=size)
    place = getattr(memory, "_fd", -1)
    if place >= 0 and hasattr(os, "posix_fallocate"):
        try:
            os.posix_fallocate(place, 0, size)
        except OSError:
            remove(memory)
            raise
    return memory


def remove(memory: SharedMemory) -> None:
    """Remove a segment of our own; who still looks into it may finish."""
    memory.close()
    try:
        memory.unlink()
    except FileNotFoundError:  # someone cleaned up behind us
        resource_tracker.unregister(f"/{memory.name}", "shared_memory")


def attach(name: str) -> SharedMemory:
    """Another's segment, to look into."""
    if sys.version_info >= (3, 13):
        return SharedMemory(name, track=False)
    with _ATTACHING:  # before 3.13 whoever attaches would also remove it when it ends
        known = resource_tracker.register
        resource_tracker.register = lambda *_: None
        try:
            return SharedMemory(name)
        finally:
            resource_tracker.register = known


def seen(memory: SharedMemory) -> memoryview:
    """A segment's bytes."""
    assert memory.buf is not None  # it would have been closed
    return memory.buf


class Place(NamedTuple):
    """A part of a segment that a request and its answer may use."""

    memory: SharedMemory
    offset: int
    size: int

    def as_dict(self) -> dict[str, Any]:
        """For a request's header."""
        return {"segment": self.memory.name, "offset": self.offset, "size": self.size}

    def put(self, arrays: Mapping[str, np.ndarray]) -> list[dict[str, Any]] | None:
        """What a header says of arrays that now lie here; None where they do not fit."""
        if sum(padded(array.nbytes) for array in arrays.values()) > self.size:
            return None
        entries, position = [], self.offset
        for name, array in arrays.items():
            place = {"segment": self.memory.name, "offset": position}
            entries.append({**entry(name, array), **place})
            seen(self.memory)[position : position + array.nbytes] = flat(array)
            position += padded(array.nbytes)
        return entries
