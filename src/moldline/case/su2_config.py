"""An SU2 case with FFD boxes, made a case of ours."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from ..errors import FileError, GeometryError
from ..mesh import Section, VolumeMesh
from ..mesh.boundary import boundary
from ..mesh.io import read, write
from ..mesh.io.files import contents, replacing
from ..mesh.io.su2_boxes import Su2Box, read_boxes
from ..mesh.io.text import decoded, unix

KINDS = {
    "11": "FFD_CONTROL_POINT", "13": "FFD_GULL", "14": "FFD_CAMBER", "16": "FFD_THICKNESS",
    "19": "FFD_CONTROL_POINT_2D", "20": "FFD_CAMBER_2D", "21": "FFD_THICKNESS_2D",
}  # fmt: skip
"""Kinds of design variables that move control points, and SU2's numbers of them since version 5."""

Push = tuple[tuple[float, ...], list[tuple[int, ...]]]
"""A direction and the control points that one unit of a variable moves along it."""


@dataclass(frozen=True)
class Design:
    """One design variable of SU2."""

    kind: str
    box: str
    numbers: tuple[float, ...]
    value: float
    place: str


@dataclass(frozen=True)
class Converted:
    """What was made, and what could not be.

    Attributes
    ----------
    variables
        Design variables.
    surface
        The file of the surface that they move.
    notes
        What the user should know.
    """

    variables: int
    surface: Path
    notes: tuple[str, ...]


def convert(source: Path, target: Path) -> Converted:
    """Write a case file, and beside it the surface, from an SU2 configuration and its mesh.

    Variables keep their order within a box, kind and direction, and their values.
    """
    options = _options(source)
    mesh_path = source.parent / _text(options, "MESH_FILENAME", source)
    mesh = read(mesh_path)
    if not isinstance(mesh, VolumeMesh):
        raise GeometryError(f"{mesh_path}: expected an SU2 mesh, got a {type(mesh).__name__}")
    boxes = {box.name: box for box in read_boxes(mesh_path)}
    _check(options, boxes, source, mesh_path)
    designs = list(_designs(options, source))
    markers = _words(_text(options, "DV_MARKER", source))
    surface, _ = boundary(mesh, [name for name in markers if not _is_number(name)])
    suffix = ".dat" if isinstance(surface, Section) else ".tri"
    beside = target.with_name(f"{target.stem}_surface{suffix}")
    write(beside, surface)
    tables = _tables(designs, boxes, mesh.dimension, beside.name, _beside(mesh_path, target))
    with replacing(target) as file:
        file.write(f"# made from {source.name} by moldline convert\n\n".encode())
        file.write(tomli_w.dumps(tables).encode())
    return Converted(len(designs), beside, tuple(_notes(options)))


def _options(path: Path) -> dict[str, tuple[str, int]]:
    """Values and their lines, by keyword; a line without a keyword goes on with the one before."""
    found: dict[str, tuple[str, int]] = {}
    last = None
    for number, line in enumerate(decoded(unix(contents(path))).split("\n"), 1):
        plain = line.split("%")[0].strip().rstrip("\\").strip()
        keyword = re.match(r"([A-Za-z]\w*)\s*=(.*)", plain)
        if keyword:
            last = keyword[1].upper()
            found[last] = (keyword[2].strip(), number)
        elif plain and last:
            found[last] = (f"{found[last][0]} {plain}", found[last][1])
        elif plain:
            raise FileError(f"{path}: line {number}: found {plain[:40]!r}, expected KEYWORD= value")
    return found


def _text(options: dict[str, tuple[str, int]], keyword: str, path: Path) -> str:
    if keyword not in options:
        raise FileError(f"{path}: {keyword}= is missing, so there is no FFD case to convert")
    return options[keyword][0]


def _words(text: str) -> list[str]:
    return [word for word in re.split(r"[\s,()]+", text) if word]


