"""Blender processes that wait for questions, each with a file open."""

import contextlib
import os
import queue
import subprocess
import tempfile
import threading
import time
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BufferedIOBase
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..errors import FileError, GeometryError, MoldlineError, ParameterError, TaskError
from ..workers.attempt import is_cancelled
from ..workers.programs import last_lines
from .in_blender import frames

ATTEMPTS = 2
"""A question whose process dies is asked this often in all."""

START = 120.0
"""Blender has this long to begin [s]."""

POLL = 0.05
"""How often a process that has not answered is looked at [s]."""

GRACE = 2.0
"""A process has this long to end when its pipe is closed [s]."""

CODE = "import sys; sys.path.append({folder!r}); from in_blender.worker import main; main()"

ERRORS = {"parameter": ParameterError, "geometry": GeometryError, "file": FileError}


@dataclass(frozen=True, eq=False)
class Setup:
    """What a process is told before it is asked: the file, and all that is turned in it."""

    told: Mapping[str, Any]
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)


class Died(Exception):
    """A process ended before it answered."""


def command(interpreter: Path) -> list[str]:
    """What starts the program inside Blender: by Blender itself, or by a Python that has bpy."""
    code = CODE.format(folder=str(Path(__file__).parent))
    if interpreter.name.lower().startswith("blender"):
        return [
            str(interpreter), "--background", "--factory-startup", "--python-exit-code", "1",
            "--python-expr", code,
        ]  # fmt: skip
    return [str(interpreter), "-P", "-c", code]


class Process:
    """One Blender and the pipes to it.

    Attributes
    ----------
    setup
        What it was told to open.
    opened
        What it then said.
    version
        Blender's.
    """

    def __init__(self, interpreter: Path):
        handle, name = tempfile.mkstemp(prefix="moldline_blender_", suffix=".log")
        os.close(handle)
        self._log = Path(name)
        kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
        self._words = command(interpreter)
        try:
            with self._log.open("wb") as printed:
                self.process = subprocess.Popen(
                    self._words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=printed,
                    env=kept, start_new_session=True,
                )  # fmt: skip
        except OSError as error:
            self._log.unlink()
            reason = (error.strerror or str(error)).lower()
            raise TaskError(f"{interpreter}: cannot be started: {reason}") from None
        self.setup: Setup | None = None
        self.opened: frames.Message = {}, {}
        self._answers: queue.SimpleQueue[frames.Message | None] = queue.SimpleQueue()
        stream = cast(BufferedIOBase, self.process.stdout)
        threading.Thread(target=_listen, args=(stream, self._answers), daemon=True).start()
        try:
            self.version = self._answer(START)[0]["version"]
        except BaseException:
            self.end()
            raise

    def ask(
        self, told: Mapping[str, Any], arrays: Mapping[str, np.ndarray], limit: float | None
    ) -> frames.Message:
        """Its answer; whatever it refuses is raised. It is ended where it takes too long."""
        try:
            frames.write(cast(BufferedIOBase, self.process.stdin), told, arrays)
        except OSError:
            raise self._death() from None
        said, found = self._answer(limit)
        if "error" in said:
            kind = ERRORS.get(said["error"])
            raise (kind or TaskError)(said["message"] if kind else self._told(said["message"]))
        return said, found

    def _answer(self, limit: float | None) -> frames.Message:
        deadline = time.monotonic() + (float("inf") if limit is None else limit)
        while True:
            with contextlib.suppress(queue.Empty):
                answer = self._answers.get(timeout=POLL)
                if answer is None:
                    raise self._death()
                return answer
            if is_cancelled():
                self.end()
                raise TaskError("Blender was stopped: what asked it was cancelled")
            if time.monotonic() >= deadline:
                said = self._told(f"took longer than its limit of {limit:g} s; give it more")
                self.end()
                raise TaskError(said)

    def _death(self) -> Died:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(GRACE)
        code = self.process.returncode
        how = "closed its pipe" if code is None else f"ended with status {code}"
        if code is not None and code < 0:
            how = f"was killed by signal {-code}"
        told = self._told(how)
        self.end()
        return Died(told)

    def _told(self, what: str) -> str:
        lines = last_lines(self._log) if self._log.exists() else []
        said = "".join(f"\n    {line}" for line in lines)
        return f"Blender (`{self._words[0]}`) {what}" + (f"; it said last:{said}" if said else "")

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        return self.process.poll() is None

    def end(self, patience: float = 0.0) -> None:
        """Close its pipe, and kill it where it does not end by itself in that time [s]."""
        with contextlib.suppress(OSError):
            cast(BufferedIOBase, self.process.stdin).close()
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._log.unlink(missing_ok=True)


def _listen(stream: BufferedIOBase, answers: "queue.SimpleQueue[frames.Message | None]") -> None:
    """Put answers where they are waited for, and None at the end."""
    with contextlib.suppress(OSError, ValueError):
        if frames.skip_to_hello(stream):
            while (message := frames.read(stream)) is not None:
                answers.put(message)
    answers.put(None)
    with contextlib.suppress(OSError):
        stream.close()


class Pool:
    """Processes of one interpreter: begun as they are needed, kept while the pool is.

    Attributes
    ----------
    interpreter
        The Blender, or the Python that has bpy.
    """

    def __init__(self, interpreter: Path):
        self.interpreter = interpreter
        self._idle: list[Process] = []
        self._lock = threading.Lock()
        weakref.finalize(self, _end_all, self._idle)

    @property
    def idle(self) -> tuple[Process, ...]:
        """Processes that wait."""
        with self._lock:
            return tuple(self._idle)

    def ask(
        self,
        setup: Setup,
        told: Mapping[str, Any] | None = None,
        arrays: Mapping[str, np.ndarray] | None = None,
        limit: float | None = None,
    ) -> tuple[frames.Message, frames.Message]:
        """What a process said when it opened the file, and its answer to what it is asked then.

        Where the process dies, the question is asked once more of another one.
        """
        died = Died()
        for _ in range(ATTEMPTS):
            process = self._taken(setup)
            try:
                if process.setup is not setup:
                    process.setup = None
                    process.opened = process.ask(setup.told, setup.arrays, limit)
                    process.setup = setup
                opened: frames.Message = process.opened
                answer: frames.Message = {}, {}
                if told is not None:
                    answer = process.ask(told, arrays or {}, limit)
                return opened, answer
            except Died as problem:
                died = problem
            except MoldlineError:
                raise
            except BaseException:  # interrupted: what it would answer is no one's
                process.end()
                raise
            finally:
                self._keep(process)
        raise TaskError(f"{died}\nso did the process before; is there too little memory?")

    def close(self) -> None:
        """End what waits; the next question begins a new one."""
        with self._lock:
            idle = self._idle[:]
            self._idle.clear()
        _end_all(idle)

    def _taken(self, setup: Setup) -> Process:
        with self._lock:
            alive = [process for process in self._idle if process.is_alive]
            dead = [process for process in self._idle if process not in alive]
            found = next((one for one in alive if one.setup is setup), alive[-1] if alive else None)
            self._idle[:] = [process for process in alive if process is not found]
        _end_all(dead)
        if found is not None:
            return found
        try:
            return Process(self.interpreter)
        except Died as problem:
            raise TaskError(
                f"{problem}\nit could not begin; `moldline blender make` makes one "
                "that does, or says what is missing"
            ) from None

    def _keep(self, process: Process) -> None:
        if not process.is_alive:
            process.end()
            return
        with self._lock:
            self._idle.append(process)


def _end_all(processes: Sequence[Process]) -> None:
    for process in processes:
        process.end(GRACE)
