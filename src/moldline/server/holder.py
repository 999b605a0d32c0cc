"""A process that can hold a case, and the link to it, seen from the front process."""

import asyncio
import multiprocessing
import signal
import socket
from collections.abc import Sequence
from multiprocessing.context import SpawnProcess
from typing import Any

from . import protocol, worker
from .protocol import Buffer, ServerError

CONTEXT = multiprocessing.get_context("spawn")
"""A fork of a process with threads, or with JAX, may hang."""

WINDOW = 2**22
"""Bytes that are read ahead of a link."""

SILENT = ("detach",)
"""What a worker does not answer."""


class Holder:
    """A process and the link to it.

    Attributes
    ----------
    process
        It was started with a link to us.
    """

    def __init__(
        self, process: SpawnProcess, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ):
        self.process = process
        self._reader = reader
        self._writer = writer
        self._warming: asyncio.Task[Any] | None = None

    @classmethod
    async def started(cls) -> "Holder":
        """A new one, which begins at once to import what every case needs."""
        ours, theirs = socket.socketpair()
        with theirs:
            process = CONTEXT.Process(target=worker.run, args=(theirs,), daemon=True)
            process.start()
        reader, writer = await asyncio.open_connection(sock=ours, limit=WINDOW)
        self = cls(process, reader, writer)
        self._warming = asyncio.create_task(self.exchange(*_framed({"op": "warm"})))
        self._warming.add_done_callback(lambda task: task.cancelled() or task.exception())
        return self

    @property
    def is_alive(self) -> bool:
        """Whether it is there."""
        return self.process.is_alive() and not self._reader.at_eof()

    async def load(self, opening: dict[str, Any]) -> None:
        """Have it load a case; what is wrong with that is raised."""
        if self._warming is not None:
            await self._warming
        told, _ = await self.exchange(*_framed({**opening, "op": "load"}))
        if not told.get("ok"):
            raise ServerError(told["error"]["code"], told["error"]["message"])

    async def exchange(
        self, header: dict[str, Any], pieces: Sequence[Buffer]
    ) -> tuple[dict[str, Any], list[Buffer]]:
        """The answer to a frame: its header, and the frame as it came."""
        try:
            for piece in pieces:
                self._writer.write(piece)
            await self._writer.drain()
            if header.get("op") in SILENT:
                return {}, []
            prefix = await self._reader.readexactly(protocol.PREFIX.size)
            length, body = protocol.lengths(prefix)
            text = await self._reader.readexactly(length)
            found: list[Buffer] = [prefix + text]
            if body:
                found.append(await self._reader.readexactly(body))
        except (OSError, asyncio.IncompleteReadError):
            raise await self._death() from None
        return protocol.parsed(text), found

    def stop(self) -> None:
        """End it; it has nothing to lose."""
        if self._warming is not None:
            self._warming.cancel()
        self._writer.close()
        if self.process.is_alive():
            self.process.terminate()

    async def close(self) -> None:
        """End it and wait until it is gone."""
        self.stop()
        await asyncio.to_thread(self.process.join, 3)
        if self.process.is_alive():
            self.process.kill()
            await asyncio.to_thread(self.process.join, 3)

    async def _death(self) -> ServerError:
        self._writer.close()
        await asyncio.to_thread(self.process.join, 3)
        code = self.process.exitcode
        how = f"with status {code}"
        if code is not None and code < 0:
            how = f"by signal {-code} ({signal.Signals(-code).name})"
        return ServerError(
            "worker died",
            f"the process that held the case ended {how} before it answered; the next request "
            "loads the case again in a new one",
        )


class Spare:
    """One process more than are needed, with all imported, so that a case need not wait for that.

    Attributes
    ----------
    is_kept
        Whether there is to be one.
    """

    def __init__(self, is_kept: bool):
        self.is_kept = is_kept
        self._next: Holder | None = None

    async def prepare(self) -> None:
        """Start the next one, if it is not there."""
        if self.is_kept and (self._next is None or not self._next.is_alive):
            self._next = await Holder.started()

    async def take(self) -> Holder:
        """The one that is there, or a new one."""
        ready, self._next = self._next, None
        return ready if ready is not None and ready.is_alive else await Holder.started()

    def give(self, holder: Holder) -> None:
        """One that holds no case; the next may be loaded into it."""
        if self.is_kept and self._next is None and holder.is_alive:
            self._next = holder
        else:
            holder.stop()

    async def close(self) -> None:
        """End it."""
        if self._next is not None:
            await self._next.close()


def _framed(header: dict[str, Any]) -> tuple[dict[str, Any], list[Buffer]]:
    return header, protocol.encode(header)
