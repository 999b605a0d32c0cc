"""The tables of a PLY file: rows of numbers and of lists of numbers."""

import struct
from array import array
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FileError
from . import text

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2"},
    **{"int": "i4", "uint": "u4", "float": "f4", "double": "f8"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2"},
    **{"int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"},
}
"""NumPy's code of each type that a header can name."""


_UNITS = {1: "bytes", 8: "numbers"}


class Property(NamedTuple):
    """A number, or a list of numbers after its length, in each row."""

    type: np.dtype
    """What the header says it is."""
    stored: np.dtype
    """What lies in the file; numbers of text are all 8-byte floats."""
    length: np.dtype | None
    """How the length of a list lies in the file."""

    @classmethod
    def of(cls, kind: str, length: str | None, order: str) -> "Property":
        """From the header's words, and the byte order or nothing for text."""

        def stored(name: str) -> np.dtype:
            return np.dtype(order + TYPES[name] if order else np.float64)

        return cls(np.dtype(TYPES[kind]), stored(kind), stored(length) if length else None)


class Element(NamedTuple):
    """What a header promises of a table."""

    name: str
    rows: int
    properties: dict[str, Property]

    @property
    def lists(self) -> list[str]:
        """Names of the lists in a row."""
        return [name for name, found in self.properties.items() if found.length]

    @property
    def least(self) -> int:
        """Bytes of a row whose lists are empty."""
        return sum((p.length or p.stored).itemsize for p in self.properties.values())

    def row(self, lengths: list[int]) -> np.dtype:
        """A row whose lists have these lengths."""
        fields: list[tuple] = []
        left = iter(lengths)
        for name, (_, stored, length) in self.properties.items():
            if length is None:
                fields.append((name, stored))
            else:
                fields += [(f"{name} ", length), (name, stored, (next(left),))]
        return np.dtype(fields)


class Table(NamedTuple):
    """Columns of numbers as they are stored, and columns of lists."""

    element: Element
    scalars: dict[str, np.ndarray]
    lists: dict[str, tuple[np.ndarray, np.ndarray]]
    """Lengths, and the items of all rows one after the other."""

    def column(self, name: str, path: Path | str) -> np.ndarray:
        """Numbers of the type that the header says they have."""
        values, kind = self.scalars[name], self.element.properties[name].type
        with np.errstate(invalid="ignore", over="ignore"):
            column = values.astype(kind)
        if kind.kind != "f" and (column != values).any():
            row = int(np.argmax(column != values))
            raise FileError(
                f"{path}: {text.quoted(name)} of {self.element.name} {row} is {values[row]:.15g}, "
                f"expected a whole number of {kind.itemsize} bytes, as the header says"
            )
        return column


def tables(
    data: memoryview, elements: Iterable[Element], unit: int, path: Path | str
) -> dict[str, Table]:
    """All tables of a file, which lie one after the other and fill it.

    `unit` is what messages count in: 1 byte, or 8 where each number of a text has become a float.
    """
    found, at = {}, 0
    for element in elements:
        found[element.name], at = _table(data, at, element, unit, path)
    if at != len(data):
        raise FileError(
            f"{path}: {(len(data) - at) // unit} more {_UNITS[unit]} than the header promises; was "
            "it changed without its header?"
        )
    return found


def _table(
    data: memoryview, at: int, element: Element, unit: int, path: Path | str
) -> tuple[Table, int]:
    """A table, and where the next begins."""
    need, room = element.rows * element.least, len(data) - at
    if need > room:
        raise FileError(
            f"{path}: {element.rows} rows of {text.quoted(element.name)} need at least "
            f"{need // unit} {_UNITS[unit]}, {room // unit} are left; was the copy cut short?"
        )
    if not need:
        return _uniform(element, np.empty(0, element.row([0] * len(element.lists)))), at
    lengths, end = _lengths(data, at, element, 1, path)
    row = element.row([found[0] for found in lengths])
    if element.rows * row.itemsize <= room:
        rows = np.ndarray((element.rows,), row, data, at)
        if all((rows[f"{name} "] == rows[f"{name} "][0]).all() for name in element.lists):
            return _uniform(element, rows), at + rows.nbytes
    lengths, end = _lengths(data, at, element, element.rows, path)
    return _ragged(data, at, element, lengths), end


def _uniform(element: Element, rows: np.ndarray) -> Table:
    """A table whose lists have the same length in every row."""
    lists = {}
    for name in element.lists:
        items = rows[name]
        lists[name] = np.full(len(rows), items.shape[1]), items.reshape(-1)
    scalars = {name: rows[name] for name in element.properties if name not in lists}
    return Table(element, scalars, lists)


def _ragged(data: memoryview, at: int, element: Element, lengths: list[array]) -> Table:
    """A table whose rows differ in size."""
    left = iter(lengths)
    counts, widths = [], []
    for _, stored, length in element.properties.values():
        counts.append(
            np.ones(element.rows, np.int64) if length is None else np.array(next(left), np.int64)
        )
        widths.append(counts[-1] * stored.itemsize + (length.itemsize if length else 0))
    ends = at + np.cumsum(np.stack(widths, axis=1)).reshape(element.rows, -1)
    table = Table(element, {}, {})
    for k, (name, (_, stored, length)) in enumerate(element.properties.items()):
        begin = ends[:, k] - counts[k] * stored.itemsize
        within = np.arange(counts[k].sum()) - np.repeat(np.cumsum(counts[k]) - counts[k], counts[k])
        values = _gathered(data, np.repeat(begin, counts[k]) + within * stored.itemsize, stored)
        if length is None:
            table.scalars[name] = values
        else:
            table.lists[name] = counts[k], values
    return table


def _gathered(data: memoryview, places: np.ndarray, kind: np.dtype) -> np.ndarray:
    """The numbers that begin at these bytes."""
    letters = np.frombuffer(data, np.uint8)
    return letters[places[:, None] + np.arange(kind.itemsize)].view(kind)[:, 0]


def _lengths(
    data: memoryview, at: int, element: Element, rows: int, path: Path | str
) -> tuple[list[array], int]:
    """The length of each list in each row, found by going through them, and where they end."""
    steps, skip = [], 0
    for _, stored, length in element.properties.values():
        if length is None:
            skip += stored.itemsize
        else:
            order = length.byteorder if length.byteorder in "<>" else "="
            unpack = struct.Struct(order + length.char).unpack_from
            steps.append((skip + length.itemsize, length.itemsize, unpack, stored.itemsize))
            skip = 0
    what, found = text.quoted(element.name), [array("q") for _ in steps]
    for row in range(rows):
        for (before, size, unpack, width), lengths in zip(steps, found, strict=True):
            at += before
            count = unpack(data, at - size)[0] if at <= len(data) else 0
            if not 0 <= count <= len(data) or count % 1:
                raise FileError(
                    f"{path}: {what} {row} has a list of {count:.15g} numbers, expected "
                    "a whole number that the file has room for; is it damaged or cut short?"
                )
            lengths.append(int(count))
            at += int(count) * width
        at += skip
        if at > len(data):
            raise FileError(
                f"{path}: ends within {what} {row}, of {element.rows} from 0; was the copy "
                "cut short?"
            )
    return found, at
