"""The free-form deformation boxes inside an SU2 mesh (its `FFD_BOX` blocks)."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FileError
from . import su2, text
from .files import contents

MOST_CONTROLS = 1_000_000
"""Control points of one box; more is a damaged file."""


class Su2Box(NamedTuple):
    """One box.

    Attributes
    ----------
    name
        Its tag.
    points
        Control points, shape (nu, nv, nw, 3), in the file's unit; a plane box has two layers.
    degrees
        Of the splines along the three axes; those of a Bezier box are its counts less one.
    parents
        Names of the boxes that carry this one along.
    markers
        Marker of each point that SU2 embedded in it.
    nodes
        Number of each of them among the mesh's points, shape (e,).
    coordinates
        Its box coordinates as SU2 found them, shape (e, 3).
    """

    name: str
    points: np.ndarray
    degrees: tuple[int, int, int]
    parents: tuple[str, ...]
    markers: tuple[str, ...]
    nodes: np.ndarray
    coordinates: np.ndarray


def read_boxes(path: Path | str) -> list[Su2Box]:
    """All boxes of a file; empty if it has none."""
    groups: list[dict[str, su2.Section]] = []
    for section in su2.sections(text.unix(contents(path)), path):
        if section.keyword == "FFD_TAG":
            groups.append({})
        if groups:
            groups[-1].setdefault(section.keyword, section)
    boxes = [_box(group, path) for group in groups]
    names = [box.name for box in boxes]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise FileError(f"{path}: two boxes are named {min(twice)!r}; rename one")
    return boxes


def _box(found: dict[str, su2.Section], path: Path | str) -> Su2Box:
    tag = found["FFD_TAG"]
    name = text.decoded(tag.value)
    where = f"{path}: line {tag.line}: box {name!r}"
    if "FFD_CONTROL_POINTS" not in found:
        raise FileError(f"{where} has no FFD_CONTROL_POINTS; let SU2_DEF write them (FFD_SETTING)")
    counts = tuple(_number(found, f"FFD_DEGREE_{axis}", 1, path) + 1 for axis in "IJK")
    blending = found["FFD_BLENDING"].value if "FFD_BLENDING" in found else b"BEZIER"
    if blending == b"BEZIER":
        orders = counts
    elif blending == b"BSPLINE_UNIFORM":
        orders = tuple(
            min(_number(found, f"BSPLINE_ORDER_{axis}", 2, path), n)
            for axis, n in zip("IJK", counts, strict=True)
        )
    else:
        raise FileError(
            f"{where}: FFD_BLENDING= {text.decoded(blending)}, expected BEZIER or BSPLINE_UNIFORM"
        )
    if min(counts) < 1 or min(orders) < 1:
        raise FileError(f"{where}: degrees {counts} and orders {orders} must be positive")
    markers, nodes, coordinates = _embedded(found.get("FFD_SURFACE_POINTS"), path)
    return Su2Box(
        name,
        _controls(found["FFD_CONTROL_POINTS"], counts, path),
        (orders[0] - 1, orders[1] - 1, orders[2] - 1),
        _names(found.get("FFD_PARENTS")),
        markers,
        nodes,
        coordinates,
    )


def _number(found: dict[str, su2.Section], keyword: str, absent: int, path: Path | str) -> int:
    return su2.whole(found[keyword], path) if keyword in found else absent


def _names(section: su2.Section | None) -> tuple[str, ...]:
    return () if section is None else tuple(text.decoded(w) for w in section.body.split())


def _controls(section: su2.Section, counts: tuple[int, ...], path: Path | str) -> np.ndarray:
    """Control points by their indices."""
    rows = su2.table(section, path)
    total = math.prod(counts)
    if total > MOST_CONTROLS or len(rows.lines) != total:
        raise FileError(
            f"{path}: line {section.line}: {len(rows.lines)} control points, but degrees of "
            f"{' x '.join(str(n - 1) for n in counts)} need {total}"
        )
    if np.any(np.diff(rows.starts) != 6):
        bad = int(np.argmax(np.diff(rows.starts) != 6))
        raise FileError(
            f"{path}: line {rows.lines[bad]}: expected three indices and three coordinates"
        )
    table = rows.values.reshape(-1, 6)
    index = [
        text.indices(table[:, i], n, path, lambda k: f"line {rows.lines[k]}", base=0)
        for i, n in enumerate(counts)
    ]
    flat = np.ravel_multi_index(index, counts)
    if len(np.unique(flat)) != total:
        raise FileError(f"{path}: line {section.line}: two control points have the same indices")
    points = np.empty((total, 3))
    points[flat] = table[:, 3:]
    return points.reshape(*counts, 3)


def _embedded(
    section: su2.Section | None, path: Path | str
) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Markers, node numbers and box coordinates of the points that SU2 embedded."""
    if section is None:
        return (), np.empty(0, int), np.empty((0, 3))
    lines = list(_words(section))
    count = su2.whole(section, path)
    bad = next((line for line, words in lines if len(words) != 5), None)
    if bad is not None or len(lines) != count:
        raise FileError(
            f"{path}: line {bad or section.line}: expected {count} rows of a marker, a node and "
            f"three coordinates, found {len(lines)}"
        )
    body = b"\n".join(b" ".join(words[1:]) for _, words in lines)
    values = text.rows(body, path, section.line + 1).values.reshape(-1, 4)
    nodes = text.indices(values[:, 0], 2**31 - 1, path, lambda k: f"line {lines[k][0]}", base=0)
    return tuple(text.decoded(words[0]) for _, words in lines), nodes, values[:, 1:]


def _words(section: su2.Section) -> Iterator[tuple[int, list[bytes]]]:
    """Line number and words of each row that is not empty."""
    for number, line in enumerate(section.body.split(b"\n"), section.line):
        if line.strip():
            yield number, line.split()
