"""Tasks on many machines, through Dask."""

import threading
import uuid
from collections.abc import Callable, Generator, Mapping
from typing import Any

from typing_extensions import override

from ..errors import ParameterError, TaskError
from .attempt import Attempt, limited
from .base import AbstractExecutor, Outcome


class Dask(AbstractExecutor):
    """Runs tasks on the workers of a Dask cluster; needs `pip install "moldline[cluster]"`.

    A task whose worker dies is begun again on another, as often as the scheduler allows. One that
    takes longer than its limit is told to stop, and left alone if it does not.

    Attributes
    ----------
    client
        The connection to the scheduler.
    """

    def __init__(self, scheduler: Any):
        """`scheduler` is its address, such as "tcp://node1:8786", or a client of Dask's."""
        try:
            from distributed import Client
        except ImportError:
            raise ParameterError(
                'a cluster needs Dask, which is not installed: pip install "moldline[cluster]"'
            ) from None
        self._is_own = isinstance(scheduler, str)
        if not self._is_own:
            self.client = scheduler
            return
        try:
            self.client = Client(scheduler, set_as_default=False, timeout=5)
        except (OSError, ValueError) as error:
            raise ParameterError(f"no Dask scheduler answers at {scheduler}: {error}") from None

    @property
    @override
    def count(self) -> int:
        return max(1, sum(self.client.nthreads().values()))

    @override
    def run(
        self,
        function: Callable[[Any], Any],
        tasks: Mapping[str, Any],
        limit: float | None = None,
    ) -> Generator[Outcome, None, None]:
        from distributed import as_completed

        own = uuid.uuid4().hex
        futures = {
            self.client.submit(_called, function, argument, limit, key=f"moldline-{own}-{k}"): (
                k,
                name,
            )
            for k, (name, argument) in enumerate(tasks.items())
        }
        waiting = set(futures)
        try:
            for future in as_completed(list(futures), loop=self.client.loop):
                attempt = _fetched(future)
                waiting.discard(future)
                yield Outcome(*futures[future], attempt.value, attempt.error, attempt.seconds)
        finally:
            if waiting:
                self.client.cancel(list(waiting), force=True)

    @override
    def close(self) -> None:
        if self._is_own:
            self.client.close()


def _called(function: Callable[[Any], Any], argument: Any, limit: float | None) -> Attempt:
    """On a worker: errors are results, so that the scheduler tries again for its own only."""
    return limited(function, argument, limit, threading.Event())


def _fetched(future: Any) -> Attempt:
    try:
        attempt: Attempt = future.result()
        return attempt
    except Exception as error:  # KilledWorker, CancelledError, lost connections
        told = f"the cluster gave it up: {type(error).__name__}: {error}"
        return Attempt(None, TaskError(told), 0.0)
