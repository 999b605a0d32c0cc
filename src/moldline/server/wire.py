"""Frames through a socket that waits. Standard library and NumPy only."""

import socket
import sys
import time
from collections.abc import Sequence
from typing import Any

from . import protocol
from .protocol import Buffer, ServerError

SMALL = 2**16
"""Pieces up to so many bytes are sent as one."""

QUIET = getattr(socket, "MSG_NOSIGNAL", 0)
"""A lost connection is an error, not SIGPIPE, of which a program that embeds Python would die."""

SO_NOSIGPIPE = 0x1022
"""The same as an option of a socket, where macOS has no flag; Python does not name it."""


def receive(link: socket.socket, deadline: float | None = None) -> tuple[dict[str, Any], bytearray]:
    """The header and the body of the next frame; TimeoutError past the deadline.

    The deadline is of `time.monotonic`.
    """
    header, body = protocol.lengths(_exactly(link, protocol.PREFIX.size, deadline))
    text = _exactly(link, header, deadline)
    return protocol.parsed(text), _exactly(link, body, deadline)


def send(link: socket.socket, pieces: Sequence[Buffer], timeout: float | None = None) -> None:
    """A frame, all of it."""
    link.settimeout(timeout)
    if sys.platform == "darwin" and not QUIET:
        link.setsockopt(socket.SOL_SOCKET, SO_NOSIGPIPE, 1)
    waiting = b""
    for piece in pieces:
        if len(waiting) + len(piece) <= SMALL:
            waiting += bytes(piece)
            continue
        if waiting:
            link.sendall(waiting, QUIET)
        waiting = b""
        link.sendall(piece, QUIET)
    if waiting:
        link.sendall(waiting, QUIET)


def _exactly(link: socket.socket, count: int, deadline: float | None) -> bytearray:
    found = bytearray(count)
    view, position = memoryview(found), 0
    while position < count:
        if deadline is not None:
            link.settimeout(max(deadline - time.monotonic(), 1e-3))
        elif link.gettimeout() is not None:
            link.settimeout(None)
        got = link.recv_into(view[position:])
        if not got:
            raise ConnectionResetError("the other side closed the connection")
        position += got
    return found


def problem_of(header: dict[str, Any]) -> ServerError | None:
    """What an answer says is wrong."""
    if header.get("ok"):
        return None
    told = header.get("error")
    told = told if isinstance(told, dict) else {}
    return ServerError(str(told.get("code", "internal")), str(told.get("message", "no reason")))
