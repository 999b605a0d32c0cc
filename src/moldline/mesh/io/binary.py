"""Binary layouts that Fortran and C programs leave behind, told apart by their sizes."""

from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from ..._types import Array
from ...errors import FileError, ParameterError
from .files import Bytes


class Part(NamedTuple):
    """One array in a file: 4-byte integers, or floats of the layout's precision."""

    kind: str
    """`i` or `f`."""
    length: int


class Layout(NamedTuple):
    """How numbers lie in a file."""

    order: str
    """`<` little-endian or `>` big-endian."""
    records: bool
    """Each part stands between two markers that hold its number of bytes (Fortran)."""
    precision: int
    """Bytes of a float, 4 or 8."""

    def __str__(self) -> str:
        order = "little" if self.order == "<" else "big"
        kind = "records" if self.records else "stream"
        return f"{order}-endian {kind} of {self.precision}-byte floats"

    def type(self, kind: str) -> np.dtype:
        """The type of a part's numbers."""
        return np.dtype(f"{self.order}{kind}{4 if kind == 'i' else self.precision}")

    def size(self, parts: Sequence[Part]) -> int:
        """Bytes that a file of these parts has."""
        return sum(p.length * self.type(p.kind).itemsize + 8 * self.records for p in parts)

    def integers(self, data: Bytes, record: int, count: int) -> list[int] | None:
        """The first integers of a file, if its first record is of `record` integers."""
        skip = 4 * self.records
        end = 4 * record + skip
        if len(data) < max(4 * count, end) + skip:
            return None
        values: list[int] = np.frombuffer(data, f"{self.order}i4", count, skip).tolist()
        order: Literal["little", "big"] = "little" if self.order == "<" else "big"
        marker = (4 * record).to_bytes(4, order)
        if self.records and not data[:4] == data[end : end + 4] == marker:
            return None
        return values

    def split(self, data: Bytes, parts: Sequence[Part], path: Path | str) -> list[np.ndarray]:
        """The parts of a file whose size is right, as arrays of this machine's byte order."""
        arrays, at = [], 0
        for part in parts:
            dtype = self.type(part.kind)
            size = part.length * dtype.itemsize
            if self.records:
                self._check_markers(data, at, size, path)
                at += 4
            found = np.frombuffer(data, dtype, part.length, at)
            with np.errstate(invalid="ignore"):  # NaN of any kind is the caller's to refuse
                arrays.append(found.astype(np.float64 if part.kind == "f" else np.int32))
            at += size + 4 * self.records
        return arrays

    def view(self, data: np.ndarray, parts: Sequence[Part], number: int) -> np.ndarray:
        """One part of a file whose size is right, where it lies in the file's bytes."""
        begin = self.size(parts[:number]) + 4 * self.records
        dtype = self.type(parts[number].kind)
        return data[begin : begin + parts[number].length * dtype.itemsize].view(dtype)

    def joined(self, arrays: Sequence[Array], path: Path | str) -> Iterator[Bytes]:
        """The bytes of a file of these arrays."""
        for array in arrays:
            values = narrowed(array, self.type("f" if array.dtype.kind == "f" else "i"), path)
            marker = np.array(values.nbytes, f"{self.order}i4").tobytes() if self.records else b""
            yield from (
                marker,
                np.ascontiguousarray(values).reshape(-1).view(np.uint8).data,
                marker,
            )

    def _check_markers(self, data: Bytes, at: int, size: int, path: Path | str) -> None:
        for place in (at, at + 4 + size):
            found = int(np.frombuffer(data, f"{self.order}i4", 1, place)[0])
            if found != size:
                raise FileError(
                    f"{path}: byte {place}: a record of {found} bytes, expected {size}; "
                    "is the file damaged?"
                )


LAYOUTS = tuple(Layout(*choice) for choice in product("<>", (False, True), (8, 4)))


class Fit(NamedTuple):
    """A way to understand a binary file: how its numbers lie, and which there are."""

    layout: Layout
    parts: tuple[Part, ...]
    what: str
    """What the header counts, for messages."""

    @property
    def size(self) -> int:
        """Bytes the file must have."""
        return self.layout.size(self.parts)


def likely(fits: list[Fit]) -> list[Fit]:
    """Those with records if there are any: two markers that agree are no accident."""
    return [fit for fit in fits if fit.layout.records] or fits


def fitting(fits: Sequence[Fit], size: int, path: Path | str) -> Fit:
    """The one way that explains the file's size; counts are believed only then."""
    for fit in fits:
        if fit.size == size:
            return fit
    if not fits:
        raise FileError(f"{path}: the header of {size} bytes of binary data counts nothing known")
    near = min(fits, key=lambda fit: abs(np.log(fit.size / size)))
    raise FileError(
        f"{path}: as a {near.layout}, {near.what} need {near.size} bytes, "
        f"the file has {size}; was the copy cut short?"
    )


def chosen(binary: str, records: bool, precision: int) -> Layout:
    """The layout a caller names in words."""
    if binary not in ("little", "big"):
        raise ParameterError(f"binary must be 'little' or 'big', got {binary!r}")
    if precision not in (4, 8):
        raise ParameterError(f"precision must be 4 or 8 bytes, got {precision}")
    return Layout("<" if binary == "little" else ">", records, precision)


def narrowed(array: Array, dtype: np.dtype, path: Path | str) -> np.ndarray:
    """The values in a file's type; refuses those that would become infinite."""
    with np.errstate(over="ignore", under="ignore"):
        values = np.asarray(array).astype(dtype)
    if not np.isfinite(values).all():
        largest = float(np.abs(array).max())
        raise FileError(f"{path}: {largest:.3g} does not fit a float of {dtype.itemsize} bytes")
    return values
