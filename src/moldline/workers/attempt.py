"""One call of a task's function, with a time limit and a wish to stop that it can look at."""

import threading
import time
from collections.abc import Callable
from contextvars import ContextVar
from typing import Any, NamedTuple

from ..errors import TaskError

GRACE = 2.0
"""A function that looks whether it is cancelled has this long to end [s]."""

_wish: ContextVar[threading.Event | None] = ContextVar("moldline_wish_to_stop", default=None)


class Attempt(NamedTuple):
    """What a call came to: a value or an error, and how long it took [s]."""

    value: Any
    error: Exception | None
    seconds: float


def is_cancelled() -> bool:
    """Whether the task that runs here should stop; what waits for something asks now and then."""
    wish = _wish.get()
    return wish is not None and wish.is_set()


def attempted(
    function: Callable[[Any], Any], argument: Any, wish: threading.Event | None = None
) -> Attempt:
    """Call it here; whatever it raises is an outcome."""
    token = _wish.set(wish)
    start = time.perf_counter()
    try:
        value, error = function(argument), None
    except Exception as problem:
        value, error = None, problem
    finally:
        _wish.reset(token)
    return Attempt(value, error, time.perf_counter() - start)


def limited(
    function: Callable[[Any], Any],
    argument: Any,
    limit: float | None,
    wish: threading.Event | None = None,
) -> Attempt:
    """The same for at most `limit` seconds: one that does not end even when asked is left alone."""
    wish = wish or threading.Event()
    if limit is None:
        return attempted(function, argument, wish)
    found: list[Attempt] = []
    thread = threading.Thread(
        target=lambda: found.append(attempted(function, argument, wish)), daemon=True
    )
    thread.start()
    thread.join(limit)
    if thread.is_alive():
        wish.set()
        thread.join(GRACE)
        return Attempt(None, overran(limit), limit)
    return found[0]


def overran(limit: float) -> TaskError:
    """What is said of a task that took too long."""
    return TaskError(f"it took longer than its limit of {limit:g} s and was stopped; give it more")
