"""Airfoil coordinates: two numbers a line, in the order of Selig or of Lednicer.

Selig's files run from the trailing edge over the top side to the leading edge and back along the
bottom side. Lednicer's give the numbers of points on both sides first and then each side from
the leading edge; they are told by those numbers, whole and greater than 1, and turned into Selig's
order. The first line may be a name; else the section is named after the file.

Lost on writing: z, and whether the last point is joined to the first. Coordinates keep every bit.
"""

from pathlib import Path

import numpy as np

from ...errors import FileError, GeometryError
from ..section import Section
from . import text
from .files import contents, replacing

NAME = "airfoil coordinates"
SUFFIXES = (".dat",)
HOLDS = Section


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether there are two numbers on every line but perhaps the first."""
    if not text.is_text(head):
        return False
    first, *rest = text.first_lines(head[: head.rfind(b"\n") + 1] or head, 1000)
    lines = [words for words in rest if words]
    is_lone_number = len(first) == 1 and text.is_number(first[0])
    return not is_lone_number and len(lines) > 1 and all(map(_is_pair, lines))


def read(path: Path | str) -> Section:
    """The section in a file, in Selig's order."""
    data = text.unix(contents(path))
    stripped = data.lstrip()
    skipped = data[: len(data) - len(stripped)].count(b"\n")
    title, _, rest = stripped.partition(b"\n")
    name = Path(path).name.partition(".")[0] or "section"
    if not _is_pair(title.split()):
        name = text.decoded(title.strip())
        data = b"\n" * (skipped + 1) + rest
    rows = text.rows(data, path)
    width = np.diff(rows.starts)
    bad = np.flatnonzero(width != 2)
    if len(bad):
        raise FileError(
            f"{path}: line {rows.lines[bad[0]]}: found {width[bad[0]]} numbers, expected x and y"
        )
    if len(width) < 2:
        raise FileError(f"{path}: the file has {len(width)} points, expected at least 2")
    pairs = _ordered(rows.values.reshape(-1, 2), path)
    return Section(np.column_stack([pairs, np.zeros(len(pairs))]), name)


def write(path: Path | str, section: Section, lednicer: bool = False) -> None:
    """Write in Selig's order, or in Lednicer's."""
    pairs = np.asarray(section.points)[:, :2]
    title = text.title(section.name) or b"section"
    if _is_pair(title.split()):
        title = b"airfoil " + title  # two numbers would pass for a point
    sides = [pairs]
    nose = int(np.argmin(pairs[:, 0]))
    if lednicer and not 0 < nose < len(pairs) - 1:
        raise GeometryError(
            f"{path}: point {nose} has the smallest x and is an end of the section, so it has no "
            "two sides; write it without lednicer=True"
        )
    with replacing(path) as file:
        file.write(title + b"\n")
        if lednicer:
            sides = [pairs[nose::-1], pairs[nose:]]
            file.write(b"%d. %d.\n" % (len(sides[0]), len(sides[1])))
        for side in sides:
            file.write(b"\n" * lednicer)
            file.writelines(text.written(side))


def _is_pair(words: list[bytes]) -> bool:
    return len(words) == 2 and all(map(text.is_number, words))


def _ordered(pairs: np.ndarray, path: Path | str) -> np.ndarray:
    """The points in Selig's order."""
    counts = pairs[0]
    if not ((counts > 1) & (counts == np.floor(counts))).all():
        return pairs
    upper, lower = int(min(counts[0], 1e9)), int(min(counts[1], 1e9))
    if upper + lower != len(pairs) - 1:
        raise FileError(
            f"{path}: {upper} points above and {lower} below need {upper + lower} lines, the file "
            f"has {len(pairs) - 1}; was the copy cut short?"
        )
    top, bottom = pairs[1 : 1 + upper], pairs[1 + upper :]
    is_shared = bool((top[0] == bottom[0]).all())
    return np.concatenate([top[::-1], bottom[int(is_shared) :]])
