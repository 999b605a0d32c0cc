"""Changes of a document: only the bytes that they are about differ afterwards."""

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from ..errors import ParameterError
from ..mesh.io.text import quoted
from .element import Element
from .numbers import number, written

_OPENING = re.compile(
    rb"<([^\s/>]+)((?:\s+[^\s=]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*)(\s*)(/?)>"
)  # of well-formed XML
_ATTRIBUTE = re.compile(rb"\s+([^\s=]+)\s*=\s*(\"[^\"]*\"|'[^']*')")
_REST = re.compile(rb"[ \t]*(?=\r?\n|$)")
_NAME = re.compile(r"[^\W\d][\w.-]*(?::[^\W\d][\w.-]*)?")
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ESCAPES = {"&": "&amp;", "<": "&lt;", ">": "&gt;", "\t": "&#9;", "\n": "&#10;", "\r": "&#13;"}


@dataclass(frozen=True)
class Draft:
    """An element that a document does not have yet."""

    tag: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    children: Sequence["Draft"] = ()
    text: str = ""


class Edit:
    """Collects changes of one document's elements; `Document.edited` applies all at once."""

    def __init__(self) -> None:
        self._values: dict[tuple[Element, str], tuple[str, str | None]] = {}
        self._added: dict[Element, list[Draft]] = defaultdict(list)
        self._removed: set[Element] = set()

    def set(self, element: Element, attribute: str, value: str | None) -> None:
        """Give an attribute a value, adding it where it is absent; None removes it."""
        if value is not None:
            _check_text(value)
        _check_name(attribute)
        self._values[element, attribute.lower()] = attribute, value

    def set_number(self, element: Element, attribute: str, value: float) -> None:
        """The same for a number; one that the file holds already keeps its spelling."""
        text = written(attribute, value)
        held = element.get(attribute)
        try:
            is_same = held is not None and number(held) == value
        except ParameterError:
            is_same = False
        self.set(element, attribute, held if is_same else text)

    def add(self, parent: Element, draft: Draft) -> None:
        """Add an element after the last one within `parent`."""
        _check(draft)
        self._added[parent].append(draft)

    def remove(self, element: Element) -> None:
        """Remove an element and all that is within it."""
        if element.parent is None:
            raise ParameterError(f"{element.label} is the whole document and cannot be removed")
        self._removed.add(element)

    def applied(self, source: bytes, root: Element) -> bytes:
        """The text of the document, in UTF-8, with the changes made."""
        for element in (*self._removed, *self._added, *(one for one, _ in self._values)):
            if element is not root and root not in element.ancestors():
                raise ParameterError(f"{element.label} is of another document; find it in this one")
        changes: list[_Change] = []
        attributes: dict[Element, list[tuple[str, str | None]]] = defaultdict(list)
        for (element, _), pair in self._values.items():
            attributes[element].append(pair)
        layout = _Layout(source)
        for element, pairs in attributes.items():
            if not self._is_gone(element):
                changes += _attribute_changes(source, element, pairs)
        for element in self._removed:
            if element.parent is not None and not self._is_gone(element.parent):
                changes.append(layout.removal(element))
        for parent, drafts in self._added.items():
            if not self._is_gone(parent):
                changes += layout.additions(parent, drafts)
        return _spliced(source, changes)

    def _is_gone(self, element: Element) -> bool:
        return element in self._removed or any(e in self._removed for e in element.ancestors())


def document_text(draft: Draft, encoding: str) -> str:
    """A whole new document."""
    _check(draft)
    return f'<?xml version="1.0" encoding="{encoding}"?>\n{_text(draft, "", "  ", chr(10))}\n'


def element_text(source: bytes, element: Element) -> bytes:
    """The text of one element, from its first tag to its last."""
    return source[element.start : _Layout(source).end(element)]


class _Change(NamedTuple):
    start: int
    end: int
    text: bytes


def _spliced(source: bytes, changes: list[_Change]) -> bytes:
    parts, place = [], 0
    for change in sorted(changes, key=lambda change: (change.start, change.end)):
        parts += [source[place : change.start], change.text]
        place = change.end
    return b"".join([*parts, source[place:]])


def _opening(source: bytes, element: Element) -> re.Match[bytes]:
    found = _OPENING.match(source, element.start)
    assert found is not None
    return found


