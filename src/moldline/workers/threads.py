"""Tasks in threads of this process, for what waits more than it computes."""

import queue
import threading
import time
from collections.abc import Callable, Generator, Mapping
from typing import Any

from typing_extensions import override

from ..errors import ParameterError
from .attempt import GRACE, limited
from .base import AbstractExecutor, Outcome, cores


class Threads(AbstractExecutor):
    """Runs tasks that start programs: the work is in those processes, nothing else is copied.

    A cancelled task ends when it next asks `is_cancelled`, as all that runs programs does; that is
    waited for, but not long.
    """

    def __init__(self, count: int | None = None):
        if count is not None and count < 1:
            raise ParameterError(f"an executor needs 1 worker or more, got {count}")
        self._count = count or cores()

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
        waiting: queue.SimpleQueue[tuple[int, str, Any]] = queue.SimpleQueue()
        done: queue.SimpleQueue[Outcome] = queue.SimpleQueue()
        stop = threading.Event()
        for number, (name, argument) in enumerate(tasks.items()):
            waiting.put((number, name, argument))

        def work() -> None:
            while not stop.is_set():
                try:
                    number, name, argument = waiting.get_nowait()
                except queue.Empty:
                    return
                # with a limit, a wish to stop of its own: one that overruns must not end the others
                wish = stop if limit is None else _Either(stop)
                attempt = limited(function, argument, limit, wish)
                done.put(Outcome(number, name, attempt.value, attempt.error, attempt.seconds))

        threads = [
            threading.Thread(target=work, daemon=True) for _ in range(min(self.count, len(tasks)))
        ]
        for thread in threads:
            thread.start()
        try:
            for _ in range(len(tasks)):
                yield done.get()
        finally:
            stop.set()
            until = time.monotonic() + GRACE  # programs that still run would outlive this process
            for thread in threads:
                thread.join(max(0.0, until - time.monotonic()))

    @override
    def close(self) -> None:
        pass


class _Either(threading.Event):
    """Set by itself or by another."""

    def __init__(self, other: threading.Event):
        threading.Event.__init__(self)
        self._other = other

    @override
    def is_set(self) -> bool:
        return threading.Event.is_set(self) or self._other.is_set()
