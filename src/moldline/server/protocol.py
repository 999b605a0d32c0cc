"""Frames between a running moldline and its clients: a JSON header and the arrays behind it.

Standard library and NumPy only: a client is these files alone.
"""

import json
import math
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

PROTOCOL = 1
"""Version of the protocol; a server and a client must have the same."""

MAGIC = b"MLD1"
PREFIX = struct.Struct("<4sIQ")
"""A frame begins with the magic word, the header's length and the body's, little-endian."""

LARGEST_HEADER = 2**24
LARGEST_BODY = 2**31
LARGEST_GREETING = 2**16
"""Bytes; the last is for a client that has not been let in yet."""

DTYPES = ("<f8", "<f4", "<i8", "<i4", "|u1", "|b1")
MOST_AXES = 8
ALIGNMENT = 8
"""Each array of a body begins at a multiple of it."""

ASKED_OF_SERVER = ("ping", "list", "share", "unshare", "open", "close", "shutdown")
ASKED_OF_CASE = (
    "geometry", "values", "points", "pushforward", "pullback", "sensitivity", "measures", "nets",
    "embed", "save", "check", "handles", "follow", "colour",
)  # fmt: skip
ASKED_OF_WORKSHOP = ("formats", "read", "write", "draft", "amend", "relocate")
"""Operations; `ping` with a case goes through to the process that holds it.

Those of the workshop need no case: one process for all clients does them.
"""

Buffer: TypeAlias = bytes | bytearray | memoryview

Fetch: TypeAlias = Callable[[str, int, int], Buffer]
"""Bytes in shared memory, by the segment's name, the offset and how many."""

CODES = {
    "malformed": "a frame that is none, or a header that does not say what it must",
    "too large": "a frame or an array beyond the limits",
    "version": "client and server do not speak the same protocol",
    "token": "the token is missing or wrong",
    "unknown operation": "no such operation",
    "unknown case": "no such case handle, or one that was closed",
    "unknown name": "no geometry, rider, embedded points or variable of that name",
    "parameter": "a value is out of bounds, not finite, or of the wrong shape",
    "geometry": "a geometry that cannot serve the purpose",
    "case": "a case that cannot be opened",
    "file": "a file that cannot be read or written",
    "worker died": "the process that held the case ended; the next request starts another",
    "outdated": "a later request of the same kind took this one's place",
    "busy": "too many requests of one client, or too many cases at work",
    "not allowed": "this server does not do that",
    "memory": "not enough memory for it",
    "internal": "an error of moldline itself",
    "timeout": "no answer in time (said by the client)",
    "disconnected": "no server there, or it went away (said by the client)",
}
"""Every code of an error, and what it means."""


class ServerError(Exception):
    """What a server answers, or a client finds, when something is not as it must be.

    It stands alone, not in the tree of `moldline.errors`, since clients run without moldline.

    Attributes
    ----------
    code
        One of `CODES`.
    """

    def __init__(self, code: str, sentence: str):
        self.code = code
        self.args = (sentence,)


def refusal(header: Mapping[str, Any], error: ServerError) -> dict[str, Any]:
    """The header of an answer that says what is wrong with a request."""
    told = {"code": error.code, "message": str(error)[:4000]}
    return {"id": header.get("id"), "ok": False, "error": told}


class Message(NamedTuple):
    """A frame that was read: what its header says, and its arrays by name."""

    header: dict[str, Any]
    arrays: dict[str, np.ndarray]


def flat(array: np.ndarray) -> Buffer:
    """An array's bytes, without a copy where it is contiguous and little-endian."""
    if not array.size:
        return b""
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def plain(array: Any) -> np.ndarray:
    """An array of one of the kinds that travel; others are refused."""
    found = np.asarray(array)
    if found.dtype.byteorder == ">":
        found = found.astype(found.dtype.newbyteorder("<"))
    if found.dtype.str not in DTYPES:
        raise ServerError(
            "malformed", f"arrays of {found.dtype} do not travel, only {', '.join(DTYPES)}"
        )
    return found


def padded(count: int) -> int:
    """Bytes up to where the next array may begin."""
    return -(-count // ALIGNMENT) * ALIGNMENT


def encode(
    header: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray] | None = None,
    elsewhere: Sequence[Mapping[str, Any]] = (),
) -> list[Buffer]:
    """A frame, in pieces to be sent one after the other.

    `elsewhere` describes arrays that lie in shared memory: name, dtype, shape, segment, offset.
    """
    entries: list[Mapping[str, Any]] = list(elsewhere)
    pieces: list[Buffer] = []
    length = 0
    for name, given in (arrays or {}).items():
        array = plain(given)
        entries.append(entry(name, array))
        pieces += [flat(array), bytes(padded(array.nbytes) - array.nbytes)]
        length += padded(array.nbytes)
    if entries:
        header = {**header, "arrays": entries}
    text = json.dumps(header, separators=(",", ":")).encode()
    if len(text) > LARGEST_HEADER:
        raise ServerError("too large", f"a header of {len(text)} bytes; at most {LARGEST_HEADER}")
    return [PREFIX.pack(MAGIC, len(text), length) + text, *(p for p in pieces if len(p))]


