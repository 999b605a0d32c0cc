"""One client of a server: its frames in, its answers out."""

import asyncio
import hmac
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import protocol, shared
from .process import CaseProcess, Job
from .protocol import Buffer, ServerError

if TYPE_CHECKING:
    from .front import Front

TO_GREET = 10.0
TO_ARRIVE = 60.0
"""Seconds that a client has to say who it is, and that a frame it began may take to arrive."""

MOST_WAITING = 64
"""Requests of one client that are not answered yet."""

MOST_SHARED = 2**31
"""Bytes of shared memory of one client."""


class Connection:
    """A client from its greeting until it leaves; what it had is then given back."""

    def __init__(self, front: "Front", reader: asyncio.StreamReader, writer: asyncio.StreamWriter):
        self._front = front
        self._reader = reader
        self._writer = writer
        self._cases: dict[str, CaseProcess] = {}
        self._segments: dict[str, shared.SharedMemory] = {}
        self._outgoing: asyncio.Queue[list[Buffer] | None] = asyncio.Queue()
        self._waiting = 0
        peer = writer.get_extra_info("peername")
        self._is_near = not isinstance(peer, tuple) or peer[0] in ("127.0.0.1", "::1")

    async def run(self) -> None:
        """Serve it until it leaves or breaks the rules."""
        writing = asyncio.create_task(self._write())
        try:
            await asyncio.wait_for(self._greet(), TO_GREET)
            while True:
                await self._take()
        except ServerError as error:
            self._refuse({}, error)
        except (OSError, asyncio.IncompleteReadError, TimeoutError):
            pass
        finally:
            self._leave()
            self._outgoing.put_nowait(None)
            await asyncio.wait([writing], timeout=5)
            writing.cancel()
            self._writer.close()

    async def _greet(self) -> None:
        text, _ = await self._frame(protocol.LARGEST_GREETING, 0)
        header = protocol.parsed(text)
        if header.get("op") != "hello":
            raise ServerError("malformed", "the first frame of a client is its 'hello'")
        if header.get("protocol") != protocol.PROTOCOL:
            raise ServerError(
                "version",
                f"this is moldline {self._front.version} with protocol {protocol.PROTOCOL}, the "
                f"client speaks protocol {header.get('protocol')!r:.20}; install the same version",
            )
        token = self._front.token
        given = str(header.get("token", ""))
        if token is not None and not hmac.compare_digest(token.encode(), given.encode()):
            await asyncio.sleep(0.2)
            raise ServerError("token", "the token is missing or not the one of this server")
        known = {"protocol": protocol.PROTOCOL, "moldline": self._front.version}
        self._answer(header, shared_memory=self._is_near, **known)

    async def _frame(self, largest_header: int, largest_body: int) -> tuple[bytes, list[Buffer]]:
        """The header's text of the next frame, and the whole frame."""
        prefix = await self._reader.readexactly(protocol.PREFIX.size)
        header, body = protocol.lengths(prefix, largest_header, largest_body)
        async with asyncio.timeout(TO_ARRIVE):
            text = await self._reader.readexactly(header)
            rest = [await self._reader.readexactly(body)] if body else []
        return text, [prefix + text, *rest]

    async def _take(self) -> None:
        while self._outgoing.qsize() > MOST_WAITING:  # it asks faster than it reads
            await asyncio.sleep(0.01)
        text, pieces = await self._frame(protocol.LARGEST_HEADER, self._front.largest)
        header: dict[str, Any] = {}
        try:
            header = protocol.parsed(text)
            await self._handle(header, pieces)
        except ServerError as error:
            self._refuse(header, error)
        except Exception as error:
            self._refuse(header, ServerError("internal", f"{type(error).__name__}: {error}"))

    async def _handle(self, header: dict[str, Any], pieces: list[Buffer]) -> None:
        name = str(header.get("op"))
        if not isinstance(header.get("id"), int | str):
            raise ServerError("malformed", "a request has an 'id', a number or a text")
        if name == "ping" and "case" not in header:
            return self._answer(header)
        if name == "open":
            return await self._open(header)
        if name in protocol.ASKED_OF_CASE or name == "ping":
            return self._pass_on(header, pieces)
        if name in protocol.ASKED_OF_WORKSHOP:
            self._check_places(header)
            workshop = self._front.cases.workshop
            return self._submit(workshop, Job(header, pieces, self, self._answered))
        own: dict[str, Any] = {
            "list": self._list,
            "close": self._close,
            "share": self._share,
            "unshare": self._unshare,
            "shutdown": self._shutdown,
        }
        if name not in own:
            every = protocol.ASKED_OF_SERVER + protocol.ASKED_OF_CASE + protocol.ASKED_OF_WORKSHOP
            known = ", ".join(every)
            raise ServerError("unknown operation", f"no operation {name!r:.60}; there is: {known}")
        own[name](header)

    async def _open(self, header: dict[str, Any]) -> None:
        kinds: tuple[str, ...] = ("path",) if "path" in header else ("text", "folder")
        for kind in kinds:
            if not isinstance(header.get(kind), str):
                raise ServerError("malformed", "'open' needs 'path', or 'text' and 'folder'")
        self._check_places(header)
        place = header[kinds[-1]]
        if not Path(place).is_absolute():
            raise ServerError("parameter", f"{place!r:.80}: give a full path, from the root")
        handle, case = await self._front.cases.open({str(k): header[k] for k in kinds})
        self._cases[handle] = case
        keep: dict[str, Any] = {key: header[key] for key in ("id", "into") if key in header}
        ask = {**keep, "op": "describe", "case": handle}

        def answer(told: dict[str, Any], pieces: list[Buffer]) -> None:
            self._answered(told, pieces)
            if not told.get("ok") and self._cases.pop(handle, None) is not None:
                case.handles.discard(handle)

        self._submit(case, Job(ask, protocol.encode(ask), self, answer))

    def _pass_on(self, header: dict[str, Any], pieces: list[Buffer]) -> None:
        handle = header.get("case")
        if not isinstance(handle, str) or handle not in self._cases:
            raise ServerError("unknown case", f"no case {handle!r:.60} is open here; open it")
        self._check_places(header)
        what = "points" if header["op"] == "follow" else header["op"]
        latest = (id(self), handle, what, str(header.get("of", "")))
        job = Job(header, pieces, self, self._answered, latest if header.get("latest") else None)
        self._submit(self._cases[handle], job)

    def _submit(self, case: CaseProcess, job: Job) -> None:
        if self._waiting >= MOST_WAITING:
            raise ServerError("busy", f"{self._waiting} requests wait already; read their answers")
        self._waiting += 1
        case.submit(job)

    def _answered(self, header: dict[str, Any], pieces: list[Buffer]) -> None:
        self._waiting -= 1
        self._outgoing.put_nowait(pieces)

    def _list(self, header: dict[str, Any]) -> None:
        self._answer(header, cases=self._front.cases.as_list())

    def _close(self, header: dict[str, Any]) -> None:
        handle = header.get("case")
        case = self._cases.pop(handle, None) if isinstance(handle, str) else None
        if case is None:
            raise ServerError("unknown case", f"no case {handle!r:.60} is open here")
        self._let_go(str(handle), case)
        self._answer(header)

    def _share(self, header: dict[str, Any]) -> None:
        size = header.get("size")
        if not self._is_near:
            raise ServerError("not allowed", "memory is shared on one machine only")
        if type(size) is not int or not 0 < size <= shared.LARGEST:
            raise ServerError(
                "too large", f"'size' is from 1 to {shared.LARGEST}, got {size!r:.40}"
            )
        held = sum(memory.size for memory in self._segments.values())
        if held + size > MOST_SHARED:
            raise ServerError("too large", f"{held} bytes are shared already, {MOST_SHARED} may be")
        try:
            memory = shared.create(size)
        except OSError as error:
            raise ServerError("memory", f"no shared memory of {size} bytes: {error}") from None
        self._segments[memory.name] = memory
        self._answer(header, segment=memory.name, size=size)

    def _unshare(self, header: dict[str, Any]) -> None:
        memory = self._segments.pop(str(header.get("segment")), None)
        if memory is None:
            raise ServerError("unknown name", "no such segment of this client")
        self._remove([memory])
        self._answer(header)

    def _shutdown(self, header: dict[str, Any]) -> None:
        if not self._front.may_shut_down:
            raise ServerError("not allowed", "this server is not stopped by its clients")
        self._answer(header)
        self._front.stop()

    def _check_places(self, header: dict[str, Any]) -> None:
        """Shared memory that a request names is the client's own, and large enough."""
        arrays, into = header.get("arrays", []), header.get("into")
        places = [] if into is None else [into]
        for one in arrays if isinstance(arrays, list) else []:
            if isinstance(one, dict) and "segment" in one:
                places.append({**one, "size": protocol.described(one)[3]})
        for place in places:
            if not isinstance(place, dict):
                raise ServerError("malformed", f"'into' says segment, offset, size: {place!r:.60}")
            memory = self._segments.get(str(place.get("segment")))
            offset: Any = place.get("offset")
            size: Any = place.get("size")
            is_place = type(offset) is int and type(size) is int and min(offset, size) >= 0
            if memory is None or not is_place or offset + size > memory.size:
                raise ServerError("malformed", f"{place!r:.120} is in no memory that we share")

    def _leave(self) -> None:
        for handle, case in self._cases.items():
            self._let_go(handle, case)
        self._cases.clear()
        for case in self._front.cases.each():
            case.forget(self)
        self._remove(list(self._segments.values()))
        self._segments.clear()

    def _let_go(self, handle: str, case: CaseProcess) -> None:
        case.handles.discard(handle)
        case.tell({"op": "forget", "case": handle})

    def _remove(self, segments: list[shared.SharedMemory]) -> None:
        names = [memory.name for memory in segments]
        for memory in segments:
            shared.remove(memory)
        if names:
            for case in self._front.cases.each():
                case.tell({"op": "detach", "segments": names})

    def _answer(self, header: dict[str, Any], **fields: Any) -> None:
        told = {"id": header.get("id"), "ok": True, **fields}
        self._outgoing.put_nowait(protocol.encode(told))

    def _refuse(self, header: dict[str, Any], error: ServerError) -> None:
        self._outgoing.put_nowait(protocol.encode(protocol.refusal(header, error)))

    async def _write(self) -> None:
        """Send what is to be sent; a client that does not read for long is let go."""
        try:
            while (pieces := await self._outgoing.get()) is not None:
                for piece in pieces:
                    self._writer.write(piece)
                async with asyncio.timeout(TO_ARRIVE):
                    await self._writer.drain()
            if self._writer.can_write_eof():
                self._writer.write_eof()
            async with asyncio.timeout(
                0.5
            ):  # closed with bytes unread, the last answer may be lost
                while await self._reader.read(2**16):
                    pass
        except (OSError, TimeoutError, RuntimeError):
            self._writer.transport.abort()
