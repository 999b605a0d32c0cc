"""A Model's Wrapper, somebody else's program: run in a folder of its own, its answer read."""

import os
import shlex
import shutil
import signal
import subprocess
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event

import numpy as np

from ..errors import FileError, ParameterError
from ..mesh import Geometry, Surface
from ..mesh.io import found, read, trix
from ..mesh.io.sensitivities import read_sensitivities
from .chain import Quantity, sensitivities
from .document import Document
from .document import read as read_document
from .exchange import ANSWER, REQUEST, SURFACE, Linearised
from .model import Design

LOG = "wrapper.log"

LIMIT = 600.0
"""Seconds that a run may take, unless told otherwise."""

TOLD = 12
"""Lines at the end of a log that an error shows."""

_PAUSE = 0.05


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


def run(program: Program, request: Document, folder: Path, stop: Event | None = None) -> Reply:
    """Put a request into an empty folder, run the program there, and read its answer.

    What it prints goes to a log in the folder. `stop` ends it from another thread.
    """
    for name in (ANSWER, SURFACE):
        (folder / name).unlink(missing_ok=True)
    shutil.rmtree(folder / "design", ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    request.save(folder / REQUEST)
    start = time.monotonic()
    with (folder / LOG).open("wb") as log:
        try:
            process = subprocess.Popen(
                program.words,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        except OSError as problem:
            reason = (problem.strerror or str(problem)).lower()
            raise FileError(
                f"{folder}: cannot start {shlex.join(program.words)}: {reason}"
            ) from None
        try:
            status = _waited(process, start + program.limit, stop)
        finally:
            _end(process)
    if status is None:
        is_late = stop is None or not stop.is_set()
        why = f"took more than {program.limit:g} s" if is_late else "was stopped"
        raise FileError(f"{folder}: {shlex.join(program.words)} {why}{_log_end(folder)}")
    if status != 0:
        raise FileError(
            f"{folder}: {shlex.join(program.words)} ended with status {status}, expected 0"
            f"{_log_end(folder)}"
        )
    for name in (SURFACE, ANSWER):
        if not (folder / name).is_file():
            raise FileError(
                f"{folder}: {shlex.join(program.words)} left no {name}{_log_end(folder)}"
            )
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


def _waited(process: subprocess.Popen, until: float, stop: Event | None) -> int | None:
    """The status a process ended with; None if it had no more time or was stopped."""
    while (status := process.poll()) is None:
        if time.monotonic() > until or (stop is not None and stop.is_set()):
            return None
        time.sleep(_PAUSE)
    return status


def _end(process: subprocess.Popen) -> None:
    """End a process and all that it started."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError, PermissionError):  # where all of them have ended
            os.killpg(process.pid, signal.SIGKILL)
    elif process.poll() is None:
        process.kill()
    process.wait()


def _log_end(folder: Path) -> str:
    """The last lines of a run's log, as the end of a message."""
    text = (folder / LOG).read_bytes()[-8192:].decode(errors="backslashreplace")
    lines = [line.rstrip() for line in text.splitlines() if line.strip()][-TOLD:]
    shown = "".join(f"\n  | {''.join(c if c.isprintable() else '?' for c in line)}"[:400]
                    for line in lines)  # fmt: skip
    return f"; its log {LOG} ends:{shown}" if lines else f"; its log {LOG} is empty"
