"""The one element of a document that an XPath chooses, such as `/Model[@ID='wing']`."""

import re

from ..errors import FileError, ParameterError
from ..mesh.io.text import quoted
from .document import Document
from .element import Element

LONGEST = 1024
"""Characters of a path."""

_STEP = re.compile(r"(//?)([^\W\d][\w.-]*|\*)((?:\[[^\[\]]*\])*)")
_CONDITION = re.compile(
    r"\[\s*(?:@(?P<name>[^\W\d][\w.-]*)\s*(?:=\s*(?P<value>\"[^\"]*\"|'[^']*'))?"
    r"|(?P<place>[1-9][0-9]{0,8}))\s*\]"
)
_BRACKET = re.compile(r"\[[^\[\]]*\]")


def chosen(document: Document, path: str = "") -> Element:
    """The element that a path matches; it must be exactly one. Without a path, the first.

    Paths are made of `/Tag` (a child) and `//Tag` (anything below), `*` for any tag, and of
    conditions after them: `[@ID='x']` (an attribute, its name without case), `[@ID]` (it is
    there), `[2]` (the second of its brothers that match so far).
    """
    if not path.strip():
        return document.root
    found = matches(document.root, path)
    if len(found) == 1:
        return found[0]
    if not found:
        raise FileError(
            f"{document.path}: no element matches {quoted(path)}; the first one is "
            f"{document.root.label}"
        )
    places = ", ".join(f"{one.label} in line {one.line}" for one in found[:4])
    more = ", ..." if len(found) > 4 else ""
    raise FileError(
        f"{document.path}: {len(found)} elements match {quoted(path)} ({places}{more}), expected "
        "one; say which by [@ID='...']"
    )


def matches(root: Element, path: str) -> list[Element]:
    """All elements that a path matches, in the order of the document."""
    found: list[Element | None] = [None]  # the document itself, whose only child is its root
    for is_deep, tag, conditions in _steps(path):
        places = _below(root, found) if is_deep else found
        groups = (_children(root, place) for place in places)
        found = list(dict.fromkeys(e for g in groups for e in _filtered(g, tag, conditions)))
    return sorted((e for e in found if e is not None), key=lambda element: element.start)


def _steps(path: str) -> list[tuple[bool, str, list[re.Match[str]]]]:
    text = path.strip()
    text = text if text.startswith("/") else "/" + text
    steps, place = [], 0
    while place < len(text):
        step = _STEP.match(text, place)
        parts = [] if step is None else _BRACKET.findall(step[3])
        conditions = [_CONDITION.fullmatch(part) for part in parts]
        if step is None or None in conditions or len(text) > LONGEST:
            raise ParameterError(
                f"the path {quoted(path)} cannot be read from {quoted(text[place:])} on; expected "
                "steps such as /Model, //Model, /*, each with conditions such as [@ID='wing']"
            )
        steps.append((step[1] == "//", step[2], [c for c in conditions if c is not None]))
        place = step.end()
    return steps


def _children(root: Element, place: Element | None) -> tuple[Element, ...]:
    return (root,) if place is None else place.children


def _below(root: Element, places: list[Element | None]) -> list[Element | None]:
    found: dict[Element | None, None] = {}
    for place in places:
        if place in found:
            continue  # what is below it has been seen
        if place is None:
            found[None] = None
        found.update(dict.fromkeys((place or root).descendants()))
    return list(found)


def _filtered(
    group: tuple[Element, ...], tag: str, conditions: list[re.Match[str]]
) -> list[Element]:
    found = [element for element in group if tag in ("*", element.tag)]
    for condition in conditions:
        if condition["place"]:
            place = int(condition["place"])
            found = found[place - 1 : place]
        elif condition["value"] is None:
            found = [e for e in found if e.get(condition["name"]) is not None]
        else:
            value = condition["value"][1:-1]
            found = [e for e in found if e.get(condition["name"]) == value]
    return found
