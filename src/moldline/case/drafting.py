"""A case's text with one more stage, and a case's text put elsewhere."""

import json
import math
import re
import shutil
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import registry
from ..deformers.net import AbstractControlNet
from ..errors import CaseError, FileError, MoldlineError, ParameterError
from ..mesh import Geometry
from ..mesh.io import read, write
from ..mesh.io.files import replacing
from . import built, editing, schema
from .case import of_text
from .editing import TOLD
from .parameterise import Draft, made, written


class Drafted(NamedTuple):
    """A case's text with one more stage.

    Attributes
    ----------
    text
        Of the case.
    why
        As many controls as there are, and of that kind.
    stage
        Number of the new stage, from 0: it comes before what takes the geometry that it is on.
    variables
        Names of the new variables.
    """

    text: str
    why: str
    stage: int
    variables: list[str]


def drafted(
    text: str,
    folder: Path,
    kind: str,
    *,
    geometry: str | None = None,
    units: str | None = None,
    on: str = "",
    is_bounded: bool = True,
    options: Mapping[str, Any],
) -> Drafted:
    """One more stage of a kind of `parameterise` on a geometry of a case; see `Client.draft`.

    What the stage needs beside the case file is written into the folder.
    """
    options = {name: _tupled(one) for name, one in options.items()}
    if not folder.is_dir():
        raise FileError(f"{folder}: is no folder; make it first")
    if text.strip():
        if geometry is not None or units is not None:
            raise ParameterError(f"{TOLD} says what its geometries are; leave geometry and units")
        return _added(text, folder, kind, on, is_bounded, options)
    if geometry is None:
        raise ParameterError("a new case needs a geometry, a file")
    source = folder / geometry
    draft = made(kind, read(source, units=units), options)
    name = re.sub(r"\W", "_", source.stem) or "geometry"
    _beside(draft, folder, name, units)
    if not is_bounded:
        _free(draft)
    file = _from(folder, source)
    told = written(draft, name, file, units, f"made for {source.name} by moldline; edit it")
    schema.parse(told, TOLD)
    return Drafted(told, draft.why, 0, list(draft.variables))


def relocated(text: str, folder: Path, path: Path, gather: bool = False) -> str:
    """Write a case's text, whose files are named from a folder, to a case file elsewhere.

    Files beneath the case file's folder are named from there, others by their full path. With
    `gather` those that lie in the old folder are copied into the new one. Gives the text.
    """
    schema.parse(text, TOLD)
    target = path.parent.resolve()
    if not target.is_dir():
        raise FileError(f"{path}: there is no folder {target}; make it first")
    tables = tomllib.loads(text)
    edits = []
    if target != folder.resolve():
        for where, old, new in _changes(tables, _absolute(tables, folder)):
            place = Path(new)
            if gather and place.is_file() and place.is_relative_to(folder.resolve()):
                place = _copied(place, target)
            if (name := _from(target, place)) != old:
                edits.append({"set": where, "to": name})
    found = editing.amended(text, edits) if edits else text
    with replacing(path) as stream:
        stream.write(found.encode())
    return found


def _added(
    text: str, folder: Path, kind: str, on: str, is_bounded: bool, options: Mapping[str, Any]
) -> Drafted:
    """On a geometry of the case that is there."""
    tables = schema.parse(text, TOLD)
    makers = {s.to: s for s in tables.stage if isinstance(s, schema.ConstructionTable)}
    names = [*tables.geometry, *makers]
    name = on or (names[0] if len(names) == 1 else "")
    if name not in names:
        raise ParameterError(f"on: got {on!r}, expected one of {', '.join(names)}")
    units = tables.geometry[name].units if name in tables.geometry else None
    draft = made(kind, _geometry(text, folder, tables, name), options)
    _beside(draft, folder, name, units)
    if not is_bounded:
        _free(draft)
    _rename(draft, set(tables.variable))
    takers = [
        i
        for i, stage in enumerate(tables.stage)
        if isinstance(stage, schema.ConstructionTable) and name in stage.of
    ]
    place = takers[0] if takers else len(tables.stage)
    own: dict[str, Any] = {"on": name} if len(names) > 1 else {}
    if _is_led(tables, name, place, draft):
        own["carried"] = True
    head = {key: value for key, value in draft.stage.items() if key == "deformer"}
    table = {**head, **own, **draft.stage, "link": draft.links}
    table = json.loads(json.dumps(table))  # tuples are lists in a case
    edits: list[dict[str, Any]] = [
        {"set": ["variable", key], "to": value} for key, value in draft.variables.items()
    ]
    if tables.stage:
        edits.append({"insert": ["stage", place], "value": table})
    else:
        edits.append({"append": ["stage"], "value": table})
    return Drafted(editing.amended(text, edits), draft.why, place, list(draft.variables))


