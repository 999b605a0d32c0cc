"""Compiled loops spread over the processor's cores."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numpy as np


def cores() -> int:
    """Threads to use: `MOLDLINE_THREADS` where it is set, else the cores this process may use."""
    chosen = os.environ.get("MOLDLINE_THREADS", "")
    if chosen.isdigit() and int(chosen) > 0:
        return int(chosen)
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@lru_cache(maxsize=1)
def _pool(process: int, workers: int) -> ThreadPoolExecutor:
    """One pool per process: threads do not survive a fork."""
    return ThreadPoolExecutor(workers, thread_name_prefix="moldline")


def spread(loop: Callable[..., Any], length: int, *arguments: Any, least: int = 1) -> list[Any]:
    """Call `loop(*arguments, part, start, stop)` on even parts of 0 .. length, in threads.

    The loop must release Python's lock (numba's `nogil`). `least` is the smallest part worth a
    thread. Returns what the calls return, in order.
    """
    workers = max(1, min(cores(), length // max(least, 1)))
    bounds = np.linspace(0, length, workers + 1).astype(int)
    parts = [(i, int(bounds[i]), int(bounds[i + 1])) for i in range(workers)]
    if workers == 1:
        return [loop(*arguments, *parts[0])]
    pool = _pool(os.getpid(), cores())
    waiting = [pool.submit(loop, *arguments, *part) for part in parts[1:]]
    return [loop(*arguments, *parts[0]), *(job.result() for job in waiting)]
