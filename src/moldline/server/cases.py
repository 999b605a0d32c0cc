"""The cases that a server has open, and how many processes hold them."""

import asyncio
import hashlib
import itertools
import json
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .holder import Spare
from .process import CaseProcess
from .protocol import ServerError

KEPT = 120.0
"""Seconds that a case which nobody has open stays loaded, for a client that comes back."""


class Cases:
    """Cases by what is in their files: two clients that open the same share one process.

    Attributes
    ----------
    most
        Processes at the same time; where more are needed, one that is idle is stopped.
    idle
        Seconds after which a process that nobody asks anything is stopped.
    spare
        The next process.
    """

    def __init__(self, most: int, idle: float, spare: Spare):
        self.most = most
        self.idle = idle
        self.spare = spare
        self._workshop: CaseProcess | None = None
        self._cases: dict[str, CaseProcess] = {}
        self._counter = itertools.count(1)

    @property
    def workshop(self) -> CaseProcess:
        """The process that does what needs no case."""
        if self._workshop is None:
            self._workshop = CaseProcess({"workshop": True}, self.spare, lambda _: None)
        return self._workshop

    async def open(self, opening: dict[str, Any]) -> tuple[str, CaseProcess]:
        """A new handle, and the case that it stands for."""
        key = await asyncio.to_thread(fingerprint, opening)
        if key not in self._cases:
            self._cases[key] = CaseProcess(opening, self.spare, self._admit)
        case, handle = self._cases[key], f"case-{next(self._counter)}"
        case.handles.add(handle)
        return handle, case

    def as_list(self) -> list[dict[str, Any]]:
        """For a client that asks."""
        return [case.as_dict() for case in self._cases.values()]

    def each(self) -> list[CaseProcess]:
        """All of them, and the workshop."""
        return [*self._cases.values(), *([self._workshop] if self._workshop else [])]

    async def tidy(self) -> None:
        """Stop what nobody has used for long, and have the next process ready."""
        if all(case.is_idle for case in self.each()):  # not while somebody waits
            await self.spare.prepare()
        now = time.monotonic()
        for key, case in list(self._cases.items()):
            if case.is_idle and not case.handles and now - case.used > min(KEPT, self.idle):
                del self._cases[key]
                await case.close()
        for case in self.each():
            if case.is_idle and case.pid is not None and now - case.used > self.idle:
                case.stop()

    async def close(self) -> None:
        """End all processes."""
        ends = [self.spare.close(), *(case.close() for case in self.each())]
        await asyncio.gather(*ends)
        self._cases.clear()

    def _admit(self, newcomer: CaseProcess) -> None:
        """Make room for one more process."""
        running = [one for one in self._cases.values() if one is not newcomer and one.pid]
        while len(running) >= self.most:
            idle = [one for one in running if one.is_idle]
            if not idle:
                raise ServerError(
                    "busy", f"{len(running)} cases are at work, at most {self.most} can be; later"
                )
            oldest = min(idle, key=lambda one: one.used)
            oldest.stop()
            running.remove(oldest)


def fingerprint(opening: dict[str, Any]) -> str:
    """What tells a case from others: its text, and the state of the files that it names."""
    try:
        content = opening["text"] if "text" in opening else Path(opening["path"]).read_text("utf-8")
        tables = tomllib.loads(content)
    except (OSError, ValueError, RecursionError):
        content, tables = "", {}  # whoever loads it will say what is wrong
    folder = Path(opening["folder"]) if "folder" in opening else Path(opening["path"]).parent
    seen = [str(opening.get("path", folder)), content]
    for text in _texts(tables):
        try:
            state = (folder / text).stat()
        except (OSError, ValueError):
            continue
        seen.append(f"{text} {state.st_size} {state.st_mtime_ns}")
    return hashlib.sha256(json.dumps(seen).encode()).hexdigest()


def _texts(tables: Any) -> Iterator[str]:
    if isinstance(tables, str):
        yield tables
    elif isinstance(tables, dict | list):
        for one in tables.values() if isinstance(tables, dict) else tables:
            yield from _texts(one)
