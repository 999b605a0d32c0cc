"""Elements of an XDDM document, as they stand in the file."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

from ..mesh.io.text import quoted

JOINT = "__"
"""What stands between the tags and IDs of a full name."""


class Element:
    """A tag with its attributes, in its place in a document; it never changes.

    Attributes
    ----------
    tag
        Its name; upper and lower case differ.
    attributes
        All of them, in the file's order and spelling; `get` finds one whatever its case.
    parent
        The element around it; None for the document's first.
    line
        Where its tag begins, counted from 1.
    start, close
        Where its first tag begins and where its last one does, in the UTF-8 form of the document.
    """

    __slots__ = ("_children", "_chunks", "attributes", "close", "line", "parent", "start", "tag")

    def __init__(
        self, tag: str, attributes: dict[str, str], parent: "Element | None", line: int, start: int
    ):
        self.tag = tag
        self.attributes: Mapping[str, str] = MappingProxyType(attributes)
        self.parent = parent
        self.line = line
        self.start = self.close = start
        self._children: list[Element] = []
        self._chunks: list[tuple[int, str]] = []

    def __repr__(self) -> str:
        return f"<{self.label}, line {self.line}>"

    @property
    def children(self) -> tuple["Element", ...]:
        """The elements within it, in order."""
        return tuple(self._children)

    @property
    def id(self) -> str:
        """Its ID; empty without one."""
        return self.get("ID") or ""

    @property
    def text(self) -> str:
        """Its own text, without that of comments and of elements within."""
        return "".join(text for _, text in self._chunks)

    @property
    def label(self) -> str:
        """Its tag and ID, for messages."""
        tag = quoted(self.tag)[1:-1]
        name = self.get("ID") or self.get("Name") or self.get("P")
        return f"{tag} {quoted(name)}" if name else tag

    @property
    def own_name(self) -> str:
        """Its tag and, where it has one, its ID."""
        return self.tag + JOINT + self.id if self.id else self.tag

    @property
    def full_name(self) -> str:
        """Tags and IDs from the document's first element down to this one."""
        return self.name_below(None)

    def name_below(self, ancestor: "Element | None") -> str:
        """Tags and IDs of what lies between an ancestor and this, and of this."""
        parts: list[str] = []
        element: Element | None = self
        while element is not None and element is not ancestor:
            parts.append(element.own_name)
            element = element.parent
        return JOINT.join(reversed(parts))

    def get(self, attribute: str) -> str | None:
        """The value of an attribute, whose name is matched without case; None if it is absent."""
        name = self.spelling(attribute)
        return None if name is None else self.attributes[name]

    def spelling(self, attribute: str) -> str | None:
        """How the file spells an attribute's name; None if it is absent."""
        if attribute in self.attributes:
            return attribute
        wanted = attribute.lower()
        return next((name for name in self.attributes if name.lower() == wanted), None)

    def first(self, tag: str) -> "Element | None":
        """The first child of a tag."""
        return next((child for child in self._children if child.tag == tag), None)

    def all(self, tag: str) -> tuple["Element", ...]:
        """All children of a tag."""
        return tuple(child for child in self._children if child.tag == tag)

    def ancestors(self) -> Iterator["Element"]:
        """What is around it, from the inside out."""
        element = self.parent
        while element is not None:
            yield element
            element = element.parent

    def descendants(self) -> Iterator["Element"]:
        """Itself and all that is within it, in the order of the document."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting.extend(reversed(element._children))

    def lines(self) -> Iterator[tuple[int, str]]:
        """Its own text line by line, each with its number in the file."""
        number, text = 0, ""
        for line, chunk in self._chunks:
            for more in chunk.splitlines(keepends=True):
                if line != number and text:
                    yield number, text
                    text = ""
                number, text = line, text + more
        if text:
            yield number, text

    def grow(self, child: "Element") -> None:
        """Take in a child; for the reader of documents alone."""
        self._children.append(child)

    def say(self, line: int, text: str) -> None:
        """Take in text; for the reader of documents alone."""
        self._chunks.append((line, text))
