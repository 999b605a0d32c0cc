"""What a design framework and a geometry server leave for each other in a folder."""

import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import FileError, ParameterError
from ..mesh import Surface
from ..mesh.io.sensitivities import write_sensitivities
from ..mesh.io.text import quoted
from .chain import Quantity, evaluated
from .model import Design
from .results import filled

REQUEST = "model.input.xml"
ANSWER = "model.output.xml"
SURFACE = "Components.i.tri"

LAYOUTS = ("both", "one", "each")
"""Linearised surfaces: all derivatives in one file, each in a file of its own, or both."""


class Linearised(NamedTuple):
    """A surface and the derivatives of its points, (n, 3) each, by full names of variables."""

    surface: Surface
    columns: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Answer:
    """What a server says to a request.

    Attributes
    ----------
    design
        The request.
    surfaces
        By the ID of the Model or of the Intersect.
    results
        Values and derivatives by full names.
    units
        The unit that lengths of the surfaces, which are metres, are written in.
    notes
        What the user should know.
    """

    design: Design
    surfaces: Mapping[str, Linearised]
    results: Mapping[str, Quantity]
    units: str | None = None
    notes: tuple[str, ...] = field(default=())

    def completed(self, given: Mapping[str, Quantity] | None = None) -> "Answer":
        """The same with the request's own expressions; what has no value yet is noted.

        `given` holds results of other documents that they may name.
        """
        waiting: list[str] = []
        known = {**(given or {}), **self.results}
        results = {**self.results, **evaluated(self.design, known, waiting)}
        return Answer(self.design, self.surfaces, results, self.units, (*self.notes, *waiting))


def folder_name(name: str) -> str:
    """A name as that of a folder; what would lead elsewhere is refused."""
    plain = re.sub(r"[\[\],]", "_", name)
    if not re.fullmatch(r"[^/\\:*?\"<>|\x00-\x1f]{1,200}", plain) or not plain.strip("."):
        raise ParameterError(
            f"the ID {quoted(name)} cannot name a folder; use letters, digits, '_' and '-'"
        )
    return plain


def reported(answer: Answer) -> dict[str, Quantity]:
    """Results that the request has a place for; derivatives of those alone that are Required."""
    found = {}
    for name, result in answer.results.items():
        if name in answer.design.by_name:
            is_required = answer.design.by_name[name].is_required
            found[name] = result if is_required else Quantity(result.value)
    return found


def labels(names: Mapping[str, np.ndarray]) -> dict[str, str]:
    """What each derivative is called in a common file: its bare ID, or the full name of twins."""
    bare = {name: name.rpartition("Variable__")[2] for name in names}
    counts = [*bare.values()]
    return {name: one if counts.count(one) == 1 else name for name, one in bare.items()}


def deliver(answer: Answer, folder: Path, layout: str = "both") -> None:
    """Write surfaces and answer; all of it or, where anything fails, nothing.

    All is written beside its place first. The old answer goes before the new surfaces come, and the
    new one comes last: whoever finds an answer finds the surfaces that belong to it.
    """
    if layout not in LAYOUTS:
        raise ParameterError(f"a layout is one of {', '.join(LAYOUTS)}, got {layout!r}")
    document = filled(answer.design, reported(answer))
    with _beside(folder) as stage:
        document.save(stage / ANSWER)
        places: dict[Path, Path] = {}
        for number, (name, linearised) in enumerate(answer.surfaces.items()):
            inner = folder / f"design/geometry_{folder_name(name)}"
            own = folder if len(answer.surfaces) == 1 else inner
            part = stage / str(number)
            part.mkdir()
            places |= _written(part, own, linearised, answer.units, layout)
            if linearised.columns and layout != "one":
                places |= _written_each(part, inner / "geometry", linearised, answer.units)
        (folder / ANSWER).unlink(missing_ok=True)
        for new, place in places.items():
            place.parent.mkdir(parents=True, exist_ok=True)
            new.replace(place)
        (stage / ANSWER).replace(folder / ANSWER)


def _written(
    part: Path, own: Path, linearised: Linearised, units: str | None, layout: str
) -> dict[Path, Path]:
    """The file of all derivatives, or of none: where it is, and where it belongs."""
    columns = {} if layout == "each" else linearised.columns
    named = labels(columns)
    file = part / "Components.trix"
    write_sensitivities(
        file, linearised.surface, {named[name]: c for name, c in columns.items()}, units
    )
    return {file: own / SURFACE}


def _written_each(
    part: Path, root: Path, linearised: Linearised, units: str | None
) -> dict[Path, Path]:
    """A file for each derivative; those that variables had which are no longer there go away."""
    write_sensitivities(
        part / "each", linearised.surface, linearised.columns, units, per_variable=True
    )
    places = {
        file: root / file.parent.name / SURFACE for file in sorted(part.glob(f"each/*/{SURFACE}"))
    }
    old = set(root.glob(f"*/{SURFACE}")) - set(places.values())
    return {gone: part / f"{number}.old" for number, gone in enumerate(sorted(old))} | places


@contextmanager
def _beside(folder: Path) -> Iterator[Path]:
    """A folder within another, which is gone afterwards."""
    stage = folder / f".moldline-{os.getpid()}.part"
    try:
        shutil.rmtree(stage, ignore_errors=True)
        stage.mkdir()
        yield stage
    except OSError as problem:
        reason = (problem.strerror or str(problem)).lower()
        raise FileError(f"{folder}: cannot write the answer: {reason}") from None
    finally:
        shutil.rmtree(stage, ignore_errors=True)
