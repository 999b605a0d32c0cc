"""A case on a server, as if it were here. Standard library and NumPy only."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .live import Live, Shape, Values, held, listed, shape_of
from .protocol import Message, ServerError

if TYPE_CHECKING:
    from .client import Client


class Net(NamedTuple):
    """Control points before and after, and pairs of them that lines join."""

    lines: np.ndarray
    rest: np.ndarray
    moved: np.ndarray
    is_hidden: bool


class Handle(NamedTuple):
    """What a hand can move in a stage.

    Attributes
    ----------
    stage
        Its number among the stages of the case file, from 0.
    name, deformer, on
        Of the stage, and the geometry that it acts on.
    kind
        "net", control points; "bones"; or "marks", places that pilots hold.
    lines
        Pairs of points that lines join, (l, 2).
    rest, moved
        Places before and at the values, (p, 3); of bones head, tail and a point beside, (b, 3, 3).
    frozen
        Which points, or bones, never move.
    labels
        A name for each: bones' and pilots' own, indices of control points as links take them,
        such as "0,2,1".
    """

    stage: int
    name: str
    deformer: str
    on: str
    kind: str
    lines: np.ndarray
    rest: np.ndarray
    moved: np.ndarray
    frozen: np.ndarray
    labels: list[str]


class RemoteCase:
    """A case that is open on a server.

    `of` in its methods names what they are about: the result where it is not given, another
    geometry, a rider, or points that were embedded.

    Attributes
    ----------
    description
        What does not change with the values: path, result, units, geometries, riders, variables,
        measures, overview.
    points_at_rest, faces, tags, components, connectivity
        The result at the variables' own values, before the stages on it.
    """

    def __init__(self, client: "Client", opening: Mapping[str, str], timeout: float | None = None):
        self._client = client
        self._opening = dict(opening)
        self._timeout = timeout
        self._handle = ""
        self._generation = 0
        self._embedded: dict[str, tuple[np.ndarray, str]] = {}
        told = self._open()
        self.description: dict[str, Any] = told.header
        self.points_at_rest = told.arrays["points"]
        self.faces = told.arrays.get("faces")
        self.tags = told.arrays.get("tags")
        self.components: list[str] = told.header.get("components", [])
        self.connectivity: str | None = told.header.get("connectivity")

    @property
    def joining(self) -> tuple[np.ndarray | None, np.ndarray | None, list[str]]:
        """Faces, tags and components."""
        return self.faces, self.tags, self.components

    @property
    def variables(self) -> dict[str, dict[str, Any]]:
        """Size, value, lower, upper, typical, unit and labels of each variable."""
        return dict(self.description["variables"])

    def values(self, values: Values | None = None) -> dict[str, np.ndarray]:
        """The full set of values, checked; what is out of bounds is refused."""
        return self.request("values", values=listed(values)).arrays

    def points(
        self, values: Values | None = None, of: str = "", rest: bool = False, dtype: str = "<f8"
    ) -> np.ndarray:
        """Points for some values, (n, 3); with `rest`, before the stages on them.

        `dtype` "<f4" has them sent in single precision.
        """
        ask: dict[str, Any] = {"values": listed(values), "of": of, "rest": rest, "dtype": dtype}
        return self.request("points", **ask).arrays["points"]

    def shape(
        self,
        values: Values | None = None,
        of: str = "",
        connectivity: str | None = None,
        dtype: str = "<f8",
    ) -> Shape:
        """Points, with the triangles where they are not those whose name is given.

        Without a name, those of the case as it was opened are known.
        """
        known = connectivity or (self.connectivity if not of else "") or ""
        ask: dict[str, Any] = {
            "values": listed(values),
            "of": of,
            "dtype": dtype,
            "connectivity": known,
        }
        return shape_of(self.request("points", **ask))

    def geometry(self, of: str = "") -> Message:
        """A geometry at the variables' own values: its points, what joins them, its kind."""
        return self.request("geometry", of=of)

    def pushforward(self, values: Values | None, directions: Values, of: str = "") -> np.ndarray:
        """Motion of the points along a change of the values, (n, 3)."""
        ask: dict[str, Any] = {"values": listed(values), "directions": listed(directions), "of": of}
        return self.request("pushforward", **ask).arrays["motion"]

    def pullback(
        self, values: Values | None, cotangent: np.ndarray, of: str = ""
    ) -> dict[str, np.ndarray]:
        """Gradient of a scalar by the values, from its derivative by the points, (n, 3)."""
        arrays = {"cotangent": np.asarray(cotangent, float)}
        return self.request("pullback", arrays, values=listed(values), of=of).arrays

    def sensitivity(
        self, values: Values | None, name: str, of: str = "", dtype: str = "<f8"
    ) -> np.ndarray:
        """Derivative of every point by every number of one variable, (n, 3, v)."""
        ask: dict[str, Any] = {"values": listed(values), "variable": name, "of": of, "dtype": dtype}
        return self.request("sensitivity", **ask).arrays["sensitivity"]

    def measures(self, values: Values | None = None) -> dict[str, np.ndarray]:
        """The numbers of each measure of the case."""
        return self.request("measures", values=listed(values)).arrays

    def beyond(self, values: Values | None = None) -> dict[str, np.ndarray]:
        """By how much measures are beyond their bounds, for those that are."""
        told = self.request("measures", values=listed(values)).header["beyond"]
        return {name: np.asarray(miss) for name, miss in told.items()}

    def jacobian(self, values: Values | None = None) -> dict[str, dict[str, np.ndarray]]:
        """Derivative of each measure's numbers by each variable's, (k, v)."""
        found = self.request("measures", values=listed(values), derivatives=True).arrays
        slopes: dict[str, dict[str, np.ndarray]] = {}
        for name, rows in found.items():
            measure, _, variable = name.rpartition("/")
            if measure:
                slopes.setdefault(measure, {})[variable] = rows
        return slopes

    def nets(self, values: Values | None = None, of: str = "") -> list[Net]:
        """Control points before and after, for display."""
        told = self.request("nets", values=listed(values), of=of)
        found = told.arrays
        return [
            Net(found[f"lines.{i}"], found[f"rest.{i}"], found[f"moved.{i}"], is_hidden)
            for i, is_hidden in enumerate(told.header["hidden"])
        ]

    def handles(self, values: Values | None = None) -> list[Handle]:
        """What a hand can move, by stage: those on the result and on what it is made from."""
        told = self.request("handles", values=listed(values))
        own = ("lines", "rest", "moved", "frozen")
        return [
            Handle(**{**one, **{name: told.arrays[f"{name}.{i}"] for name in own}})
            for i, one in enumerate(told.header["handles"])
        ]

    def follow(
        self,
        stage: int,
        moved: np.ndarray,
        values: Values | None = None,
        of: str = "",
        dtype: str = "<f8",
        touched: np.ndarray | None = None,
        connectivity: str | None = None,
    ) -> Shape:
        """Values for which a handle's points come closest to where a hand wants them, and points.

        The stage's own numbers change from `values` by the least, within their bounds: where it
        has links `each`, `named` or `controls` those alone. What the hand moved comes first,
        `touched` says which points, or bones, that is; without it, those that are not where
        `values` put them. The others then stay as far as they can.
        """
        known = connectivity or (self.connectivity if not of else "") or ""
        ask: dict[str, Any] = {"values": listed(values), "of": of, "dtype": dtype, "stage": stage}
        return shape_of(self.request("follow", held(moved, touched), connectivity=known, **ask))

    def colour(
        self,
        values: Values | None,
        variable: str,
        number: int = 0,
        of: str = "",
        how: str = "normal",
    ) -> np.ndarray:
        """How far each point moves for a unit of one number of a variable, (n,).

        `how` "normal" is along the outward normal, below zero where it moves inward; "size" is the
        length of the motion, as always of what is no surface of triangles.
        """
        ask: dict[str, Any] = {"variable": variable, "number": number, "of": of, "how": how}
        return self.request("colour", values=listed(values), **ask).arrays["colour"]

    def embed(self, points: np.ndarray, name: str, on: str = "") -> str:
        """Tie the deformation to other points, (n, 3); the name then serves as `of`."""
        own = np.array(points, float)
        self.request("embed", {"points": own}, name=name, on=on)
        self._embedded[name] = own, on
        return name

    def check(self, values: Values | None = None, of: str = "", deep: bool = False) -> dict:
        """Whether the shape is sound; with `deep`, also space and derivatives.

        `bad_faces` holds numbers of the faces that are not.
        """
        told = self.request("check", values=listed(values), of=of, deep=deep)
        return {**told.header, **told.arrays}

    def save(self, path: str | PathLike[str], values: Values | None = None) -> None:
        """Write the case file with new values."""
        self.request("save", path=str(Path(path).absolute()), values=listed(values))

    def live(self, of: str = "", dtype: str = "<f8", measures: bool = False) -> "Live":
        """For a drag: values are given as they come, and only the latest count.

        With `measures` each shape also has those of the case.
        """
        return Live(self, of, dtype, measures)

    def close(self) -> None:
        """Close the case."""
        if self._generation == self._client.generation:
            self._client.request("close", case=self._handle)
        self._generation = 0

    def request(
        self, op: str, arrays: Mapping[str, np.ndarray] | None = None, **fields: Any
    ) -> Message:
        """Ask something of the case; asked again where the server went away and came back."""
        try:
            return self._client.request(op, arrays, self._timeout, case=self.handle(), **fields)
        except ServerError as error:
            name = fields.get("of")
            if error.code == "unknown name" and name in self._embedded:
                own, on = self._embedded[name]  # its process was started anew
                self._client.request("embed", {"points": own}, name=name, on=on, case=self._handle)
            elif error.code != "disconnected":
                raise
        return self._client.request(op, arrays, self._timeout, case=self.handle(), **fields)

    def handle(self) -> str:
        """What the server calls it; opened again where the connection was lost."""
        self._client.ensure()
        if self._generation != self._client.generation:
            self._open()
        return self._handle

    def send(self, op: str, arrays: Mapping[str, np.ndarray] | None = None, **fields: Any) -> int:
        """Ask without waiting."""
        return self._client.send(op, arrays, case=self.handle(), **fields)

    def taken(self, number: int) -> Message | None:
        """The answer if it is there."""
        return self._client.taken(number)

    def sleep(self, seconds: float) -> None:
        """Wait for news, at most so long."""
        self._client.sleep(seconds)

    def _open(self) -> Message:
        told = self._client.request("open", None, self._timeout, **self._opening)
        self._handle, self._generation = told.header["case"], self._client.generation
        self._client.expect(told.arrays["points"].nbytes)
        return told