def _is_led(tables: schema.CaseTable, name: str, place: int, draft: Draft) -> bool:
    """Whether control points, which are put around the geometry at rest, must come along with it.

    Stages before may have moved it by now, or will later.
    """
    is_net = issubclass(registry.deformer(draft.stage["deformer"]), AbstractControlNet)
    before = (s for s in tables.stage[:place] if isinstance(s, schema.StageTable))
    return is_net and any(s.on in ("", name) for s in before)


def _geometry(text: str, folder: Path, tables: schema.CaseTable, name: str) -> Geometry:
    """One of a case's geometries: from its file, or made at the variables' own values."""
    if name in tables.geometry:
        own = tables.geometry[name]
        try:
            return read(folder / own.file, units=own.units)
        except MoldlineError as error:
            raise CaseError(f"{TOLD}: geometry.{name}.file: {error}") from None
    return of_text(text, folder).pipeline.branches[name].geometry


def _tupled(given: Any) -> Any:
    """Lists, as headers have them, as tuples, as Python's interface wants them."""
    return tuple(map(_tupled, given)) if isinstance(given, list) else given


def _beside(draft: Draft, folder: Path, name: str, units: str | None) -> None:
    """Write what the stage reads, under names that are free."""
    for ending, surface in draft.beside.items():
        place = _unused(folder / f"{name}{ending}")
        write(place, surface, units=units)
        draft.stage |= {"file": place.name} | ({"units": units} if units else {})


def _unused(place: Path) -> Path:
    """A path that is free: wing.obj, or wing_2.obj ..."""
    number, found = 1, place
    while found.exists():
        number += 1
        found = place.with_name(f"{place.stem}_{number}{place.suffix}")
    return found


def _free(draft: Draft) -> None:
    """Take the bounds away; what a change that matters is stays."""
    for table in draft.variables.values():
        bounds = np.asarray(table.pop("bounds"), float).reshape(-1, 2)
        span = float(np.min(bounds[:, 1] - bounds[:, 0]))
        if 0 < span < math.inf:
            table["typical"] = float(f"{span / 10:.3g}")


def _rename(draft: Draft, taken: set[str]) -> None:
    """Names of variables that nobody has: move_x, or move_x_2 ..."""
    names: dict[str, str] = {}
    for old in draft.variables:
        number, name = 1, old
        while name in taken or name in names.values():
            number += 1
            name = f"{old}_{number}"
        names[old] = name
    draft.variables = {names[old]: table for old, table in draft.variables.items()}
    draft.links = [{**link, "variable": names[link["variable"]]} for link in draft.links]


def _absolute(tables: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The same tables with full paths."""
    found = dict(tables)
    for kind in ("geometry", "rider"):
        if kind in tables:
            found[kind] = {
                name: {**own, "file": str((folder / own["file"]).resolve())}
                for name, own in tables[kind].items()
            }
    for kind in ("stage", "measure"):
        if kind in tables:
            found[kind] = built.relocated(tables[kind], folder)
    return found


def _changes(
    old: Any, new: Any, where: tuple[str | int, ...] = ()
) -> Iterator[tuple[list[str | int], str, str]]:
    """Texts that differ: where they are, and what they are in both."""
    if isinstance(old, dict):
        for key in old:
            yield from _changes(old[key], new[key], (*where, key))
    elif isinstance(old, list):
        for i, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from _changes(one, other, (*where, i))
    elif isinstance(old, str) and (old != new or Path(old).is_absolute()):
        yield [*where], old, new


def _copied(place: Path, target: Path) -> Path:
    """A copy of a file in a folder; one of the same content that is there serves."""
    there = target / place.name
    if there.is_file() and there.read_bytes() == place.read_bytes():
        return there
    there = _unused(there)
    try:
        shutil.copyfile(place, there)
    except OSError as error:
        raise FileError(f"{there}: cannot be written: {error}") from None
    return there


def _from(folder: Path, place: Path) -> str:
    """A file's path as a case file in the folder names it."""
    base, full = folder.resolve(), place.resolve()
    return full.relative_to(base).as_posix() if full.is_relative_to(base) else str(full)