def _is_number(word: str) -> bool:
    return re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", word) is not None


def _check(
    options: dict[str, tuple[str, int]], boxes: dict[str, Su2Box], path: Path, mesh: Path
) -> None:
    """Refuse what would silently come out otherwise than SU2 has it."""
    if not boxes:
        raise FileError(f"{mesh}: the mesh has no FFD box; run SU2_DEF with DV_KIND= FFD_SETTING")
    nested = [box.name for box in boxes.values() if box.parents]
    if nested:
        raise FileError(f"{mesh}: box {nested[0]!r} has parents; nested boxes are not converted")
    system, line = options.get("FFD_COORD_SYSTEM", ("CARTESIAN", 0))
    if system.upper() != "CARTESIAN":
        raise FileError(f"{path}: line {line}: FFD_COORD_SYSTEM= {system}, expected CARTESIAN")


def _designs(options: dict[str, tuple[str, int]], path: Path) -> Iterator[Design]:
    """All design variables, from DEFINITION_DV where it is there, else from DV_KIND."""
    if "DEFINITION_DV" in options:
        text, line = options["DEFINITION_DV"]
        for number, entry in enumerate(_entries(text)):
            head, _, rest = entry.partition("|")
            kind = (_words(head) or [""])[0]
            yield _design(kind, rest.rpartition("|")[2], 0.0, f"{path}: line {line}", number)
        return
    kinds = _words(_text(options, "DV_KIND", path))
    parameters = _entries(_text(options, "DV_PARAM", path))
    values = _words(options.get("DV_VALUE", ("", 0))[0])
    line = options["DV_PARAM"][1]
    if len(parameters) != len(kinds) or len(values) not in (0, len(kinds)):
        raise FileError(
            f"{path}: line {line}: {len(kinds)} kinds of variables, {len(parameters)} parameters "
            f"and {len(values)} values; expected as many of each"
        )
    for number, (kind, entry) in enumerate(zip(kinds, parameters, strict=True)):
        word = values[number] if values else "0"
        if not _is_number(word):
            raise FileError(f"{path}: DV_VALUE: found {word!r}, expected a number")
        yield _design(kind, entry, float(word), f"{path}: line {line}", number)


def _entries(text: str) -> list[str]:
    return [entry for entry in re.findall(r"\(([^()]*)\)", text) if entry.strip()]


def _design(kind: str, entry: str, value: float, where: str, number: int) -> Design:
    name = KINDS.get(kind, kind.upper())
    place = f"{where}: variable {number}"
    if name not in KINDS.values():
        raise FileError(
            f"{place} is of kind {kind!r}; those that move control points are converted: "
            f"{', '.join(sorted(KINDS.values()))}"
        )
    box, *words = _words(entry) or [""]
    bad = next((word for word in words if not _is_number(word)), None)
    if bad is not None:
        raise FileError(f"{place}: found {bad!r}, expected a number behind the name of a box")
    return Design(name, box, tuple(map(float, words)), value, place)


def _tables(
    designs: list[Design], boxes: dict[str, Su2Box], dimension: int, surface: str, mesh: str
) -> dict[str, Any]:
    """The case file: a stage per box, a variable per box, kind and direction."""
    variables: dict[str, Any] = {}
    stages: dict[str, Any] = {}
    groups: dict[tuple[Any, ...], list[tuple[Design, list[Push]]]] = {}
    for design in designs:
        if design.box not in boxes:
            raise FileError(
                f"{design.place}: no box named {design.box!r}; the mesh has: {', '.join(boxes)}"
            )
        pushes = _pushes(design, boxes[design.box].points.shape[:3], dimension)
        directions = tuple(direction for direction, _ in pushes)
        groups.setdefault((design.box, design.kind, directions), []).append((design, pushes))
    for (box, kind, directions), members in groups.items():
        stem = f"{box}_{kind.removeprefix('FFD_').removesuffix('_2D')}".lower()
        alike = sum(key[:2] == (box, kind) for key in groups)
        name = stem if alike == 1 else f"{stem}_{sum(n.startswith(stem) for n in variables) + 1}"
        variables[name] = {"value": [design.value for design, _ in members]}
        stage = stages.setdefault(
            box,
            {
                "deformer": "control_volume", "name": box, "file": mesh, "names": [box],
                "outside": "keep", "carried": bool(stages), "link": [],
            },
        )  # fmt: skip
        for number, direction in enumerate(directions):
            index = [[list(row) for row in pushes[number][1]] for _, pushes in members]
            stage["link"].append(
                {"variable": name, "link": "groups", "direction": list(direction), "index": index}
            )
    geometry = {"surface": {"file": surface}}
    return {"moldline": 1, "geometry": geometry, "variable": variables, "stage": [*stages.values()]}


