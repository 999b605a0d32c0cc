"""The server's front process: it listens and passes frames on; it computes nothing."""

import asyncio
import contextlib
import signal
import socket
import time
from importlib.metadata import PackageNotFoundError, version

from .cases import Cases
from .connection import Connection
from .holder import WINDOW
from .protocol import LARGEST_BODY

TIDYING = 2.0
"""Seconds between looks at what is no longer used."""


class Front:
    """A server on one listening socket.

    Attributes
    ----------
    cases
        What is open.
    token
        What a client must know; None where any may come in.
    may_shut_down
        Whether a client may stop it.
    quit_after
        Seconds without any client after which it stops; None for never.
    largest
        Bytes of a request's arrays.
    """

    def __init__(
        self,
        cases: Cases,
        token: str | None = None,
        may_shut_down: bool = False,
        quit_after: float | None = None,
        largest: int = LARGEST_BODY,
    ):
        self.token = token
        self.may_shut_down = may_shut_down
        self.quit_after = quit_after
        self.largest = largest
        self.cases = cases
        try:
            self.version = version("moldline")
        except PackageNotFoundError:
            self.version = "unknown"
        self._talking: set[asyncio.Task[None]] = set()
        self._stopping = asyncio.Event()
        self._alone_since = time.monotonic()

    async def serve(self, listening: socket.socket) -> None:
        """Serve until told to stop; then everything is given back."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            with contextlib.suppress(NotImplementedError):  # Windows: by KeyboardInterrupt
                loop.add_signal_handler(number, self.stop)
        server = await asyncio.start_server(self._meet, sock=listening, limit=WINDOW)
        try:
            await self.cases.spare.prepare()
            while not self._stopping.is_set():
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._stopping.wait(), TIDYING)
                await self.cases.tidy()
                if self.quit_after is not None and self._alone() > self.quit_after:
                    self.stop()
        finally:
            server.close()
            await self._dismiss()
            await self.cases.close()

    def stop(self) -> None:
        """Stop serving soon."""
        self._stopping.set()

    async def _meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._talking.add(task)
        try:
            with contextlib.suppress(asyncio.CancelledError):  # we stop
                await Connection(self, reader, writer).run()
        finally:
            self._talking.discard(task)
            self._alone_since = time.monotonic()

    async def _dismiss(self) -> None:
        await asyncio.sleep(0.05)  # the answer to whoever stopped us is still on its way
        for task in list(self._talking):
            task.cancel()
        if self._talking:
            await asyncio.wait(list(self._talking), timeout=10)

    def _alone(self) -> float:
        """Seconds since the last client left."""
        return 0.0 if self._talking else time.monotonic() - self._alone_since
