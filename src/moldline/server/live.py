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
    values
        The variables that a pull has changed, by name; None of what was pushed.
    miss
        Of a pull: the largest `distance` from where the hand wants its points [m], and the labels
        of the numbers that are held `at_bounds`.
    measures, beyond
        Numbers of the case's measures, and by how much they are beyond their bounds where they
        are; None where they were not asked for.
    """

    points: np.ndarray
    connectivity: str | None
    is_made_anew: bool
    faces: np.ndarray | None
    tags: np.ndarray | None
    components: list[str] | None
    values: dict[str, np.ndarray] | None = None
    miss: dict[str, Any] | None = None
    measures: dict[str, np.ndarray] | None = None
    beyond: dict[str, np.ndarray] | None = None


class Live:
    """Points that follow values as they change, as fast as they can be had; the latest wins.

    Two requests are under way at most; what is pushed meanwhile waits, and the latest takes its
    place.
    """

    AHEAD = 2

    def __init__(self, case: "RemoteCase", of: str, dtype: str, measures: bool = False):
        self._case = case
        self._ask: dict[str, Any] = {"of": of, "dtype": dtype, "latest": True}
        self._ask |= {"measures": True} if measures else {}
        own = Shape(case.points_at_rest, case.connectivity, False, *case.joining)
        self._seen: dict[str | None, Shape] = {case.connectivity: own}
        self._shown = case.connectivity if not of else ""
        self._under_way: list[int] = []
        self._waiting: tuple[str, dict[str, np.ndarray], dict[str, Any]] | None = None

    @property
    def is_busy(self) -> bool:
        """Whether an answer is still to come."""
        return bool(self._under_way) or self._waiting is not None

    def push(self, values: Values) -> None:
        """These values count from now on; this does not wait."""
        self._waiting = "points", {}, {"values": listed(values)}
        self._advance()

    def pull(
        self,
        stage: int,
        moved: np.ndarray,
        values: Values | None = None,
        touched: np.ndarray | None = None,
    ) -> None:
        """A hand holds the points of a stage there from now on; see `RemoteCase.follow`."""
        self._waiting = "follow", held(moved, touched), {"values": listed(values), "stage": stage}
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
            (op, arrays, fields), self._waiting = self._waiting, None
            ask = {**self._ask, **fields, "connectivity": self._shown or ""}
            self._under_way.append(self._case.send(op, arrays, **ask))

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
        return shape._replace(faces=known.faces, tags=known.tags, components=known.components)


def shape_of(told: Message) -> Shape:
    """What an answer to `points` or `follow` says."""
    fields, arrays = told
    beyond = fields.get("beyond")
    return Shape(
        arrays["points"],
        fields.get("connectivity"),
        bool(fields.get("made_anew")),
        arrays.get("faces"),
        arrays.get("tags"),
        fields.get("components"),
        None if "miss" not in fields else _named(arrays, "values."),
        fields.get("miss"),
        None if beyond is None else _named(arrays, "measures."),
        None if beyond is None else {name: np.asarray(one) for name, one in beyond.items()},
    )


def _named(arrays: Mapping[str, np.ndarray], begin: str) -> dict[str, np.ndarray]:
    """Those arrays whose names begin so, by the rest of their names."""
    return {k.removeprefix(begin): one for k, one in arrays.items() if k.startswith(begin)}


def held(moved: np.ndarray, touched: np.ndarray | None) -> dict[str, np.ndarray]:
    """Arrays of a request to follow a hand."""
    given = {"moved": np.asarray(moved, float)}
    return given if touched is None else {**given, "touched": np.asarray(touched, bool)}


def plain(given: Any) -> Any:
    """What a header can hold: arrays are lists, and so are tuples."""
    if isinstance(given, Mapping):
        return {str(name): plain(one) for name, one in given.items()}
    if isinstance(given, list | tuple):
        return [plain(one) for one in given]
    return given.tolist() if isinstance(given, np.ndarray | np.generic) else given


def listed(values: Values | None) -> dict[str, Any]:
    """Values as a header holds them."""
    return {name: np.asarray(value, float).tolist() for name, value in (values or {}).items()}
