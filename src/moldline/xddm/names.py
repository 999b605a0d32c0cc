"""Full names of a document's values, and what a shorter name in it stands for."""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator

from ..errors import ParameterError
from ..mesh.io.text import quoted
from .element import JOINT, Element
from .vocabulary import VALUED, is_namespace


def named(target: Element) -> Iterator[Element]:
    """What has an ID and is read, below an element, in the order of the document.

    Namespaces are looked into, values are not: what is within them has no name of its own.
    """
    waiting = [iter(target.children)]
    while waiting:
        element = next(waiting[-1], None)
        if element is None:
            waiting.pop()
            continue
        if element.id:
            yield element
        if is_namespace(element):
            waiting.append(iter(element.children))


def plain(name: str) -> str:
    """A name without white space, which `dz[3, 1]` may hold."""
    return re.sub(r"\s", "", name)


class Names:
    """Values by name: in full, by the last parts of it, or by ID alone."""

    def __init__(self, elements: Iterable[Element]):
        self._anywhere: dict[str, list[Element]] = defaultdict(list)
        self._from: dict[tuple[Element | None, str], list[Element]] = defaultdict(list)
        for element in elements:
            if element.tag not in VALUED:
                continue
            below: dict[tuple[Element | None, str], None] = {}
            below[element.parent, plain(element.id)] = None
            name = plain(element.own_name)
            for place in element.ancestors():
                below[place, name] = None
                name = plain(place.own_name) + JOINT + name
            below[None, name] = None  # in full
            for key in below:
                self._from[key].append(element)
            for ending in dict.fromkeys(ending for _, ending in below):
                self._anywhere[ending].append(element)

    def has(self, name: str) -> bool:
        """Whether a name stands for anything, be it for several."""
        return plain(name) in self._anywhere

    def find(self, name: str, scope: Element | None = None) -> Element | None:
        """The value a name stands for, seen from `scope`; None if there is none.

        Of several, the one with just this full name, else the one nearest: an ID of a brother
        of what is in `scope`, then of what is around it.
        """
        text = plain(name)
        found = self._anywhere.get(text, [])
        if len(found) < 2:
            return found[0] if found else None
        around = [] if scope is None else [scope, *scope.ancestors()]
        for place in (None, *around):
            if near := self._from.get((place, text)):
                return _only(near, name)
        return _only(found, name)


def _only(found: list[Element], name: str) -> Element:
    if len(found) == 1:
        return found[0]
    each = ", ".join(f"{quoted(one.full_name)[1:-1]} (line {one.line})" for one in found[:4])
    raise ParameterError(
        f"{quoted(name)} may stand for {len(found)} values: {each}{', ...' * (len(found) > 4)}; "
        f"use the full name, whose parts {JOINT!r} joins"
    )
