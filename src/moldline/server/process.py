"""One case and the process that holds it, seen from the front process."""

import asyncio
import multiprocessing
import signal
import socket
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from . import protocol, worker
from .protocol import Buffer, ServerError

CONTEXT = multiprocessing.get_context("spawn")
"""A fork of a process with threads, or with JAX, may hang."""

WINDOW = 2**22
"""Bytes that are read ahead of a link."""


@dataclass(eq=False)
class Job:
    """A request on its way to a case.

    Attributes
    ----------
    header, pieces
        What was asked, and the frame to pass on.
    owner
        Who asked.
    answer
        Takes the header and the frame of what comes back.
    latest
        Of requests with the same of these only the last one counts; None for all the others.
    """

    header: dict[str, Any]
    pieces: list[Buffer]
    owner: object
    answer: Callable[[dict[str, Any], list[Buffer]], None]
    latest: tuple[Any, ...] | None = None

    def refuse(self, error: ServerError) -> None:
        """Answer that it cannot be."""
        told = protocol.refusal(self.header, error)
        self.answer(told, protocol.encode(told))


class CaseProcess:
    """A case that clients have open; its process is started when there is something to do.

    Attributes
    ----------
    opening
        The request that says which case it is.
    handles
        Names under which clients have it open.
    loads
        How often it was loaded: more than once where its process ended.
    used
        When it last answered, of `time.monotonic`.
    """

    def __init__(self, opening: dict[str, Any], admit: Callable[["CaseProcess"], None]):
        self.opening = opening
        self.handles: set[str] = set()
        self.loads = 0
        self.used = time.monotonic()
        self._admit = admit
        self._waiting: deque[Job] = deque()
        self._now: Job | None = None
        self._wake = asyncio.Event()
        self._process: Any = None
        self._link: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
        self._task = asyncio.create_task(self._run())

    @property
    def is_idle(self) -> bool:
        """Whether nobody waits for it."""
        return self._now is None and not self._waiting

    @property
    def pid(self) -> int | None:
        """Of its process; None where there is none now."""
        return self._process.pid if self._process is not None and self._process.is_alive() else None

    def as_dict(self) -> dict[str, Any]:
        """For a client that asks what there is."""
        return {
            "case": str(self.opening.get("path", "given as text")),
            "pid": self.pid,
            "clients": len(self.handles),
            "waiting": len(self._waiting) + (self._now is not None),
            "loads": self.loads,
        }

    def submit(self, job: Job) -> None:
        """Queue a request; one that it makes outdated is answered so."""
        if job.latest is not None:
            for old in [one for one in self._waiting if one.latest == job.latest]:
                self._waiting.remove(old)
                old.refuse(ServerError("outdated", "a later request took this one's place"))
        self._waiting.append(job)
        self._wake.set()

    def tell(self, header: dict[str, Any]) -> None:
        """Say something to the process, if there is one, that nobody needs an answer to."""
        if self.pid is not None:
            self.submit(Job(header, protocol.encode(header), self, lambda *_: None))

    def forget(self, owner: object) -> None:
        """Drop what a client that has left still waits for."""
        self._waiting = deque(job for job in self._waiting if job.owner is not owner)

    def stop(self) -> None:
        """End the process; the next request starts another."""
        if self._link is not None:
            self._link[1].close()
        if self._process is not None and self._process.is_alive():
            self._process.terminate()
        self._link = None

    async def close(self) -> None:
        """End the process for good, and wait until it is gone."""
        self._task.cancel()
        self.stop()
        if self._process is not None:
            await asyncio.to_thread(self._process.join, 3)
            if self._process.is_alive():
                self._process.kill()
                await asyncio.to_thread(self._process.join, 3)

    async def _run(self) -> None:
        while True:
            while not self._waiting:
                self._wake.clear()
                await self._wake.wait()
            job = self._now = self._waiting.popleft()
            if job.owner is self and self.pid is None:
                self._now = None  # nobody is there to be told
                continue
            try:
                await self._ready()
                job.answer(*await self._exchange(job))
            except ServerError as error:
                job.refuse(error)
            except OSError as error:
                job.refuse(
                    ServerError("internal", f"the case's process cannot be started: {error}")
                )
            self._now, self.used = None, time.monotonic()

    async def _ready(self) -> None:
        """A process that has the case loaded."""
        if self.pid is not None and self._link is not None and not self._link[0].at_eof():
            return
        self.stop()
        self._admit(self)
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = CONTEXT.Process(target=worker.run, args=(theirs,), daemon=True)
            self._process.start()
        self._link = await asyncio.open_connection(sock=ours, limit=WINDOW)
        header = {**self.opening, "op": "load"}
        loading = Job(header, protocol.encode(header), self, lambda *_: None)
        told, _ = await self._exchange(loading)
        if not told.get("ok"):
            self.stop()
            raise ServerError(told["error"]["code"], told["error"]["message"])
        self.loads += 1

    async def _exchange(self, job: Job) -> tuple[dict[str, Any], list[Buffer]]:
        assert self._link is not None
        reader, writer = self._link
        try:
            for piece in job.pieces:
                writer.write(piece)
            await writer.drain()
            if job.header.get("op") == "detach":
                return {}, []
            prefix = await reader.readexactly(protocol.PREFIX.size)
            header, body = protocol.lengths(prefix)
            text = await reader.readexactly(header)
            pieces: list[Buffer] = [prefix + text]
            if body:
                pieces.append(await reader.readexactly(body))
        except (OSError, asyncio.IncompleteReadError):
            raise await self._death() from None
        return protocol.parsed(text), pieces

    async def _death(self) -> ServerError:
        self.stop()
        await asyncio.to_thread(self._process.join, 3)
        code = self._process.exitcode
        how = f"with status {code}"
        if code is not None and code < 0:
            how = f"by signal {-code} ({signal.Signals(-code).name})"
        return ServerError(
            "worker died",
            f"the process that held the case ended {how} before it answered; the next request "
            "loads the case again in a new one",
        )
