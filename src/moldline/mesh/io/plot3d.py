"""PLOT3D grids: surface patches and control boxes, one block or many.

The file holds structured blocks, x of all points of a block, then y, then z, the first index
running fastest. It is text (with Fortran's repeat counts and D exponents) or binary: either byte
order, a raw stream or Fortran records, floats of 4 or 8 bytes; each of them may be packed with
gzip. A file without the number of blocks holds one. Where the header has two numbers per block
(nk absent; not in a raw stream, where that would be a guess) nk is 1, and if z is absent as well it
is 0. Which of all these it is follows from the first lines or records, which must hold nothing but
the number of blocks and the shapes, and from the amount of data. A raw stream of 4-byte floats that
look like the halves of 8-byte ones is refused, because half of such a file has the same size.

Lost on writing: nothing, but the file always names the number of blocks, nk and z. Text and 8-byte
floats keep every bit; 4-byte floats round. Blanking (IBLANK) is neither read nor written.
"""

import re
from collections.abc import Iterator
from itertools import takewhile
from math import prod
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FileError
from ..grid import Grid
from . import binary as layouts
from . import text
from .binary import Fit, Layout, Part
from .files import HEAD, Bytes, loaded, replacing
from .mapped import Run

NAME = "PLOT3D"
SUFFIXES = (".xyz", ".p3d", ".x", ".grd", ".fmt")
HOLDS = Grid

_COUNT = re.compile(rb"[1-9]\d{0,6}")

BLOCKS = 2**17
"""More in a binary file are a number read in the wrong byte order."""

LONGEST = 2**23
"""Points along an axis are fewer than this; as a 4-byte float it would be next to 0."""


class Header(NamedTuple):
    """How many points there are, and in how many numbers the file says so."""

    lengths: tuple[int, ...]
    """Integers in each part of the header: the number of blocks, if present, and the shapes."""
    shapes: tuple[tuple[int, ...], ...]
    coordinates: int

    @property
    def size(self) -> int:
        """All numbers of the file."""
        return sum(self.lengths) + self.coordinates * sum(map(prod, self.shapes))

    @property
    def parts(self) -> tuple[Part, ...]:
        """All arrays of the file."""
        blocks = [Part("f", self.coordinates * prod(shape)) for shape in self.shapes]
        return (*(Part("i", length) for length in self.lengths), *blocks)

    def __str__(self) -> str:
        points = sum(map(prod, self.shapes))
        return f"{len(self.shapes)} blocks with {points} points of {self.coordinates} coordinates"


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether the file begins with the shapes of blocks."""
    if not text.is_text(head):
        size = Path(path).stat().st_size
        return any(fit.size == size for fit in _fits(head))
    words = text.unix(head[: head.rfind(b"\n")]).split()
    begin = list(takewhile(_COUNT.fullmatch, words))
    headers = _text_headers(np.array(begin, np.float64), head)
    return bool(headers) and text.may_hold(head, path, [header.size for header in headers])


def read(path: Path | str) -> Grid:
    """The blocks in a file, whichever variant it is."""
    data = loaded(path)
    if text.is_text(data[:4096]):
        letters = bytes(data)
        values = text.numbers(letters, path)
        header = _fitting(_text_headers(values, letters), values, path)
        ends = np.cumsum([p.length for p in header.parts])
        blocks = np.split(values, ends)[len(header.lengths) : -1]
        return _grid([p.reshape(header.coordinates, -1) for p in blocks], header.shapes, path)
    fit = layouts.fitting(_fits(data), len(data), path)
    if fit.layout.precision == 4 and not fit.layout.records and _are_halves(data, fit):
        raise FileError(
            f"{path}: holds halves of 8-byte floats, or else points without any order; "
            "was the copy cut in half?"
        )
    blocks = [p for p in fit.layout.split(data, fit.parts, path) if p.dtype.kind == "f"]
    header = next(h for h in _binary_headers(data, fit.layout) if h.parts == fit.parts)
    return _grid([p.reshape(header.coordinates, -1) for p in blocks], header.shapes, path)


def write(
    path: Path | str,
    grid: Grid,
    binary: str | None = None,
    records: bool = False,
    precision: int = 8,
) -> None:
    """Write text, or binary data where `binary` is `"little"` or `"big"`.

    A name that ends in `.gz` is packed.
    """
    points = np.asarray(grid.points)
    ends = np.cumsum([prod(shape) for shape in grid.shapes])[:-1]
    blocks = [block.T.ravel() for block in np.split(points, ends)]
    arrays = [np.array([len(blocks)]), np.array(grid.shapes), *blocks]
    if binary is None:
        pieces: Iterator[Bytes] = (line for array in arrays for line in _lines(array))
    else:
        pieces = layouts.chosen(binary, records, precision).joined(arrays, path)
    with replacing(path) as file:
        for piece in pieces:
            file.write(piece)


def runs(data: np.ndarray, path: Path | str) -> list[Run]:
    """Where the coordinates lie in the bytes of a binary file, a run per block."""
    head = text.binary_head(data, path)
    fit = layouts.fitting(_fits(head), len(data), path)
    header = next(h for h in _binary_headers(head, fit.layout) if h.parts == fit.parts)
    if header.coordinates != 3:
        raise FileError(f"{path}: a plane grid has no room for z; convert it first")
    blocks = [n for n, part in enumerate(fit.parts) if part.kind == "f"]
    views = (fit.layout.view(data, fit.parts, n).reshape(3, -1) for n in blocks)
    return [Run(view.T[:, None]) for view in views]


def _headers(values: np.ndarray) -> Iterator[Header]:
    """Every way to read the first numbers as the shapes of blocks, the usual first."""
    count = int(values[0]) if len(values) and values[0] in range(1, len(values)) else 0
    for rank, coordinates in ((3, 3), (2, 3), (2, 2)):
        many = _shapes(values[1 : 1 + rank * count], rank)
        if len(many) == count > 0:
            yield Header((1, rank * count), many, coordinates)
        one = _shapes(values[:rank], rank)
        if one:
            yield Header((rank,), one, coordinates)


def _text_headers(values: np.ndarray, data: bytes) -> list[Header]:
    """As `_headers`, for a text, in which each part of the header ends with a line.

    A block's shape may run on in the next line only where no other header fits.
    """
    lines = text.unix(data[:HEAD]).split(b"\n")
    ends = [end for end in np.cumsum([len(line.split()) for line in lines]).tolist() if end]
    fitting, tidy = [], []
    for header in _headers(values):
        parts = np.cumsum(header.lengths).tolist()
        if parts[0] == ends[0] and parts[-1] in ends:
            fitting.append(header)
            inner = (end - parts[0] for end in ends if parts[0] <= end <= parts[-1])
            if all(end % len(header.shapes[0]) == 0 for end in inner):
                tidy.append(header)
    return tidy or fitting


def _shapes(values: np.ndarray, rank: int) -> tuple[tuple[int, ...], ...]:
    """Blocks' shapes, or none if a number cannot be one."""
    if (
        not len(values)
        or len(values) % rank
        or not all(1 <= v < LONGEST and v == int(v) for v in values)
    ):
        return ()
    sizes = [int(v) for v in values]
    return tuple(tuple(sizes[k : k + rank]) for k in range(0, len(sizes), rank))


