"""Points that follow a drag. Standard library and NumPy only."""

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .protocol import Message, ServerError

if TYPE_CHECKING:
    from .remote import RemoteCase

Values = Mapping[str, Any]
"""Numbers by variable; one that is not named keeps the case's own."""


class Shape(NamedTuple):
    """Points, and what joins them where that is not what it was.

    Attributes
    ----------
    points
        Shape (n, 3).
    connectivity
        A short name of the triangles; None for what has none.
    is_made_anew
        Whether a union had to be made anew for the values, with other triangles than the case's.
    faces, tags, components
        The triangles, the component of each and their names; None where they are known by name.
    """

    points: np.ndarray
    connectivity: str | None
    is_made_anew: bool
    faces: np.ndarray | None
    tags: np.ndarray | None
    components: list[str] | None


class Live:
    """Points that follow values as they change, as fast as they can be had; the latest wins.

    Two requests are under way at most; what is pushed meanwhile waits, and the latest takes its
    place.
    """

    AHEAD = 2

    def __init__(self, case: "RemoteCase", of: str, dtype: str):
        self._case = case
        self._ask: dict[str, Any] = {"of": of, "dtype": dtype, "latest": True}
        own = Shape(case.points_at_rest, case.connectivity, False, *case.joining)
        self._seen: dict[str | None, Shape] = {case.connectivity: own}
        self._shown = case.connectivity if not of else ""
        self._under_way: list[int] = []
        self._waiting: Values | None = None

    @property
    def is_busy(self) -> bool:
        """Whether an answer is still to come."""
        return bool(self._under_way) or self._waiting is not None

    def push(self, values: Values) -> None:
        """These values count from now on; this does not wait."""
        self._waiting = dict(values)
        self._advance()

    def poll(self, seconds: float = 0.0) -> Shape | None:
        """The latest shape that has come since the last time, if any; waits at most so long."""
        deadline = time.monotonic() + seconds
        while True:
            found = self._shown_next(self._collected())
            self._advance()
            left = deadline - time.monotonic()
            if found is not None or left <= 0 or not self.is_busy:
                return found
            self._case.sleep(left)

    def finish(self, seconds: float = 60.0) -> Shape:
        """The shape of the values that were pushed last."""
        deadline = time.monotonic() + seconds
        found: Shape | None = None
        while self.is_busy:
            left = deadline - time.monotonic()
            if left <= 0:
                raise ServerError("timeout", f"no answer within {seconds:g} s")
            newer = self.poll(left)
            if newer is not None and newer.faces is None and found is not None:
                newer = newer._replace(
                    faces=found.faces, tags=found.tags, components=found.components
                )
            found = newer or found
        if found is None:
            raise ServerError("outdated", "nothing was pushed since the last shape")
        return found

    def _advance(self) -> None:
        if self._waiting is not None and len(self._under_way) < self.AHEAD:
            values, self._waiting = self._waiting, None
            ask = {**self._ask, "connectivity": self._shown or ""}
            self._under_way.append(self._case.send("points", values=listed(values), **ask))

    def _collected(self) -> Shape | None:
        latest: Shape | None = None
        for number in list(self._under_way):
            try:
                told = self._case.taken(number)
            except ServerError as error:
                self._under_way.remove(number)
                if error.code == "disconnected":
                    self._under_way.clear()
                if error.code != "outdated":
                    raise
                continue
            if told is not None:
                self._under_way.remove(number)
                latest = shape_of(told)
                if latest.faces is not None:
                    self._seen = {
                        **dict(list(self._seen.items())[-7:]),
                        latest.connectivity: latest,
                    }
        return latest

    def _shown_next(self, shape: Shape | None) -> Shape | None:
        """A shape with its triangles, if those of the one before it were others."""
        if shape is None or shape.connectivity in (None, self._shown):
            return shape and shape._replace(faces=None, tags=None, components=None)
        self._shown = shape.connectivity
        known = self._seen.get(shape.connectivity, shape)
        return known._replace(points=shape.points, is_made_anew=shape.is_made_anew)


def shape_of(told: Message) -> Shape:
    """What an answer to `points` says."""
    fields, arrays = told
    return Shape(
        arrays["points"],
        fields.get("connectivity"),
        bool(fields.get("made_anew")),
        arrays.get("faces"),
        arrays.get("tags"),
        fields.get("components"),
    )


def listed(values: Values | None) -> dict[str, Any]:
    """Values as a header holds them."""
    return {name: np.asarray(value, float).tolist() for name, value in (values or {}).items()}
