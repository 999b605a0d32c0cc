"""Functionals of the flow: the lines of an AeroFun."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import FileError
from ..mesh.io.text import quoted
from .document import Document
from .element import Element

_TARGET = {"target": float, "weight": float, "bound": int}
FIELDS: Mapping[str, Mapping[str, type]] = {
    "optForce": {"force": int, "frame": int, "J": int, "N": int, **_TARGET},
    "optMoment_Point": {"index": int, "moment": int, "frame": int, "J": int, "N": int, **_TARGET},
    "optLD": {"frame": int, "J": int, "N": int, "A": float, "bias": float, **_TARGET},
}
"""Numbers of each kind of functional, after its name and before its components."""

_INTEGER = re.compile(r"[+-]?[0-9]{1,9}")
_REAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,2})?")


@dataclass(frozen=True)
class Functional:
    """A line of an AeroFun.

    Attributes
    ----------
    kind, name
        Such as optForce, and what the functional is called.
    numbers
        By name, as `FIELDS` lists them.
    components
        Of which it is taken; `entire` is all.
    line
        Of the document.
    """

    kind: str
    name: str
    numbers: Mapping[str, float]
    components: tuple[str, ...]
    line: int


def functionals(document: Document, element: Element) -> list[Functional]:
    """The lines of an AeroFun, without comments; of an unknown kind, its name alone is kept."""
    found = []
    for line, text in element.lines():
        words = text.split("#")[0].split()
        if words:
            found.append(_functional(f"{document.path}: line {line}: {element.tag}", line, words))
    return found


def _functional(place: str, line: int, words: list[str]) -> Functional:
    kind, name, *rest = [*words, ""] if len(words) == 1 else words
    fields = FIELDS.get(kind)
    if fields is None:
        return Functional(kind, name, {}, (), line)
    if len(rest) <= len(fields):
        names = " ".join(("name", *fields, "components"))
        raise FileError(
            f"{place}: {quoted(kind)[1:-1]} has {len(words) - 1} words after it, expected at least "
            f"{len(fields) + 2}: {names}"
        )
    numbers = {}
    for word, (field, kind_of) in zip(rest, fields.items(), strict=False):
        if not (_INTEGER if kind_of is int else _REAL).fullmatch(word):
            what = "a whole number" if kind_of is int else "a number"
            raise FileError(
                f"{place}: {kind} {quoted(name)}: {field} is {quoted(word)}, expected {what}"
            )
        numbers[field] = kind_of(word)
    components = " ".join(rest[len(fields) :]).replace(",", " ").split()
    return Functional(kind, name, numbers, tuple(components), line)