def _fitting(headers: list[Header], values: np.ndarray, path: Path | str) -> Header:
    if not headers:
        raise FileError(
            f"{path}: the file begins with {values[:4]}, expected the number of blocks and their "
            "shapes"
        )
    for header in headers:
        if header.size == len(values):
            return header
    near = min(headers, key=lambda header: abs(np.log(header.size / len(values))))
    raise FileError(
        f"{path}: {near} need {near.size} numbers, the file has {len(values)}; "
        "was the copy cut short?"
    )


def _binary_headers(data: Bytes, layout: Layout) -> Iterator[Header]:
    """As `_headers`, for one layout of binary data."""
    ranks = (3, 2) if layout.records else (3,)
    count = layout.integers(data, 1, 1)
    if count and 1 <= count[0] <= min(len(data) // 8, BLOCKS):
        begin = 12 if layout.records else 4  # past the number of blocks, and its end marker
        for rank in ranks:
            length = rank * count[0]
            found = layout.integers(data[begin : begin + 4 * length + 8], length, length)
            headers = _headers(np.array(count + found)) if found else iter(())
            many = [header for header in headers if header.lengths == (1, length)]
            yield from many
            if many and not layout.records:
                return  # the first integers of many blocks would pass for the shape of one
    for rank in ranks:
        found = layout.integers(data, rank, rank)
        if found:
            yield from (h for h in _headers(np.array(found)) if h.lengths == (rank,))


def _fits(data: Bytes) -> list[Fit]:
    """Every way to understand the header as a binary one."""
    fits = [
        Fit(layout, header.parts, str(header))
        for layout in layouts.LAYOUTS
        for header in _binary_headers(data, layout)
    ]
    return layouts.likely(fits)


def _are_halves(data: Bytes, fit: Fit) -> bool:
    """Whether 4-byte floats are rather the halves of 8-byte ones.

    Neighbours in a grid are alike; the two halves of a float know nothing of each other.
    """
    begin = sum(4 * part.length for part in fit.parts if part.kind == "i")
    floats = np.frombuffer(data, fit.layout.type("f"), offset=begin)
    with np.errstate(invalid="ignore"):  # NaN of any kind is refused later
        pairs = np.abs(floats[: len(floats) // 2 * 2].reshape(-1, 2))
        pairs = pairs[pairs.any(axis=1)]
        are_apart = pairs.min(axis=1) < pairs.max(axis=1) / 4096
    return len(pairs) > 2 and bool(are_apart.mean() > 0.75)


def _grid(blocks: list[np.ndarray], shapes: tuple[tuple[int, ...], ...], path: Path | str) -> Grid:
    for number, block in enumerate(blocks, 1):
        if not np.isfinite(block).all():
            raise FileError(
                f"{path}: block {number} holds NaN or infinity, expected finite numbers"
            )
    flat = np.concatenate(blocks, axis=1).T
    points = np.zeros((len(flat), 3))
    points[:, : flat.shape[1]] = flat
    return Grid(points, tuple((s[0], s[1], s[2] if len(s) == 3 else 1) for s in shapes))


def _lines(array: np.ndarray) -> Iterator[bytes]:
    """Integers as they are; floats four to a line, as a Fortran reader likes it."""
    if array.dtype.kind == "i":
        yield from text.written(array.reshape(-1, array.shape[-1]))
        return
    whole = len(array) // 4 * 4
    yield from text.written(array[:whole].reshape(-1, 4))
    if whole < len(array):
        yield from text.written(array[None, whole:])
