"""A client's shared memory: places that requests on their way use. Standard library and NumPy."""

from .protocol import Buffer, ServerError, padded
from .shared import Place, SharedMemory, attach, seen

COUNT = 3
"""Places: one that is being computed into, one that waits, one that is being read."""

SMALLEST = 2**16
LARGEST = 2**26
"""Bytes of a place; what is smaller or larger is sent."""


class Places:
    """Equal parts of one segment, each for one request and its answer.

    Attributes
    ----------
    size
        Bytes of each; 0 before there are any.
    wanted
        Bytes that would have served so far.
    """

    def __init__(self) -> None:
        self.size = 0
        self.wanted = 0
        self._memory: SharedMemory | None = None
        self._free: list[Place] = []

    @property
    def should_grow(self) -> bool:
        """Whether larger ones would serve, and none is in use."""
        is_free = self._memory is None or len(self._free) == COUNT
        return self.wanted > self.size and is_free

    @property
    def segment(self) -> str | None:
        """The name of the segment."""
        return None if self._memory is None else self._memory.name

    def need(self, count: int) -> None:
        """Something of so many bytes travels."""
        if SMALLEST <= count <= LARGEST:
            self.wanted = max(self.wanted, padded(count + count // 8))

    def set(self, name: str, size: int) -> None:
        """Use a segment that the server has made, of `COUNT` places."""
        self.close()
        memory = attach(name)
        self._memory, self.size = memory, size
        self._free = [Place(memory, i * size, size) for i in range(COUNT)]

    def take(self) -> Place | None:
        """A place, if one is free."""
        return self._free.pop() if self._free else None

    def give(self, place: Place) -> None:
        """A place is no longer used."""
        if place.memory is self._memory:
            self._free.append(place)

    def fetch(self, name: str, offset: int, length: int) -> Buffer:
        """Bytes that an answer says are here."""
        if self._memory is None or name != self._memory.name:
            raise ServerError("malformed", f"an answer lies in {name!r:.40}, which is not ours")
        return seen(self._memory)[offset : offset + length]

    def close(self) -> None:
        """Look into it no more; the server removes it."""
        if self._memory is not None:
            memory, self._memory = self._memory, None
            self._free, self.size = [], 0
            memory.close()
