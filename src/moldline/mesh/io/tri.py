"""Cart3D triangulations: `.tri`, `.i.tri` with components and `.triq` with scalars.

The file holds points and triangles, one whole number per triangle for its component (`.i.tri` and
files with scalars must have them), and any number of scalars per point. It is free-format text, or
binary: either byte order, a raw stream or Fortran records, floats of 4 or 8 bytes; reading finds
out which.

Lost on writing: components' names that are not whole numbers (they are numbered from 1),
components without triangles, data on faces, the names of point data (the first reads back as
`Cp`, the others as `q2`, `q3` ...), and all point data unless the file's name ends in `.triq`.
Text and 8-byte floats keep every bit; 4-byte floats round.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FileError
from ..surface import Surface
from . import binary as layouts
from . import text
from .binary import Fit, Part
from .files import Bytes, loaded, replacing
from .mapped import Run

NAME = "Cart3D tri"
SUFFIXES = (".tri", ".triq")
HOLDS = Surface


LARGEST_ID = 2**53
"""Beyond, doubles are no longer every whole number."""

PROMISE = re.compile(r"\.i\.tri(\.gz)?$", re.IGNORECASE)
"""Names of files that hold components."""


class Counts(NamedTuple):
    """What a header promises."""

    points: int
    faces: int
    scalars: int
    has_ids: bool

    @property
    def parts(self) -> tuple[Part, ...]:
        """The arrays that follow the header."""
        parts = [Part("f", 3 * self.points), Part("i", 3 * self.faces)]
        if self.has_ids:
            parts.append(Part("i", self.faces))
        if self.scalars:
            parts.append(Part("f", self.scalars * self.points))
        return tuple(parts)

    def __str__(self) -> str:
        scalars = f" with {self.scalars} scalars" if self.scalars else ""
        return f"{self.points} vertices{scalars} and {self.faces} triangles"


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether the file begins as a Cart3D triangulation does."""
    if not text.is_text(head):
        size = Path(path).stat().st_size
        return any(fit.size == size for fit in _fits(head))
    header, point = text.first_lines(head, 2)
    if len(header) not in (2, 3) or not all(word.isdigit() for word in header):
        return False
    if len(point) != 3 or not all(map(text.is_number, point)):
        return False
    counts = [int(word[:10]) for word in header] + [0] * (3 - len(header))
    points, faces, scalars = counts
    parts = [Counts(points, faces, scalars, has_ids).parts for has_ids in (False, True)]
    sizes = [len(header) + sum(part.length for part in some) for some in parts]
    return text.may_hold(head, path, sizes[scalars > 0 :])


def read(path: Path | str) -> Surface:
    """The triangulation in a file, whichever variant it is."""
    data = loaded(path)
    if text.is_text(data[:4096]):
        return _read_text(bytes(data), path)
    fit = layouts.fitting(_fits(data), len(data), path)
    header, *parts = fit.layout.split(data, fit.parts, path)
    scalars = int(header[2]) if len(header) == 3 else 0
    has_ids = len(parts) == 3 + (scalars > 0)
    return _surface(Counts(int(header[0]), int(header[1]), scalars, has_ids), parts, path)


def write(
    path: Path | str,
    surface: Surface,
    binary: str | None = None,
    records: bool = False,
    precision: int = 8,
) -> None:
    """Write text, or binary data where `binary` is `"little"` or `"big"`."""
    points = np.asarray(surface.points)
    ids = whole_ids(surface.components)
    has_scalars = ".triq" in Path(path).suffixes
    scalars = _scalars(surface) if has_scalars else []
    header = [len(points), len(surface.faces)] + [len(scalars)] * has_scalars
    arrays = [points, surface.faces + 1]
    if has_scalars or PROMISE.search(str(path)) or surface.components != ("1",):
        arrays.append(ids[surface.tags][:, None])
    if scalars:
        arrays.append(np.stack(scalars, axis=1))
    with replacing(path) as file:
        if binary is None:
            file.write(" ".join(map(str, header)).encode() + b"\n")
            pieces: Iterator[Bytes] = (line for array in arrays for line in text.written(array))
        else:
            layout = layouts.chosen(binary, records, precision)
            pieces = layout.joined([np.array(header), *arrays], path)
        for piece in pieces:
            file.write(piece)


def runs(data: np.ndarray, path: Path | str) -> list[Run]:
    """Where the coordinates lie in the bytes of a binary file."""
    fit = layouts.fitting(_fits(text.binary_head(data, path)), len(data), path)
    return [Run(fit.layout.view(data, fit.parts, 1).reshape(-1, 1, 3))]


