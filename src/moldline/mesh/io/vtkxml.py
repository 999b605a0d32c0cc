"""VTK's XML files: their arrays, whichever way they are encoded.

Text, base64 and raw data, inline or appended, either byte order, blocks compressed with zlib. What
is written is base64 of whole arrays. A document type or entities are refused, so that a small
file cannot grow without bounds.
"""

import base64
import binascii
import math
import re
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import numpy as np

from ..._types import Array
from ...errors import FileError
from . import text

TYPES = {
    **{f"Int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)},
    **{f"UInt{8 * size}": f"u{size}" for size in (1, 2, 4, 8)},
    **{"Float32": "f4", "Float64": "f8"},
}
"""VTK's names of number types, and NumPy's."""

_STRING = "u1"  # letters are held as their codes

DEPTH = 32
"""Elements within elements; VTK's own files need 6."""

MOST = 2**14
"""Elements in a file of less than 1 MB; VTK's own have about 20, and 10 more for each piece."""

LEAST = 64
"""Bytes per element of a longer file, on the average."""

_LINE = ".line"  # no attribute of a file can have this name
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_CLOSE = b"</AppendedData>"


class Document:
    """A file's elements, and the numbers of its data arrays."""

    def __init__(self, data: bytes, path: Path | str):
        self.path = path
        data, self._appended = self._cut(data)
        self.root = _parsed(data, path)
        if self.root.tag != "VTKFile":
            raise FileError(
                f"{path}: the first element is {text.quoted(self.root.tag)}, expected 'VTKFile'"
            )
        self._order = ">" if self.root.get("byte_order") == "BigEndian" else "<"
        self._size = np.dtype(self._order + ("u8" if self._is_wide() else "u4"))
        self._compressor = self.root.get("compressor")
        if self._compressor not in (None, "", "vtkZLibDataCompressor"):
            raise FileError(
                f"{path}: data are compressed by {text.quoted(self._compressor)}, expected "
                "vtkZLibDataCompressor; write the file again with zlib or without compression"
            )
        appended = self.root.find("AppendedData")
        self._is_raw = appended is not None and appended.get("encoding", "base64") == "raw"
        arrays = (e for e in self.root.iter() if e.get("format") == "appended")
        self._offsets = sorted(self.count(element, "offset") for element in arrays)

    def count(self, element: Element, attribute: str) -> int:
        """An attribute that counts; 0 if it is absent."""
        value = element.get(attribute, "0").strip()
        if not re.fullmatch("[0-9]{1,15}", value):
            raise FileError(
                f"{self.place(element)}: {attribute}={text.quoted(value)} is no whole number of "
                "at least 0"
            )
        return int(value)

    def place(self, element: Element) -> str:
        """File, line and name of an element, for messages."""
        name = element.get("Name")
        tag = text.quoted(element.tag)[1:-1]
        what = f"{tag} {text.quoted(name)}" if name else tag
        return f"{self.path}: line {element.get(_LINE)}: {what}"

    def array(self, element: Element, rows: int | None = None) -> np.ndarray:
        """Numbers of a data array, `rows` of them or of groups of components."""
        kind = self._kind(element)
        encoding = element.get("format", "ascii")
        if encoding == "ascii":
            values = self._text(element, kind)
        elif encoding in ("binary", "appended"):
            values = self._binary(element, encoding).astype(kind)
        else:
            raise FileError(
                f"{self.place(element)}: format {text.quoted(encoding)}, expected ascii, binary or "
                "appended"
            )
        return self._shaped(element, values, rows)

    def arrays(self, parent: Element | None, rows: int) -> dict[str, np.ndarray]:
        """All data arrays of numbers below an element, by name."""
        found = [] if parent is None else parent.findall("DataArray")
        known = [e for e in found if e.get("type") in TYPES and e.get("Name")]
        return {element.get("Name", ""): self.array(element, rows) for element in known}

    def _kind(self, element: Element) -> str:
        name = element.get("type", "")
        if name not in TYPES and name != "String":
            raise FileError(
                f"{self.place(element)}: type {text.quoted(name)}, expected one of "
                f"{', '.join(TYPES)}"
            )
        return TYPES.get(name, _STRING)

    def _text(self, element: Element, kind: str) -> np.ndarray:
        line = int(element.get(_LINE, "1"))
        found = text.numbers((element.text or "").encode(), self.path, line, finite=False)
        with np.errstate(invalid="ignore", over="ignore"):
            if element.get("type") == "String":
                found %= 256  # some write codes of letters with a sign
            values = found.astype(kind)
        if kind[0] != "f":
            is_wrong = values != found
            if kind[1] == "8":
                is_wrong |= np.abs(found) >= 2**53  # which a float may have rounded
            self._mend(values, np.flatnonzero(is_wrong), element)
        return values

    def _mend(self, values: np.ndarray, places: np.ndarray, element: Element) -> None:
        """Read some whole numbers again without going through floats."""
        tokens = (element.text or "").split() if len(places) else []
        for place in places.tolist():
            token = tokens[place] if len(tokens) == len(values) else "a repeat count"
            try:
                values[place] = int(token)
            except (ValueError, OverflowError):
                raise FileError(
                    f"{self.place(element)}: holds {text.quoted(token)}, which is no "
                    f"{element.get('type')}"
                ) from None

    def _shaped(self, element: Element, values: np.ndarray, rows: int | None) -> np.ndarray:
        components = self.count(element, "NumberOfComponents") or 1
        if len(values) % components or (rows is not None and len(values) != rows * components):
            need = f"{rows} times {components}" if rows is not None else f"groups of {components}"
            raise FileError(
                f"{self.place(element)}: {len(values)} numbers, expected {need}; "
                "was the copy cut short?"
            )
        return values.reshape(-1, components) if components > 1 else values

    def _is_wide(self) -> bool:
        kind = self.root.get("header_type", "UInt32")
        if kind not in ("UInt32", "UInt64"):
            raise FileError(
                f"{self.path}: header_type {text.quoted(kind)}, expected UInt32 or UInt64"
            )
        return kind == "UInt64"

    def _cut(self, data: bytes) -> tuple[bytes, bytes]:
        """The document without its appended data, which need not be XML, and those data."""
        start = data.find(b"<AppendedData")
        if start < 0:
            return data, b""
        opened = data.find(b">", start) + 1
        begin = data.find(b"_", opened) + 1
        end = data.rfind(_CLOSE)
        if not 0 < opened < begin <= end:
            raise FileError(
                f"{self.path}: line {text.line_at(data, start)}: AppendedData need '_', the data "
                "and an end; was the copy cut short?"
            )
        return data[:opened] + data[end:], data[begin:end]

    def _binary(self, element: Element, encoding: str) -> np.ndarray:
        if encoding == "binary":
            data = self._from_base64(element, (element.text or "").encode())
        else:
            offset = self.count(element, "offset")
            after = np.searchsorted(self._offsets, offset, side="right")
            end = self._offsets[after] if after < len(self._offsets) else len(self._appended)
            data = self._appended[offset:end]
            if not self._is_raw:
                data = self._from_base64(element, data)
        dtype = np.dtype(self._order + self._kind(element))
        unpacked = self._unpacked(element, data) if self._compressor else self._plain(element, data)
        if len(unpacked) % dtype.itemsize:
            raise FileError(
                f"{self.place(element)}: {len(unpacked)} bytes are no whole number of "
                f"{element.get('type')}"
            )
        return np.frombuffer(unpacked, dtype)

    def _from_base64(self, element: Element, data: bytes) -> bytes:
        """Bytes of one or more pieces, each padded on its own."""
        data = data.translate(None, b" \t\r\n")
        try:
            pieces = re.findall(rb"[^=]+={0,2}", data)
            return b"".join(base64.b64decode(piece, validate=True) for piece in pieces)
        except binascii.Error as problem:
            raise FileError(
                f"{self.place(element)}: damaged base64 data ({problem}); copy the file again"
            ) from None

    def _sizes(self, element: Element, data: bytes, count: int, at: int = 0) -> list[int]:
        """Sizes that stand before the data."""
        if len(data) < (at + count) * self._size.itemsize:
            raise self._short(element, (at + count) * self._size.itemsize, len(data))
        values: list[int] = np.frombuffer(
            data, self._size, count, at * self._size.itemsize
        ).tolist()
        return values

    def _plain(self, element: Element, data: bytes) -> bytes:
        size = self._sizes(element, data, 1)[0]
        begin = self._size.itemsize
        if size > len(data) - begin:
            raise self._short(element, size, len(data) - begin)
        return data[begin : begin + size]

    def _unpacked(self, element: Element, data: bytes) -> bytes:
        if self._sizes(element, data, 1)[0] == 0:
            return b""
        count, whole, last = self._sizes(element, data, 3)
        packed = self._sizes(element, data, count, 3)
        at = (3 + count) * self._size.itemsize
        blocks = []
        for number, size in enumerate(packed):
            wanted = last if last and number == count - 1 else whole
            unpacker = zlib.decompressobj()
            try:
                blocks.append(unpacker.decompress(data[at : at + size], wanted + 1))
            except (zlib.error, OverflowError) as problem:
                raise FileError(
                    f"{self.place(element)}: block {number + 1} is damaged ({problem}); copy the "
                    "file again"
                ) from None
            if len(blocks[-1]) != wanted:
                raise self._short(element, wanted, len(blocks[-1]))
            at += size
        return b"".join(blocks)

    def _short(self, element: Element, need: int, found: int) -> FileError:
        return FileError(
            f"{self.place(element)}: the data need {need} bytes, the file has {found}; "
            "was the copy cut short?"
        )


def data_array(name: str, array: Array, **attributes: str) -> bytes:
    """An element that holds an array in base64, one row per tuple, with more attributes."""
    start, array = _declared(name, array, attributes)
    data = np.uint64(array.nbytes).tobytes() + array.tobytes()
    return b'%s format="binary">%s</DataArray>\n' % (start, base64.b64encode(data))


def text_array(name: str, array: Array, **attributes: str) -> Iterator[bytes]:
    """The same as text, a line per tuple."""
    start, array = _declared(name, array, attributes)
    yield b'%s format="ascii">\n' % start
    yield from text.written(array.reshape(-1, math.prod(array.shape[1:])))
    yield b"</DataArray>\n"


def _declared(name: str, array: Array, attributes: dict[str, str]) -> tuple[bytes, np.ndarray]:
    """The beginning of an array's element, and the array in a type that VTK knows."""
    array = np.ascontiguousarray(array)
    if array.dtype.kind == "b":
        array = array.astype(np.uint8)
    kinds = [kind for kind, code in TYPES.items() if np.dtype(code) == array.dtype]
    components = math.prod(array.shape[1:])
    if not kinds or not components:
        what = f"of type {array.dtype}" if components else "with no number per point or face"
        raise FileError(f"data {name!r} {what} cannot be written, expected numbers")
    more = "".join(f" {key}={attribute(value)}" for key, value in attributes.items())
    start = (
        f'<DataArray type="{kinds[0]}" Name={attribute(name)} '
        f'NumberOfComponents="{components}"{more}'
    )
    return start.encode(), array


def attribute(value: str) -> str:
    """A value in quotation marks; a `?` stands for what XML cannot hold."""
    return quoteattr(_NO_XML.sub("?", value))


def opening(kind: str) -> bytes:
    """The first lines of a file, up to its data set."""
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    return (
        f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0" byte_order="{order}" '
        f'header_type="UInt64">\n<{kind}>\n'
    ).encode()


class _Parser:
    """Builds the tree of elements, each with its line, and refuses what makes a file explode."""

    def __init__(self, path: Path | str, size: int):
        self.path, self.depth, self.count = path, 0, 0
        self.most = max(MOST, size // LEAST)
        self.builder, self.expat = TreeBuilder(), expat.ParserCreate()
        self.expat.buffer_text = True
        self.expat.buffer_size = 2**20
        self.expat.StartElementHandler = self.start
        self.expat.EndElementHandler = self.end
        self.expat.CharacterDataHandler = self.builder.data
        self.expat.StartDoctypeDeclHandler = self.refuse

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        line = self.expat.CurrentLineNumber
        self.depth += 1
        self.count += 1
        if self.depth > DEPTH:
            raise FileError(
                f"{self.path}: line {line}: more than {DEPTH} elements within each other"
            )
        if self.count > self.most:
            raise FileError(
                f"{self.path}: line {line}: more than {self.most} elements; is it a mesh?"
            )
        self.builder.start(tag, attributes | {_LINE: str(line)})

    def end(self, tag: str) -> None:
        self.depth -= 1
        self.builder.end(tag)

    def refuse(self, *_: object) -> None:
        raise FileError(
            f"{self.path}: line {self.expat.CurrentLineNumber}: found a document type, which VTK "
            "files do not have; remove it"
        )


def _parsed(data: bytes, path: Path | str) -> Element:
    parser = _Parser(path, len(data))
    try:
        parser.expat.Parse(data, True)
    except expat.ExpatError as problem:
        raise FileError(
            f"{path}: line {problem.lineno}: {expat.ErrorString(problem.code)}, expected XML; "
            "was the copy cut short?"
        ) from None
    return parser.builder.close()
