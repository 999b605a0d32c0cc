"""Tasks one after the other, here."""

from collections.abc import Callable, Generator, Mapping
from typing import Any

from typing_extensions import override

from .attempt import limited
from .base import AbstractExecutor, Outcome


class Serial(AbstractExecutor):
    """Runs tasks in this process, one by one: to look for a mistake, or where one is enough."""

    @property
    @override
    def count(self) -> int:
        return 1

    @override
    def run(
        self,
        function: Callable[[Any], Any],
        tasks: Mapping[str, Any],
        limit: float | None = None,
    ) -> Generator[Outcome, None, None]:
        for number, (name, argument) in enumerate(tasks.items()):
            attempt = limited(function, argument, limit)
            yield Outcome(number, name, attempt.value, attempt.error, attempt.seconds)

    @override
    def close(self) -> None:
        pass
