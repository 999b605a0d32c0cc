"""Messages through a pipe: what is told as JSON, and arrays as they lie in memory."""

import json
import struct
from collections.abc import Mapping
from io import BufferedIOBase
from typing import Any

import numpy as np

HELLO = b"\nmoldline speaks here\n"
"""Written before the first message: Blender itself prints lines before."""

HEAD = struct.Struct("<4sI")
MAGIC = b"mlbl"

Message = tuple[dict[str, Any], dict[str, np.ndarray]]


def write(
    stream: BufferedIOBase, told: Mapping[str, Any], arrays: Mapping[str, np.ndarray]
) -> None:
    """Send a message."""
    plain = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    forms = [[name, array.dtype.str, array.shape] for name, array in plain.items()]
    head = json.dumps({"told": told, "arrays": forms}).encode()
    stream.write(HEAD.pack(MAGIC, len(head)) + head)
    for array in plain.values():
        stream.write(array.reshape(-1).view(np.uint8).data)
    stream.flush()


def read(stream: BufferedIOBase) -> Message | None:
    """The next message; None where the stream has ended."""
    start = _bytes(stream, HEAD.size)
    if start is None:
        return None
    magic, length = HEAD.unpack(start)
    if magic != MAGIC:
        raise ValueError(f"a message begins with {magic!r}, expected {MAGIC!r}")
    head = _bytes(stream, length)
    if head is None:
        return None
    content = json.loads(head)
    arrays = {}
    for name, form, shape in content["arrays"]:
        array = np.empty(shape, np.dtype(form))
        body = _bytes(stream, array.nbytes)
        if body is None:
            return None
        arrays[name] = np.frombuffer(body, array.dtype).reshape(shape)
    return content["told"], arrays


def skip_to_hello(stream: BufferedIOBase) -> bool:
    """Read past what is printed before the first message; False where the stream ends before."""
    seen = b""
    while not seen.endswith(HELLO):
        byte = stream.read(1)
        if not byte:
            return False
        seen = (seen + byte)[-len(HELLO) :]
    return True


def _bytes(stream: BufferedIOBase, count: int) -> bytearray | None:
    found = bytearray(count)
    view, start = memoryview(found), 0
    while start < count:
        part = stream.readinto(view[start:])
        if not part:
            return None
        start += part
    return found