def _fits(data: Bytes) -> list[Fit]:
    """Every way to understand the header as a binary one."""
    fits = []
    for layout in layouts.LAYOUTS:
        for length in (2, 3):
            header = layout.integers(data, length, length)
            if header is None or min(header) < 1:
                continue
            scalars = header[2] if length == 3 else 0
            for has_ids in (False, True)[scalars > 0 :]:  # scalars follow components
                counts = Counts(header[0], header[1], scalars, has_ids)
                fits.append(Fit(layout, (Part("i", length), *counts.parts), str(counts)))
    return layouts.likely(fits)


def _read_text(data: bytes, path: Path | str) -> Surface:
    values = text.numbers(data, path)
    header = len(text.first_lines(data[:4096], 1)[0])
    lengths = (header,) if header in (2, 3) else (2, 3)
    options = [option for length in lengths for option in _options(values, length, path)]
    sizes = [length + sum(p.length for p in counts.parts) for length, counts in options]
    if len(values) not in sizes:
        need = min((size for size in sizes if size > len(values)), default=max(sizes))
        counts = options[sizes.index(need)][1]
        advice = "was the copy cut short?" if need > len(values) else "is it another format?"
        raise FileError(
            f"{path}: {counts} need {need} numbers, the file has {len(values)}; {advice}"
        )
    length, counts = options[sizes.index(len(values))]
    ends = np.cumsum([length] + [p.length for p in counts.parts])
    return _surface(counts, np.split(values, ends)[1:-1], path)


def _options(values: np.ndarray, length: int, path: Path | str) -> Iterator[tuple[int, Counts]]:
    """What follows a header of 2 or 3 numbers, without and with components."""
    if len(values) < length:
        raise FileError(f"{path}: the header needs {length} numbers, the file has {len(values)}")
    points = text.count_of(values[0], path, "vertices")
    faces = text.count_of(values[1], path, "triangles")
    scalars = text.count_of(values[2], path, "scalars", least=0) if length == 3 else 0
    for has_ids in (False, True)[scalars > 0 :]:  # scalars follow components
        yield length, Counts(points, faces, scalars, has_ids)


def _surface(counts: Counts, parts: list[np.ndarray], path: Path | str) -> Surface:
    points = parts[0].reshape(-1, 3)
    if not np.isfinite(points).all():
        row = int(np.argwhere(~np.isfinite(points))[0, 0])
        raise FileError(f"{path}: vertex {row + 1} is {points[row]}, expected finite numbers")
    faces = text.indices(
        parts[1].reshape(-1, 3), len(points), path, lambda row: f"triangle {row + 1}"
    )
    if not counts.has_ids and PROMISE.search(str(path)):
        raise FileError(
            f"{path}: has no components, which its name promises; was the copy cut short? "
            "Call it .tri if it is whole"
        )
    tags, components = None, None
    if counts.has_ids:
        ids = parts[2]
        wrong = np.flatnonzero((ids != np.floor(ids)) | (np.abs(ids) > LARGEST_ID))
        if len(wrong):
            raise FileError(
                f"{path}: component ids must be whole numbers, found {ids[wrong[0]]:.15g}"
            )
        names, tags = distinct(ids.astype(np.int64))
        components = tuple(map(str, names.tolist()))
    data = {}
    if counts.scalars:
        columns = parts[-1].reshape(len(points), -1).T
        data = {f"q{i}" if i > 1 else "Cp": column for i, column in enumerate(columns, 1)}
    return Surface(points, faces, tags, components, data)


def distinct(ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The different whole numbers, ascending, and for each of all the place of its own there."""
    low, high = int(ids.min()), int(ids.max())
    if high - low > len(ids):
        return np.unique(ids, return_inverse=True)
    is_used = np.bincount(ids - low) > 0
    return np.flatnonzero(is_used) + low, (np.cumsum(is_used) - 1)[ids - low]


def whole_ids(components: tuple[str, ...]) -> np.ndarray:
    """Whole numbers for the components: their names where those are, else 1, 2, ..."""
    if all(re.fullmatch("0|[1-9][0-9]{0,8}", name) for name in components):
        return np.array([int(name) for name in components], np.int32)
    return np.arange(1, len(components) + 1, dtype=np.int32)


def _scalars(surface: Surface) -> list[np.ndarray]:
    """Point data of one number per point, in the order in which it was read."""
    names = [name for name, data in surface.point_data.items() if np.ndim(data) == 1]
    names.sort(key=lambda name: (name != "Cp", len(name), name))
    return [np.asarray(surface.point_data[name], np.float64) for name in names]
