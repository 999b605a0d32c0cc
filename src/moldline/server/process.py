"""One case and the process that holds it, seen from the front process."""

import asyncio
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from . import protocol
from .holder import Holder, Spare
from .protocol import Buffer, ServerError


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

    def __init__(
        self, opening: dict[str, Any], spare: Spare, admit: Callable[["CaseProcess"], None]
    ):
        self.opening = opening
        self.handles: set[str] = set()
        self.loads = 0
        self.used = time.monotonic()
        self._spare = spare
        self._admit = admit
        self._waiting: deque[Job] = deque()
        self._now: Job | None = None
        self._wake = asyncio.Event()
        self._holder: Holder | None = None
        self._task = asyncio.create_task(self._run())

    @property
    def is_idle(self) -> bool:
        """Whether nobody waits for it."""
        return self._now is None and not self._waiting

    @property
    def pid(self) -> int | None:
        """Of its process; None where there is none now."""
        alive = self._holder is not None and self._holder.is_alive
        return self._holder.process.pid if self._holder is not None and alive else None

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
        if self._holder is not None:
            self._holder.stop()
        self._holder = None

    async def close(self) -> None:
        """End the process for good, and wait until it is gone."""
        self._task.cancel()
        if self._holder is not None:
            await self._holder.close()

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
                holder = await self._ready()
                job.answer(*await holder.exchange(job.header, job.pieces))
            except ServerError as error:
                job.refuse(error)
            except Exception as error:  # whatever it is, the next request is served
                self.stop()
                told = f"the case's process cannot be used: {type(error).__name__}: {error}"
                job.refuse(ServerError("internal", told))
            self._now, self.used = None, time.monotonic()

    async def _ready(self) -> Holder:
        """A process that has the case loaded."""
        if self._holder is not None and self._holder.is_alive:
            return self._holder
        self.stop()
        self._admit(self)
        holder = self._holder = await self._spare.take()
        try:
            await holder.load(self.opening)
        except ServerError:
            self._holder = None
            self._spare.give(holder)
            raise
        self.loads += 1
        return holder