def entry(name: str, array: np.ndarray) -> dict[str, Any]:
    """What a header says of an array."""
    return {"name": name, "dtype": array.dtype.str, "shape": list(array.shape)}


def lengths(
    prefix: Buffer, largest_header: int = LARGEST_HEADER, largest_body: int = LARGEST_BODY
) -> tuple[int, int]:
    """Bytes of a frame's header and body, from how it begins."""
    magic, header, body = PREFIX.unpack(prefix)
    if magic != MAGIC:
        raise ServerError(
            "malformed", f"a frame begins with {MAGIC!r}, got {magic!r}; is it another program's?"
        )
    for kind, length, most in (("header", header, largest_header), ("body", body, largest_body)):
        if length > most:
            raise ServerError("too large", f"a {kind} of {length} bytes; at most {most} are taken")
    return header, body


def parsed(text: Buffer) -> dict[str, Any]:
    """What a header says."""
    try:
        found = json.loads(bytes(text).decode())
    except (ValueError, RecursionError) as error:
        raise ServerError("malformed", f"a header is JSON in UTF-8: {error!s:.200}") from None
    if not isinstance(found, dict):
        raise ServerError("malformed", f"a header is a JSON object, got {found!r:.40}")
    return found


def arrays_of(
    header: Mapping[str, Any], body: Buffer, fetch: Fetch | None = None
) -> dict[str, np.ndarray]:
    """The arrays that a header describes, as views of the body or copies from shared memory."""
    entries = header.get("arrays", [])
    if not isinstance(entries, list):
        raise ServerError("malformed", f"'arrays' is a list, got {entries!r:.40}")
    found: dict[str, np.ndarray] = {}
    position = 0
    for one in entries:
        name, dtype, shape, length = described(one)
        if name in found:
            raise ServerError("malformed", f"two arrays are called {name!r:.40}")
        if "segment" in one:
            found[name] = _fetched(one, dtype, shape, length, fetch)
            continue
        if position + length > len(body):
            raise ServerError(
                "malformed", f"array {name!r:.40} needs {length} bytes, the body ends before"
            )
        count = math.prod(shape)
        found[name] = np.frombuffer(body, dtype, count, position).reshape(shape) if count else (
            np.zeros(shape, dtype)
        )  # fmt: skip
        position += padded(length)
    if position != len(body):
        raise ServerError(
            "malformed", f"the body has {len(body)} bytes, its arrays have {position}"
        )
    return found


def described(one: Any) -> tuple[str, np.dtype, tuple[int, ...], int]:
    """Name, dtype, shape and bytes of an array, from what a header says of it."""
    if not isinstance(one, dict) or not isinstance(one.get("name"), str):
        raise ServerError("malformed", f"an array has a name, dtype and shape, got {one!r:.80}")
    name, dtype = one["name"], one.get("dtype")
    shape: Any = one.get("shape")
    if dtype not in DTYPES:
        raise ServerError("malformed", f"array {name!r:.40}: dtype {dtype!r:.20} is none of ours")
    is_shape = isinstance(shape, list) and len(shape) <= MOST_AXES
    if not is_shape or not all(type(n) is int and 0 <= n <= LARGEST_BODY for n in shape):
        raise ServerError("malformed", f"array {name!r:.40}: {shape!r:.40} is no shape")
    kind = np.dtype(dtype)
    length = math.prod(shape) * kind.itemsize
    if length > LARGEST_BODY:
        raise ServerError("too large", f"array {name!r:.40}: {shape} is too large to travel")
    return name, kind, tuple(shape), length


def _fetched(
    one: Mapping[str, Any],
    dtype: np.dtype,
    shape: tuple[int, ...],
    length: int,
    fetch: Fetch | None,
) -> np.ndarray:
    segment, offset = one["segment"], one.get("offset")
    if fetch is None or not isinstance(segment, str) or type(offset) is not int or offset < 0:
        raise ServerError("malformed", f"array {one['name']!r:.40} is in no memory that we share")
    if not length:
        return np.zeros(shape, dtype)
    seen = np.frombuffer(fetch(segment, offset, length), dtype)
    return seen.reshape(shape).copy()  # the memory is the other side's to write again
