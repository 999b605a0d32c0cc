"""What every executor is: it takes a function and named tasks, and gives what comes of them."""

import abc
import contextlib
import os
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import TaskError


@dataclass(frozen=True)
class Outcome:
    """What came of one task.

    Attributes
    ----------
    number, name
        Which task it was.
    value
        What the function returned; None where it failed.
    error
        Why it failed; None where it did not.
    seconds
        How long the last attempt took [s].
    attempts
        How often it was begun: more than once where its worker died.
    """

    number: int
    name: str
    value: Any = None
    error: Exception | None = None
    seconds: float = 0.0
    attempts: int = 1

    def result(self) -> Any:
        """The value, or an error that names the task."""
        if self.error is not None:
            raise TaskError(f"{self.name}: {self.error}") from self.error
        return self.value


class AbstractExecutor(abc.ABC):
    """Runs a function on independent tasks, somewhere.

    The function and what it is given may travel to another process: both must be picklable, the
    function one of a module.
    """

    @property
    @abc.abstractmethod
    def count(self) -> int:
        """How many tasks run at a time."""

    @abc.abstractmethod
    def run(
        self,
        function: Callable[[Any], Any],
        tasks: Mapping[str, Any],
        limit: float | None = None,
    ) -> Generator[Outcome, None, None]:
        """What comes of each task, as it ends; a failure of one stops no other.

        `tasks` are what the function is called with, by name; `limit` is the time of each [s].
        Whoever closes the iterator before its end cancels the rest. Watching for limits and deaths
        goes on only while the next outcome is being waited for.
        """

    @abc.abstractmethod
    def close(self) -> None:
        """Let workers go that wait for more; the next run starts new ones."""

    def all(
        self,
        function: Callable[[Any], Any],
        tasks: Mapping[str, Any],
        limit: float | None = None,
    ) -> list[Any]:
        """The values in the order of the tasks; the first failure is raised and ends the rest."""
        values: dict[int, Any] = {}
        with contextlib.closing(self.run(function, tasks, limit)) as outcomes:
            for outcome in outcomes:
                values[outcome.number] = outcome.result()
        return [values[number] for number in range(len(tasks))]


def cores() -> int:
    """Processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