def _pushes(design: Design, counts: tuple[int, ...], dimension: int) -> list[Push]:
    """What one unit of a variable moves."""
    plane = design.kind.endswith("_2D")
    up = (0.0, 1.0, 0.0) if plane else (0.0, 0.0, 1.0)
    down = tuple(-x for x in up)
    base = design.kind.removesuffix("_2D")
    needed = {
        "FFD_CONTROL_POINT": 4 if plane else 6,
        "FFD_GULL": 1,
        "FFD_CAMBER": 1 if plane else 2,
        "FFD_THICKNESS": 1 if plane else 2,
    }[base]
    if len(design.numbers) < needed:
        raise FileError(f"{design.place}: {len(design.numbers)} numbers, expected {needed}")
    if plane != (dimension == 2):
        raise FileError(f"{design.place}: kind {design.kind} in a mesh of {dimension} dimensions")
    if base == "FFD_GULL":
        return [(up, _rows(design, counts, (-1, design.numbers[0], -1)))]
    if base == "FFD_CONTROL_POINT":
        if plane:
            i, j, x, y = design.numbers[:4]
            return [((x, y, 0.0), _rows(design, counts, (i, j, -1)))]
        i, j, k, *along = design.numbers[:6]
        return [(tuple(along), _rows(design, counts, (i, j, k)))]
    lower, upper = (
        _rows(
            design, counts, (design.numbers[0], side, -1) if plane else (*design.numbers[:2], side)
        )
        for side in (0, 1)
    )
    if base == "FFD_CAMBER":
        return [(up, lower + upper)]
    return [(down, lower), (up, upper)]


def _rows(
    design: Design, counts: tuple[int, ...], place: tuple[float, ...]
) -> list[tuple[int, ...]]:
    """Indices of control points; -1 stands for all along an axis."""
    axes = []
    for number, count in zip(place, counts, strict=True):
        if number != int(number) or not -1 <= number < count:
            raise FileError(f"{design.place}: index {number:g}, expected -1 to {count - 1}")
        axes.append(range(count) if number == -1 else [int(number)])
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return [tuple(row) for row in grid.tolist()]


def _notes(options: dict[str, tuple[str, int]]) -> Iterator[str]:
    if options.get("FFD_CONTINUITY", ("", 0))[0].upper() not in ("", "USER_INPUT"):
        yield (
            "where a surface leaves a box, SU2 also holds the control points next to it "
            "(FFD_CONTINUITY); freeze those sides in the case file"
        )
    held = [key for key in ("FFD_FIX_I", "FFD_FIX_J", "FFD_FIX_K") if key in options]
    if held:
        yield f"{', '.join(held)}: freeze those sides, or take those control points out, by hand"
    if "DEFINITION_DV" in options:
        yield "scales of DEFINITION_DV are left out; all values are 0"


def _beside(mesh: Path, target: Path) -> str:
    """The mesh's path as the case file names it."""
    folder = target.parent.resolve()
    place = mesh.resolve()
    return place.relative_to(folder).as_posix() if place.is_relative_to(folder) else str(place)
