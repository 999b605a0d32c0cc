"""A case that a worker holds, with what clients have tied to it."""

import hashlib
import json
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..case import Case, load
from ..case.case import of_text
from ..mesh import Geometry
from ..pipeline.pipeline import Pipeline
from .hands import Hand, hands
from .protocol import Message, ServerError


class Held:
    """A loaded case, its pipelines by name, and points that clients have embedded.

    Attributes
    ----------
    case
        As it was read.
    embedded
        Pipelines of points that a client gave, by its handle and their name.
    """

    def __init__(self, case: Case):
        self.case = case
        self.embedded: dict[tuple[str, str], Pipeline] = {}
        self._pipelines: dict[str, Pipeline] = {"": case.pipeline, **case.riders}
        self._connectivity: dict[str, tuple[Any, str]] = {}

    @cached_property
    def hands(self) -> dict[int, Hand]:
        """What a hand can move, by the number of the stage."""
        return hands(self.case)

    def hand(self, ask: Message) -> Hand:
        """What a hand moves in the stage that a request names."""
        number = ask.header.get("stage")
        if type(number) is not int or number not in self.hands:
            told = f"stage {number!r:.20}" if number is not None else "no stage"
            there = ", ".join(map(str, self.hands)) or "none"
            raise ServerError(
                "unknown name", f"{told} has nothing that a hand can move; stages that do: {there}"
            )
        return self.hands[number]

    def values(self, ask: Message) -> dict[str, Any]:
        """The values that a request names, all others the case's own; checked, within bounds."""
        return self.case.values(numbers(ask.header.get("values") or {}, "values"))

    def pipeline(self, ask: Message) -> Pipeline:
        """The pipeline of what a request is about: the result where it does not say."""
        name = text(ask, "of", "")
        mine = (text(ask, "case", ""), name)
        if mine in self.embedded:
            return self.embedded[mine]
        if name not in self._pipelines:
            known = self.case.pipeline
            if name not in known.branches:
                there = ", ".join([*known.branches, *self.case.riders])
                raise ServerError(
                    "unknown name", f"nothing is called {name!r:.60}; there is: {there}"
                )
            self._pipelines[name] = known.of(name)  # kept, since it knows what it made anew
        return self._pipelines[name]

    def is_free(self, name: str) -> bool:
        """Whether points may be embedded under a name."""
        return name not in self._pipelines and name not in self.case.pipeline.branches

    def forget(self, handle: str) -> None:
        """Drop what a client has embedded."""
        self.embedded = {k: v for k, v in self.embedded.items() if k[0] != handle}

    def connectivity(self, ask: Message, geometry: Geometry) -> str | None:
        """A short name of a geometry's triangles: other ones, another name. None without."""
        faces = getattr(geometry, "faces", None)
        if faces is None:
            return None
        name = text(ask, "of", "")
        seen = self._connectivity.get(name)
        if seen is None or seen[0] is not faces:
            digest = hashlib.blake2b(np.ascontiguousarray(faces).tobytes(), digest_size=8)
            seen = self._connectivity[name] = faces, digest.hexdigest()
        return seen[1]


def opened(header: Mapping[str, Any]) -> Held:
    """The case that a request names: by its path, or as text with the folder of its files."""
    if "path" in header:
        return Held(load(header["path"]))
    return Held(of_text(header["text"], Path(header["folder"])))


def text(ask: Message, name: str, otherwise: str | None = None) -> str:
    """A text of a request's header."""
    found = ask.header.get(name, otherwise)
    if not isinstance(found, str):
        raise ServerError("malformed", f"{name!r} is a text, got {json.dumps(found):.60}")
    return found


def numbers(given: Any, where: str) -> dict[str, np.ndarray]:
    """Numbers by variable, from a header."""
    if not isinstance(given, dict):
        raise ServerError("malformed", f"{where!r} holds numbers by variable, got {given!r:.60}")
    found = {}
    for name, value in given.items():
        try:
            found[name] = np.asarray(value, float)
        except (TypeError, ValueError):
            raise ServerError(
                "parameter", f"variable {name!r:.60}: expected numbers, got {value!r:.60}"
            ) from None
    return found


def array(ask: Message, name: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """An array that came with a request, finite and of the right shape; None is any number."""
    if name not in ask.arrays:
        raise ServerError("malformed", f"this needs an array {name!r}; none came with the request")
    found = np.asarray(ask.arrays[name], float)
    fits = found.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, found.shape, strict=True)
    )
    if not fits:
        told = ", ".join("any" if n is None else str(n) for n in shape)
        raise ServerError("parameter", f"{name!r} must have the shape ({told}), got {found.shape}")
    if not np.isfinite(found).all():
        bad = np.argwhere(~np.isfinite(found))[0].tolist()
        raise ServerError("parameter", f"{name!r} must be finite, at {bad} it is not")
    return found
