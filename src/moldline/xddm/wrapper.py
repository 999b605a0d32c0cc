"""A Model's Wrapper, somebody else's program: run in a folder of its own, its answer read."""

import shlex
import shutil
import uuid
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import FileError, ParameterError
from ..mesh import Geometry, Surface
from ..mesh.io import found, read, trix
from ..mesh.io.sensitivities import read_sensitivities
from ..workers.programs import executed, last_lines
from .chain import Quantity, sensitivities
from .document import read as read_document
from .exchange import ANSWER, REQUEST, SURFACE, Linearised
from .model import Design

LOG = "wrapper.log"

LIMIT = 600.0
"""Seconds that a run may take, unless told otherwise."""


@dataclass(frozen=True)
class Program:
    """The command of a Wrapper.

    Attributes
    ----------
    words
        The program and its arguments; no shell sees them.
    limit
        How long a run may take [s].
    """

    words: tuple[str, ...]
    limit: float = LIMIT

    def __post_init__(self) -> None:
        if not 0 < self.limit < float("inf"):
            raise ParameterError(f"a time limit is a number of seconds, got {self.limit}")


@dataclass(frozen=True)
class Run:
    """One run of a Wrapper; it can travel to another process.

    Attributes
    ----------
    program
        What is run.
    request
        The document that it finds.
    folder
        Where it is run; all that it leaves stays there.
    """

    program: Program
    request: bytes
    folder: Path


@dataclass(frozen=True)
class Reply:
    """What a run left: surface with derivatives by the names it gave them, and results."""

    linearised: Linearised
    results: dict[str, Quantity]


def program(source: Design, limit: float = LIMIT) -> Program:
    """The Wrapper of a Model; words that are files beside its document become whole paths."""
    text = source.target.get("Wrapper") or ""
    try:
        words = shlex.split(text)
    except ValueError as problem:
        source.document.refuse(source.target, f"Wrapper={text!r}: {str(problem).lower()}")
    if not words:
        source.document.refuse(
            source.target, "has no Wrapper, expected the command that makes its surface"
        )
    folder = source.document.path.parent.resolve()
    whole = [
        str(folder / word) if (k == 0 or "." in word) and (folder / word).is_file() else word
        for k, word in enumerate(words)
    ]
    if not shutil.which(whole[0]):
        source.document.refuse(
            source.target,
            f"Wrapper={text!r}: no program {words[0]!r}; put it beside the document or on the "
            "PATH, and let it be executable",
        )
    return Program(tuple(whole), limit)


def run(one: Run) -> Reply:
    """Put a request into an empty folder, run the program there, and read its answer.

    It works beside the folder, which it replaces when it ends: a second worker with the same run,
    begun where the first seemed dead, writes into none of its files.
    """
    folder, words = one.folder, one.program.words
    directory = folder.with_name(f"{folder.name}-{uuid.uuid4().hex[:8]}")
    directory.mkdir(parents=True)
    (directory / REQUEST).write_bytes(one.request)
    try:
        problem = executed(words, directory, directory / LOG, one.program.limit)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        directory.rename(folder)
    missing = [name for name in (SURFACE, ANSWER) if not (folder / name).is_file()]
    if problem is None and missing:
        problem = f"left no {missing[0]}"
    if problem is not None:
        raise FileError(f"{folder}: {shlex.join(words)} {problem}{_log_end(folder)}")
    return Reply(surface_in(folder), results_in(folder / ANSWER))


def surface_in(folder: Path) -> Linearised:
    """The surface in a folder, with the derivatives there, be they in one file or in several."""
    path = folder / SURFACE
    columns: dict[str, np.ndarray] = {}
    geometry: Geometry
    if found(path) is trix:
        geometry, own = read_sensitivities(path)
        columns |= own
    else:
        geometry = read(path)
    if not isinstance(geometry, Surface):
        raise FileError(f"{path}: is a {type(geometry).__name__}, expected triangles")
    for root in sorted(folder.glob("design/geometry_*/geometry")):
        other, more = read_sensitivities(root)
        if np.shape(other.points) != np.shape(geometry.points):
            raise FileError(f"{root}: its surfaces have other points than {path}")
        columns |= more
    return Linearised(geometry, columns)


def results_in(path: Path) -> dict[str, Quantity]:
    """Analyses of an answer by full names; what is not set is out."""
    design = Design(read_document(path))
    return {
        value.name: Quantity(value.value, sensitivities(design, value.element))
        for value in design.analyses
        if value.value is not None
    }


def _log_end(folder: Path) -> str:
    """The last lines of a run's log, as the end of a message."""
    shown = "".join(f"\n  | {line}" for line in last_lines(folder / LOG))
    return f"; its log {LOG} ends:{shown}" if shown else f"; its log {LOG} is empty"
