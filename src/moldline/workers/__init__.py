"""SHARE OUT: independent tasks to processes, or to other machines."""

from .base import AbstractExecutor, Outcome
from .cluster import Dask
from .processes import Processes
from .serial import Serial
from .threads import Threads

__all__ = ["AbstractExecutor", "Dask", "Outcome", "Processes", "Serial", "Threads"]
