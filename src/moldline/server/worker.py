"""The process that holds a case: one request after the other, from one socket."""

import os
import signal
import socket
import sys
import traceback
from collections import OrderedDict
from typing import TYPE_CHECKING, Any

from . import protocol, wire
from .protocol import Buffer, Message, ServerError
from .shared import Place, SharedMemory, attach, seen

if TYPE_CHECKING:
    from .held import Held

MOST_SEGMENTS = 16
"""Segments that stay attached; the memory of one that was removed is freed when it is let go."""


class Segments:
    """Shared memory that requests have named, the latest first."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, SharedMemory] = OrderedDict()

    def of(self, name: str) -> SharedMemory:
        """A segment by name."""
        if name not in self._known:
            self._known[name] = attach(name)
            while len(self._known) > MOST_SEGMENTS:
                self._known.popitem(last=False)[1].close()
        self._known.move_to_end(name)
        return self._known[name]

    def fetch(self, name: str, offset: int, length: int) -> Buffer:
        """Bytes of one; its front process has checked that they are the client's."""
        return seen(self.of(name))[offset : offset + length]

    def drop(self, names: list[str]) -> None:
        """Let go of those that were removed."""
        for name in names:
            if name in self._known:
                self._known.pop(name).close()


def run(link: socket.socket, cores: int | None = None) -> None:
    """Serve until the other end of the link is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the front process says when to stop
    if cores is not None:
        os.environ["MOLDLINE_THREADS"] = str(cores)
    segments = Segments()
    held: Held | None = None
    while True:
        try:
            header, body = wire.receive(link)
        except (OSError, ServerError):
            return
        if header.get("op") == "detach":
            segments.drop(header["segments"])
            continue
        try:
            answer = Message({}, {})
            if header.get("op") == "warm":
                _warm()
            elif header.get("op") == "load":
                held = _loaded(header)
            else:
                answer = _answer(held, header, body, segments)
            pieces = _encoded(header, answer, segments)
        except Exception as error:
            pieces = protocol.encode(protocol.refusal(header, _problem(error)))
        try:
            wire.send(link, pieces)
        except OSError:
            return


def _warm() -> None:
    """Import what every case needs, which takes longer than to load most of them."""
    import threading

    os.environ.setdefault("TQDM_DISABLE", "1")  # nobody looks at a bar here
    import tqdm

    tqdm.tqdm.set_lock(threading.RLock())  # a killed process would leave its own one behind
    from . import operations, workshop  # noqa: F401


def _loaded(header: dict[str, Any]) -> "Held | None":
    """The case that is to be held; none by the workshop."""
    from .held import opened

    return None if "workshop" in header else opened(header)


def _answer(held: "Held | None", header: dict[str, Any], body: Buffer, own: Segments) -> Message:
    from .operations import OPERATIONS
    from .workshop import WORKSHOP

    ask = Message(header, protocol.arrays_of(header, body, own.fetch))
    if header["op"] in WORKSHOP:
        return WORKSHOP[header["op"]](ask)
    assert held is not None
    return OPERATIONS[header["op"]](held, ask)


def _encoded(header: dict[str, Any], answer: Message, segments: Segments) -> list[Buffer]:
    """The frame of an answer; arrays lie in shared memory where there is a place for them."""
    fields = {"id": header.get("id"), "ok": True, **answer.header}
    arrays = {name: protocol.plain(one) for name, one in answer.arrays.items()}
    into = header.get("into")
    if not into or not arrays:
        return protocol.encode(fields, arrays)
    place = Place(segments.of(into["segment"]), into["offset"], into["size"])
    entries = place.put(arrays)
    if entries is None:
        return protocol.encode(fields, arrays)
    return protocol.encode(fields, None, entries)


def _problem(error: Exception) -> ServerError:
    from ..errors import CaseError, FileError, GeometryError, MoldlineError, ParameterError

    codes = {
        CaseError: "case",
        FileError: "file",
        GeometryError: "geometry",
        ParameterError: "parameter",
    }
    if isinstance(error, ServerError):
        return error
    if isinstance(error, MoldlineError):
        return ServerError(codes.get(type(error), "internal"), str(error))
    if isinstance(error, MemoryError):
        return ServerError("memory", f"not enough memory: {error}")
    if isinstance(error, OSError):
        return ServerError("file", str(error))
    traceback.print_exc(file=sys.stderr)
    return ServerError("internal", f"{type(error).__name__}: {error!s:.500}; see the server's log")
