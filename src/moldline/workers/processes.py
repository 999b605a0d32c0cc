"""Tasks in processes on this machine."""

import contextlib
import multiprocessing
import pickle
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from typing import Any

from typing_extensions import override

from ..errors import ParameterError, TaskError
from .attempt import overran
from .base import AbstractExecutor, Outcome, cores
from .worker import serve

ATTEMPTS = 2
"""A task whose worker dies is begun this often in all."""

GRACE = 3.0
"""A worker has this long to end what it has started [s]."""


class Processes(AbstractExecutor):
    """Runs tasks in fresh Python processes, which wait for more until the executor is closed.

    A task whose worker dies (killed, or out of memory) is run once more by another. A script that
    uses it must keep what it does under `if __name__ == "__main__":`, since each worker imports it.

    Attributes
    ----------
    environment
        Variables that workers see on top of this process's own.
    """

    def __init__(self, count: int | None = None, environment: Mapping[str, str] | None = None):
        if count is not None and count < 1:
            raise ParameterError(f"an executor needs 1 worker or more, got {count}")
        self._count = count or cores()
        self.environment = dict(environment or {})
        self._idle: list[_Worker] = []
        self._lock = threading.Lock()

    @property
    @override
    def count(self) -> int:
        return self._count

    @override
    def run(
        self,
        function: Callable[[Any], Any],
        tasks: Mapping[str, Any],
        limit: float | None = None,
    ) -> Generator[Outcome, None, None]:
        waiting = deque(_Waiting(k, n, t) for k, (n, t) in enumerate(tasks.items()))
        busy: list[_Worker] = []
        try:
            while waiting or busy:
                while waiting and len(busy) < self.count:
                    worker = self._worker()
                    busy.append(worker)
                    worker.begin(function, waiting.popleft(), limit)
                for worker in _ready(busy):
                    busy.remove(worker)
                    outcome = worker.outcome(limit)
                    if outcome is None:
                        waiting.appendleft(worker.task)
                        continue
                    self._keep(worker)
                    yield outcome
        finally:
            for worker in busy:
                worker.ask()
            for worker in busy:
                worker.end()

    @override
    def close(self) -> None:
        with self._lock:
            idle, self._idle = self._idle, []
        for worker in idle:
            worker.ask()
        for worker in idle:
            worker.end()

    def _worker(self) -> "_Worker":
        with self._lock:
            while self._idle:
                worker = self._idle.pop()
                if worker.process.is_alive():
                    return worker
                worker.end()
        return _Worker(self.environment)

    def _keep(self, worker: "_Worker") -> None:
        if worker.process.is_alive():
            with self._lock:
                self._idle.append(worker)


@dataclass(frozen=True)
class _Waiting:
    """A task, and how often it was begun."""

    number: int
    name: str
    argument: Any
    attempts: int = 0


class _Worker:
    """A process and the pipe to it."""

    task: _Waiting
    deadline: float
    start: float

    def __init__(self, environment: Mapping[str, str]):
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(
            target=serve, args=(theirs, dict(environment)), daemon=True, name="moldline worker"
        )
        self.process.start()
        theirs.close()  # so that its death ends the pipe

    def begin(self, function: Callable[[Any], Any], task: _Waiting, limit: float | None) -> None:
        """Send it a task."""
        self.task = replace(task, attempts=task.attempts + 1)
        try:
            message = pickle.dumps((function, task.argument))
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            raise ParameterError(
                f"{task.name}: cannot travel to another process: {error}; use a function of a "
                "module, and plain data"
            ) from None
        self.start = time.monotonic()
        self.deadline = self.start + limit if limit is not None else float("inf")
        with contextlib.suppress(OSError):  # it is dead, which is found out where outcomes are
            self.pipe.send_bytes(message)

    def outcome(self, limit: float | None) -> Outcome | None:
        """What came of its task; None where the worker died and another should try."""
        seconds = time.monotonic() - self.start
        told = Outcome(self.task.number, self.task.name, None, None, seconds, self.task.attempts)
        try:
            if self.pipe.poll():
                attempt = pickle.loads(self.pipe.recv_bytes())
                return replace(
                    told, value=attempt.value, error=attempt.error, seconds=attempt.seconds
                )
        except (EOFError, OSError):
            pass
        if self.process.is_alive() and limit is not None and time.monotonic() >= self.deadline:
            self.end()
            return replace(told, error=overran(limit))
        self.end()
        if self.task.attempts < ATTEMPTS:
            return None
        return replace(
            told,
            error=TaskError(
                f"its worker died ({_death(self.process.exitcode)}), and so did the one before; "
                "was there too little memory?"
            ),
        )

    def ask(self) -> None:
        """Ask it to end."""
        if self.process.is_alive():
            self.process.terminate()

    def end(self) -> None:
        """End it, with what it has started, if it can."""
        self.ask()
        self.process.join(GRACE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.pipe.close()


def _ready(busy: list[_Worker]) -> list[_Worker]:
    """Workers that have answered, died or taken too long."""
    until = min(worker.deadline for worker in busy) - time.monotonic()
    ends: list[Connection | int] = []
    for worker in busy:
        ends += [worker.pipe, worker.process.sentinel]
    found = set(wait(ends, None if until == float("inf") else max(until, 0.0)))
    now = time.monotonic()
    return [
        worker
        for worker in busy
        if worker.pipe in found or worker.process.sentinel in found or now >= worker.deadline
    ]


def _death(code: int | None) -> str:
    return f"signal {-code}" if code is not None and code < 0 else f"status {code}"