def _attribute_changes(
    source: bytes, element: Element, pairs: list[tuple[str, str | None]]
) -> list[_Change]:
    opening, changes = _opening(source, element), []
    spans = {m[1].decode(): m for m in _ATTRIBUTE.finditer(source, *opening.span(2))}
    for name, value in pairs:
        spelling = element.spelling(name)
        if spelling is None:
            if value is not None:
                text = f' {name}="{_escaped(value, chr(34))}"'.encode()
                changes.append(_Change(opening.end(2), opening.end(2), text))
        elif value is None:
            changes.append(_Change(*spans[spelling].span(), b""))
        elif value != element.attributes[spelling]:
            start, end = spans[spelling].span(2)
            text = _escaped(value, chr(source[start])).encode()
            changes.append(_Change(start + 1, end - 1, text))
    return changes


class _Layout:
    """Where elements stand in the text, and how it is indented."""

    def __init__(self, source: bytes):
        self.source = source
        self.newline = "\r\n" if b"\r\n" in source else "\n"

    def end(self, element: Element) -> int:
        """Where an element ends."""
        opening = _opening(self.source, element)
        return opening.end() if opening[4] else self.source.index(b">", element.close) + 1

    def removal(self, element: Element) -> _Change:
        """Without it, and without its line where it stands there alone."""
        start, end = element.start, self.end(element)
        before = self._back(start, b" \t")
        after = _REST.match(self.source, end)
        if after is not None and self.source[before - 1 : before] == b"\n":
            end = after.end()
            start = before - 1 - (self.source[before - 2 : before - 1] == b"\r")
        return _Change(start, end, b"")

    def additions(self, parent: Element, drafts: list[Draft]) -> list[_Change]:
        """New elements after all that `parent` holds, indented as their brothers are."""
        opening = _opening(self.source, parent)
        outer = self._margin(parent) or ""
        inner = outer + self.step(parent)
        is_inline = False
        if parent.children:
            margin = self._margin(parent.children[0])
            is_inline = margin is None
            inner = inner if margin is None else margin
        step = inner.removeprefix(outer) or "  "
        lead = "" if is_inline else self.newline + inner
        body = "".join(lead + _text(draft, inner, step, self.newline) for draft in drafts)
        tail = "" if is_inline else self.newline + outer
        if opening[4]:
            closed = f">{body}{tail}</{parent.tag}>".encode()
            return [_Change(opening.end(2), opening.end(), closed)]
        place = max(self._back(parent.close, b" \t\r\n"), opening.end())
        has_line = b"\n" in self.source[place : parent.close]
        return [_Change(place, place, (body + ("" if has_line else tail)).encode())]

    def step(self, element: Element) -> str:
        """By how much the document indents what is within an element."""
        first = next(element.ancestors(), element)
        for around in (first, *first.ancestors()):
            for child in around.children[:1]:
                margin, outer = self._margin(child), self._margin(around)
                if margin and outer is not None and margin != outer and margin.startswith(outer):
                    return margin.removeprefix(outer)
        return "  "

    def _margin(self, element: Element) -> str | None:
        """The white space before an element that begins a line; None for others."""
        before = self._back(element.start, b" \t")
        if before and self.source[before - 1 : before] != b"\n":
            return None
        return self.source[before : element.start].decode()

    def _back(self, place: int, letters: bytes) -> int:
        """Where the letters begin that end at a place."""
        while place and self.source[place - 1] in letters:
            place -= 1
        return place


def _text(draft: Draft, margin: str, step: str, newline: str) -> str:
    pairs = "".join(f' {k}="{_escaped(v, chr(34))}"' for k, v in draft.attributes.items())
    opening = f"<{draft.tag}{pairs}"
    if not draft.children and not draft.text:
        return opening + "/>"
    text = re.sub("[&<>\r]", lambda found: _ESCAPES[found[0]], draft.text)
    inner = margin + step
    body = "".join(newline + inner + _text(child, inner, step, newline) for child in draft.children)
    return f"{opening}>{text}{body}{newline + margin if body else ''}</{draft.tag}>"


def _escaped(value: str, quote: str) -> str:
    text = re.sub("[&<\t\n\r]", lambda found: _ESCAPES[found[0]], value)
    return text.replace(quote, "&quot;" if quote == '"' else "&apos;")


def _check(draft: Draft) -> None:
    _check_name(draft.tag)
    _check_text(draft.text)
    for name, value in draft.attributes.items():
        _check_name(name)
        _check_text(value)
    for child in draft.children:
        _check(child)


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise ParameterError(
            f"{quoted(name)} cannot name an element or attribute; use letters, digits, '_' and '-'"
        )


def _check_text(value: str) -> None:
    if found := _NO_XML.search(value):
        raise ParameterError(
            f"{quoted(value)} holds {found[0]!r}, which XML cannot hold; leave it out"
        )
