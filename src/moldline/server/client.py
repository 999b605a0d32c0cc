"""The client of a running moldline. Standard library and NumPy only.

These files are a client, wherever they are: `client`, `remote`, `live`, `places`, `starting`,
`shared`, `wire`, `protocol`.
"""

import contextlib
import select
import socket
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from . import places, protocol, starting, wire
from .live import plain
from .protocol import Message, ServerError
from .remote import RemoteCase
from .shared import Place
from .starting import Address


class Client:
    """A connection to a running moldline; several threads may use it, one after the other.

    Where the server went away, the next request connects again, and opens again what was open.

    Attributes
    ----------
    address
        Of the server.
    timeout
        Seconds that an answer may take, where a request does not say.
    moldline
        Version of the server's moldline.
    generation
        How often it has connected.
    """

    def __init__(
        self,
        address: Address,
        timeout: float = 120.0,
        shared: bool = True,
        starter: Callable[[], None] | None = None,
    ):
        """With `shared`, large arrays travel by shared memory where that is possible.

        `starter` starts a server where none answers.
        """
        self.address = address
        self.timeout = timeout
        self.moldline = ""
        self.generation = 0
        self._shares = shared
        self._starter = starter
        self._lock = threading.RLock()
        self._link: socket.socket | None = None
        self._number = 0
        self._under_way: dict[int, tuple[bool, Place | None]] = {}
        self._answers: dict[int, Message | ServerError] = {}
        self._places = places.Places()
        self.ensure()

    @classmethod
    def connect(
        cls,
        socket: str | PathLike[str] | None = None,
        host: str = "127.0.0.1",
        port: int | None = None,
        token: str | None = None,
        timeout: float = 120.0,
        shared: bool = True,
    ) -> "Client":
        """A client of a server that runs, at a Unix socket or a TCP port."""
        path = None if socket is None else str(Path(socket).absolute())
        if path is None and port is None:
            raise ValueError("where to? give socket= or port=")
        return cls(Address(path, host, port, token), timeout, shared)

    @classmethod
    def start(
        cls,
        socket: str | PathLike[str] | None = None,
        python: str | PathLike[str] | None = None,
        quit_after: float = 600.0,
        wait: float = 60.0,
        timeout: float = 120.0,
        shared: bool = True,
    ) -> "Client":
        """A client of the server at a socket, which is started if none answers there.

        `python` is the interpreter of the environment that has moldline, this one by default.
        Without `socket` it is the user's own place; where there are no Unix sockets, a free port.
        The server stops after `quit_after` seconds without a client.
        """
        place = starting.Place.of(socket)

        def starter() -> None:
            starting.start(place, python, quit_after, wait)

        if not place.answers():
            starter()
        return cls(place.address(), timeout, shared, starter)

    def ping(self) -> float:
        """Seconds that a request to the server and its answer take."""
        start = time.perf_counter()
        self.request("ping")
        return time.perf_counter() - start

    def open(
        self,
        path: str | PathLike[str] | None = None,
        text: str | None = None,
        folder: str | PathLike[str] | None = None,
        timeout: float | None = None,
    ) -> RemoteCase:
        """Open a case file; or a case given as text, with the folder that its files are in."""
        if path is not None:
            return RemoteCase(self, {"path": str(Path(path).absolute())}, timeout)
        if text is None or folder is None:
            raise ValueError("which case? give path, or text and folder")
        return RemoteCase(self, {"text": text, "folder": str(Path(folder).absolute())}, timeout)

    def cases(self) -> list[dict[str, Any]]:
        """What the server has loaded, and in which processes."""
        return list(self.request("list").header["cases"])

    def formats(self) -> dict[str, list[dict[str, str]]]:
        """What can be read and written: each `ending` of files, and the `name` of the format."""
        told = self.request("formats").header
        return {kind: told[kind] for kind in ("read", "write")}

    def read(self, path: str | PathLike[str], units: str | None = None) -> Message:
        """A geometry from a file, in metres where `units` says what the file's are.

        The header holds `kind`, `components` and `path`; arrays are `points`, and where there are
        any `faces`, `tags`, `lines`, and data of points as `data.NAME`. Volume meshes give theirs
        of the boundary.
        """
        return self.request("read", path=str(Path(path).absolute()), units=units)

    def write(
        self,
        path: str | PathLike[str],
        points: np.ndarray,
        faces: np.ndarray | None = None,
        tags: np.ndarray | None = None,
        components: Sequence[str] = (),
        data: Mapping[str, np.ndarray] | None = None,
        **options: Any,
    ) -> str:
        """Write a surface; without faces a section, or patches whose `shapes` are given.

        Options: `units` of the file, where points are in metres; `format` where the ending does
        not tell it; `is_closed` of a section. What is there is replaced when all went well.
        """
        named = {"points": points, "faces": faces, "tags": tags}
        arrays = {name: np.asarray(one) for name, one in named.items() if one is not None}
        arrays |= {f"data.{name}": np.asarray(one) for name, one in (data or {}).items()}
        fields: dict[str, Any] = {"components": list(components), **plain(options)}
        fields["path"] = str(Path(path).absolute())
        return str(self.request("write", arrays, **fields).header["path"])

    def draft(
        self,
        text: str,
        folder: str | PathLike[str],
        kind: str,
        geometry: str | PathLike[str] | None = None,
        *,
        bounded: bool = True,
        **options: Any,
    ) -> dict[str, Any]:
        """A case's text with one more stage: `text`, `why`, the number of the `stage`, `variables`.

        `kind` and its options are those of `moldline parameterise`. From an empty text it is a
        new case of a `geometry`, a file whose `units` are an option; `on` names the geometry where
        there are several. What the stage needs beside the case is written into `folder`. Unless
        `bounded`, the variables have no bounds.
        """
        own: dict[str, Any] = {"text": text, "folder": str(Path(folder).absolute()), "kind": kind}
        own |= {"geometry": None if geometry is None else str(geometry), "bounded": bounded}
        own |= {name: options.pop(name) for name in ("units", "on") if name in options}
        own["options"] = plain(options)
        told = self.request("draft", **own).header
        return {name: told[name] for name in ("text", "why", "stage", "variables")}

    def amend(
        self, text: str, folder: str | PathLike[str], edits: Sequence[Mapping[str, Any]]
    ) -> dict[str, Any]:
        """A case's `text` with some edits; comments and order stay.

        An edit is {"set": path, "to": value}, {"remove": path} or {"append": path, "value": one};
        a path is a list of keys and indices: ["stage", 0, "link"].
        """
        told = self.request("amend", text=text, edits=plain(edits)).header
        return {"text": told["text"]}

    def relocate(
        self,
        text: str,
        folder: str | PathLike[str],
        path: str | PathLike[str],
        gather: bool = False,
    ) -> dict[str, Any]:
        """Write a case's text, whose files are named from `folder`, to a case file; gives `text`.

        With `gather` files that lie in `folder` are copied beside the case file.
        """
        place, target = (str(Path(one).absolute()) for one in (folder, path))
        fields: dict[str, Any] = {"text": text, "folder": place, "path": target, "gather": gather}
        return {"text": self.request("relocate", **fields).header["text"]}

    def shutdown(self) -> None:
        """Stop the server, where it allows that."""
        with self._lock:
            self.request("shutdown")
            self._starter = None
            self.close()

    def request(
        self,
        op: str,
        arrays: Mapping[str, np.ndarray] | None = None,
        timeout: float | None = None,
        **fields: Any,
    ) -> Message:
        """Ask, and wait for the answer; `ServerError` where that says what is wrong."""
        with self._lock:
            self.ensure()
            return self.wait(self.send(op, arrays, **fields), timeout)

    def send(self, op: str, arrays: Mapping[str, np.ndarray] | None = None, **fields: Any) -> int:
        """Ask without waiting; the number is for `wait` or `taken`."""
        with self._lock:
            link = self.ensure()
            is_large = op in protocol.ASKED_OF_CASE + protocol.ASKED_OF_WORKSHOP
            if self._shares and is_large:
                self._provide(arrays)
            self._number += 1
            given = {name: protocol.plain(one) for name, one in (arrays or {}).items()}
            place = self._places.take() if is_large else None
            self._under_way[self._number] = is_large, place
            into = {} if place is None else {"into": place.as_dict()}
            entries = place.put(given) if place is not None and given else None
            header = {"id": self._number, "op": op, **fields, **into}
            pieces = protocol.encode(header, None if entries else given, entries or ())
            try:
                wire.send(link, pieces, self.timeout)
            except OSError as error:
                raise self._lost(error) from None
            return self._number

    def wait(self, number: int, timeout: float | None = None) -> Message:
        """The answer to a request."""
        with self._lock:
            deadline = time.monotonic() + (self.timeout if timeout is None else timeout)
            while number not in self._answers:
                self._read(deadline)
            return self.taken(number)  # type: ignore[return-value]

    def taken(self, number: int) -> Message | None:
        """The answer to a request if it is there by now; this never waits."""
        with self._lock:
            while number not in self._answers and self._has_news():
                self._read(time.monotonic() + self.timeout)
            answer = self._answers.pop(number, None)
            if isinstance(answer, ServerError):
                raise answer
            return answer

    def expect(self, count: int) -> None:
        """Answers of so many bytes will come: shared memory for them may be made in advance."""
        self._places.need(count)

    def sleep(self, seconds: float) -> None:
        """Wait for news from the server, at most so long."""
        if self._link is not None:
            select.select([self._link], [], [], seconds)

    def ensure(self) -> socket.socket:
        """The connection, made again where it was lost."""
        with self._lock:
            if self._link is None:
                try:
                    self._connect()
                except (OSError, ServerError) as error:
                    if self._starter is None or isinstance(error, ServerError):
                        raise self._lost(error) from None
                    self._starter()
                    self._connect()
            assert self._link is not None
            return self._link

    def close(self) -> None:
        """Leave; the server then drops what only this client had."""
        with self._lock:
            if self._link is not None:
                self._link.close()
            self._link = None
            self._places.close()
            for number in self._under_way:
                gone = ServerError("disconnected", "the connection was closed before the answer")
                self._answers[number] = gone
            self._under_way.clear()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _connect(self) -> None:
        path, host, port, token = self.address
        if path is None:
            link = socket.create_connection((host, port or 0), self.timeout)
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        else:
            link = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            if path is not None:
                link.settimeout(self.timeout)
                link.connect(path)
            hello = {"id": 0, "op": "hello", "protocol": protocol.PROTOCOL, "token": token or ""}
            wire.send(link, protocol.encode(hello), self.timeout)
            told, _ = wire.receive(link, time.monotonic() + self.timeout)
            problem = wire.problem_of(told)
            if problem is not None:
                raise problem
        except BaseException:
            link.close()
            raise
        self.moldline = str(told.get("moldline", ""))
        self._shares = self._shares and bool(told.get("shared_memory"))
        self._link, self._places = link, places.Places()
        self.generation += 1

    def _read(self, deadline: float) -> None:
        """One answer, kept until it is asked for."""
        if self._link is None:
            raise ServerError("disconnected", f"{self.address}: not connected")
        try:
            header, body = wire.receive(self._link, deadline)
        except TimeoutError:
            self.close()
            raise ServerError(
                "timeout", "no answer in time; the request is given up, the next one connects again"
            ) from None
        except (OSError, ServerError) as error:
            raise self._lost(error) from None
        except BaseException:  # interrupted within a frame: where the next one begins is not known
            self.close()
            raise
        number = header.get("id")
        problem = wire.problem_of(header)
        if number not in self._under_way:
            if problem is not None:  # said of the connection as a whole
                raise self._lost(problem)
            return
        is_large, place = self._under_way.pop(number)
        try:
            arrays = protocol.arrays_of(header, body, self._places.fetch)
            self._answers[number] = problem or Message(header, arrays)
        except ServerError as error:
            self._answers[number] = error
        if place is not None:
            self._places.give(place)
        if is_large:
            self._places.need(len(body))

    def _has_news(self) -> bool:
        return self._link is not None and bool(select.select([self._link], [], [], 0)[0])

    def _lost(self, error: Exception) -> ServerError:
        self.close()
        if isinstance(error, ServerError):
            return error
        return ServerError("disconnected", f"{self.address}: {error}; does a server run there?")

    def _provide(self, arrays: Mapping[str, np.ndarray] | None) -> None:
        """Shared memory for what is to travel; without it, all is sent."""
        self._places.need(sum(np.asarray(one).nbytes for one in (arrays or {}).values()))
        if not self._places.should_grow:
            return
        old, size = self._places.segment, self._places.wanted
        self._shares = False  # until it is known that it works
        with contextlib.suppress(ServerError, OSError):
            if old is not None:
                self._places.close()
                self.wait(self.send("unshare", segment=old))
            told = self.wait(self.send("share", size=size * places.COUNT)).header
            self._places.set(told["segment"], size)
            self._shares = True
