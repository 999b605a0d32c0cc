"""Bytes of an XDDM document into elements; what would make a small file explode is refused."""

import codecs
import re
from typing import NamedTuple
from xml.parsers import expat

from ..errors import FileError
from ..mesh.io.text import quoted
from .element import Element

DEPTH = 32
"""Elements within elements; a design has about 6."""

MOST = 2**20
"""Elements of a document: 1000 variables times 1000 results."""

LARGEST = 2**26
"""Bytes of a document."""

LONGEST = 2**16
"""Characters of an attribute's value; other readers of XDDM cut after 4096."""

ATTRIBUTES = 256
"""Attributes of one element."""

_MARKS = {
    codecs.BOM_UTF8: "utf-8",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
}
_KNOWN = ("utf-8", "iso8859-1", "iso8859-15", "ascii", "cp1252", "utf-16", "utf-16-le", "utf-16-be")
PUBLIC = {
    **{"iso8859-1": "ISO-8859-1", "iso8859-15": "ISO-8859-15", "cp1252": "windows-1252"},
    **{"ascii": "US-ASCII", "utf-16-le": "UTF-16", "utf-16-be": "UTF-16"},
}
"""Encodings as declarations name them, where other programs may not know Python's name."""

_DECLARED = re.compile(r"""<\?xml\s[^>]*?\sencoding\s*=\s*["']([^"'>]{0,60})["']""")
_CUT_SHORT = {3, 5, 6, 20}  # expat: no element, unclosed token, part of a letter, unclosed CDATA


class Source(NamedTuple):
    """A document's text in UTF-8, and how the file itself spells it."""

    text: bytes
    mark: bytes
    """The bytes before it that tell its encoding; most files have none."""
    codec: str

    def encoded(self, text: bytes) -> bytes:
        """An edited text as the file spells it; letters that it cannot hold become references."""
        return self.mark + text.decode("utf-8").encode(self.codec, "xmlcharrefreplace")


def source(data: bytes, path: str) -> Source:
    """The text of a file, whatever encoding it declares."""
    if len(data) > LARGEST:
        raise FileError(
            f"{path}: {len(data)} bytes, expected at most {LARGEST}; is it an XDDM document?"
        )
    mark = next((m for m in _MARKS if data.startswith(m)), b"")
    if mark:
        found = _MARKS[mark]
        text = _decoded(data[len(mark) :], found, path)
        declared = _declared(text[:1024], path)
        if declared not in (None, found, found[:6]):
            raise FileError(
                f"{path}: begins as {found.upper()} does but declares {declared}; correct its "
                "first line"
            )
    else:
        found = _declared(data[:1024].decode("latin-1"), path) or "utf-8"
        if found.startswith("utf-16"):
            raise FileError(
                f"{path}: declares {found.upper()} but does not begin so; correct its first line"
            )
        text = _decoded(data, found, path)
    if (place := text.find("\0")) >= 0:
        line = text.count("\n", 0, place) + 1
        raise FileError(
            f"{path}: line {line}: holds a NUL character, expected XML text; copy the file again"
        )
    return Source(text.encode("utf-8"), mark, found)


def tree(text: bytes, path: str) -> Element:
    """The first element of a document, and all that is within it."""
    reader = _Reader(path)
    try:
        reader.expat.Parse(text, True)
    except expat.ExpatError as problem:
        is_cut = problem.code in _CUT_SHORT
        remedy = "was the copy cut short?" if is_cut else "correct it there"
        raise FileError(
            f"{path}: line {problem.lineno}, column {problem.offset + 1}: "
            f"{expat.ErrorString(problem.code)}, expected XML; {remedy}"
        ) from None
    return reader.first


class _Reader:
    """Builds the tree; every element knows its line and its bytes."""

    def __init__(self, path: str):
        self.path, self.count = path, 0
        self.open: list[Element] = []
        self.expat = expat.ParserCreate("utf-8")  # whatever the declaration says
        self.expat.ordered_attributes = True
        self.expat.StartElementHandler = self._start
        self.expat.EndElementHandler = self._end
        self.expat.CharacterDataHandler = self._say
        self.expat.StartDoctypeDeclHandler = self._refuse

    def _start(self, tag: str, pairs: list[str]) -> None:
        self.count += 1
        parent = self.open[-1] if self.open else None
        attributes = dict(zip(pairs[::2], pairs[1::2], strict=True))
        element = Element(
            tag, attributes, parent, self.expat.CurrentLineNumber, self.expat.CurrentByteIndex
        )
        self._check(element)
        if parent is None:
            self.first = element
        else:
            parent.grow(element)
        self.open.append(element)

    def _end(self, tag: str) -> None:
        self.open.pop().close = self.expat.CurrentByteIndex

    def _say(self, text: str) -> None:
        self.open[-1].say(self.expat.CurrentLineNumber, text)

    def _check(self, element: Element) -> None:
        place = f"{self.path}: line {element.line}"
        if len(self.open) >= DEPTH:
            raise FileError(f"{place}: more than {DEPTH} elements within each other; is it XDDM?")
        if self.count > MOST:
            raise FileError(f"{place}: more than {MOST} elements; is it an XDDM document?")
        if len(element.attributes) > ATTRIBUTES:
            raise FileError(f"{place}: {element.label}: more than {ATTRIBUTES} attributes")
        seen: dict[str, str] = {}
        for name, value in element.attributes.items():
            if len(value) > LONGEST:
                raise FileError(
                    f"{place}: {element.label}: {quoted(name)[1:-1]} has {len(value)} characters, "
                    f"expected at most {LONGEST}; shorten it"
                )
            if name.lower() in seen:
                raise FileError(
                    f"{place}: {element.label}: {quoted(seen[name.lower()])} and {quoted(name)} "
                    "are one attribute, as XDDM reads them without case; keep one of them"
                )
            seen[name.lower()] = name

    def _refuse(self, *_: object) -> None:
        raise FileError(
            f"{self.path}: line {self.expat.CurrentLineNumber}: found a document type (DOCTYPE), "
            "which could define entities and which XDDM does not have; remove it"
        )


def _declared(text: str, path: str) -> str | None:
    found = _DECLARED.match(text)
    if found is None:
        return None
    try:
        codec = codecs.lookup(found[1]).name
    except (LookupError, ValueError, UnicodeError):
        codec = ""
    if codec not in _KNOWN:
        raise FileError(
            f"{path}: line 1: the encoding is {quoted(found[1])}, expected UTF-8, UTF-16, "
            "ISO-8859-1, ISO-8859-15, windows-1252 or US-ASCII; save it as one of them"
        )
    return codec


def _decoded(data: bytes, codec: str, path: str) -> str:
    try:
        return data.decode(codec)
    except UnicodeDecodeError as problem:
        line = data.count(b"\n", 0, problem.start) + 1
        raise FileError(
            f"{path}: line {line}: byte 0x{data[problem.start]:02x} is no {codec.upper()}; "
            'write the encoding it has into its first line, such as encoding="ISO-8859-1"'
        ) from None
