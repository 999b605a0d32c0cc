"""XDDM documents: read, changed and written, all else in them as it was."""

import os
from functools import cached_property
from pathlib import Path
from typing import NoReturn

from ..errors import FileError
from ..mesh.io.files import contents, replacing
from . import reading
from .edit import Draft, Edit, document_text, element_text
from .element import Element
from .numbers import number


class Document:
    """A document and the bytes it came from, which it keeps.

    Attributes
    ----------
    data
        The bytes of the file.
    path
        Its name, for messages and for files that it names.
    root
        Its first element.
    """

    def __init__(self, data: bytes, path: str | os.PathLike[str] = "document"):
        self.data = data
        self.path = Path(path)
        self._source = reading.source(data, str(path))
        self.root: Element = reading.tree(self._source.text, str(path))

    @cached_property
    def by_name(self) -> dict[str, Element]:
        """All elements with an ID by their full names; of equal names the first."""
        found: dict[str, Element] = {}
        for element in self.root.descendants():
            if element.id:
                found.setdefault(element.full_name, element)
        return found

    def edited(self, edit: Edit) -> "Document":
        """The document with changes, all else byte for byte as it was; without any, itself."""
        text = edit.applied(self._source.text, self.root)
        if text == self._source.text:
            return self
        return Document(self._source.encoded(text), self.path)

    def with_attribute(self, element: Element, attribute: str, value: str) -> "Document":
        """The document with one attribute changed."""
        edit = Edit()
        edit.set(element, attribute, value)
        return self.edited(edit)

    def part(self, element: Element) -> "Document":
        """A document of one element and all that is within it, in this one's words and lines."""
        text = element_text(self._source.text, element)
        name = reading.PUBLIC.get(self._source.codec, self._source.codec.upper())
        declared = f'<?xml version="1.0" encoding="{name}"?>\n'.encode()
        declared += b"\n" * (element.line - 2)
        return Document(self._source.encoded(declared + text + b"\n"), self.path)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it; the old file stays whole until the new one is."""
        with replacing(Path(path)) as file:
            file.write(self.data)

    def place(self, element: Element) -> str:
        """File, line and name of an element, for messages."""
        return f"{self.path}: line {element.line}: {element.label}"

    def refuse(self, element: Element, reason: object) -> NoReturn:
        """Raise an error about an element."""
        raise FileError(f"{self.place(element)}: {reason}") from None

    def number(self, element: Element, attribute: str) -> float | None:
        """The number an attribute holds; None if it is absent or not set."""
        text = element.get(attribute)
        if text is None:
            return None
        try:
            return number(text)
        except ValueError as problem:
            self.refuse(element, f"{attribute}={problem}")


def read(path: str | os.PathLike[str]) -> Document:
    """Read a document."""
    try:
        size = os.path.getsize(path)  # noqa: PTH202 - a name with a NUL is for `contents` to refuse
    except (OSError, ValueError):
        size = 0
    if size > reading.LARGEST:
        raise FileError(
            f"{path}: {size} bytes, expected at most {reading.LARGEST}; is it an XDDM document?"
        )
    return Document(contents(Path(path)), path)


def made(
    draft: Draft, path: str | os.PathLike[str] = "document", encoding: str = "ISO-8859-1"
) -> Document:
    """A new document from a draft of its first element."""
    text = document_text(draft, encoding)
    return Document(text.encode(encoding, "xmlcharrefreplace"), path)
