"""Other people's programs: run in a directory of their own, and never twice with the same input."""

import contextlib
import hashlib
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import TaskError
from .attempt import is_cancelled
from .locks import locked

LOG = "log.txt"
LAST = 15
"""Lines of a log that an error shows."""

POLL = 0.05
"""How often a running program is looked at [s]."""


@dataclass(frozen=True)
class GivenFile:
    """A file that a program finds in its directory."""

    name: str
    contents: bytes
    is_executable: bool = False


@dataclass(frozen=True)
class Job:
    """One run of a program, with all that it needs: it can travel to another machine.

    Attributes
    ----------
    command
        The program and its arguments; it starts in its own directory, where `files` lie.
    files
        What it finds there.
    wanted
        Names of the files that it must leave.
    store
        Folder that keeps what programs made, by the content of what they were given.
    environment
        Variables that it sees on top of this process's own.
    limit
        How long it may take [s].
    retries
        How often it is tried again when it fails.
    """

    command: tuple[str, ...]
    files: tuple[GivenFile, ...]
    wanted: tuple[str, ...]
    store: Path
    environment: tuple[tuple[str, str], ...] = ()
    limit: float | None = None
    retries: int = 0

    @property
    def key(self) -> str:
        """Hash of all that decides on what comes out."""
        digest = hashlib.sha256()
        words = (*self.command, "", *self.wanted, "", *(f"{k}={v}" for k, v in self.environment))
        for part in (w.encode() for w in words):
            digest.update(len(part).to_bytes(8, "big") + part)
        for file in sorted(self.files, key=lambda f: f.name):
            for part in (file.name.encode(), file.contents):
                digest.update(len(part).to_bytes(8, "big") + part)
        return digest.hexdigest()[:40]

    @property
    def place(self) -> Path:
        """Where its results are kept."""
        return self.store / self.key

    @property
    def is_kept(self) -> bool:
        """Whether an earlier run left what is wanted."""
        return all((self.place / name).is_file() for name in self.wanted)

    def kept(self) -> "Ran | None":
        """What an earlier run left, if there was one."""
        try:
            files = {name: (self.place / name).read_bytes() for name in self.wanted}
            return Ran(files, self.place, 0.0, is_new=False)
        except OSError:
            return None


@dataclass(frozen=True)
class Ran:
    """What a program left.

    Attributes
    ----------
    files
        Contents by name.
    place
        Where they and the log are kept.
    seconds
        How long the program took [s]; 0 where nothing had to run.
    is_new
        Whether it had to run.
    """

    files: dict[str, bytes]
    place: Path
    seconds: float
    is_new: bool


def ran(job: Job) -> Ran:
    """Run the program, or take what it left before; who runs the same elsewhere is waited for."""
    kept = job.kept()
    if kept is not None:
        return kept
    (job.store / "running").mkdir(parents=True, exist_ok=True)
    lock = job.store / "running" / f"{job.key}.lock"
    with locked(lock):
        kept = job.kept()
        if kept is not None:
            return kept
        for left in range(job.retries, -1, -1):
            try:
                found = _run(job)
                lock.unlink(missing_ok=True)  # what is kept now needs no lock
                return found
            except TaskError:
                if left == 0 or is_cancelled():
                    raise
    raise AssertionError("a loop that returns or raises")


def _run(job: Job) -> Ran:
    directory = Path(tempfile.mkdtemp(prefix=f"{job.key[:12]}-", dir=job.store / "running"))
    try:
        for file in job.files:
            place = directory / file.name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(file.contents)
            place.chmod(0o755 if file.is_executable else 0o644)
        start = time.perf_counter()
        problem = executed(
            job.command, directory, directory / LOG, job.limit, dict(job.environment)
        )
        seconds = time.perf_counter() - start
        missing = [name for name in job.wanted if not (directory / name).is_file()]
        if problem is None and missing:
            problem = f"ended well but left no {missing[0]!r}"
        if problem is not None:
            raise TaskError(_told(job, _failed(job, directory), problem))
        return Ran(_keep(job, directory), job.place, seconds, is_new=True)
    finally:
        shutil.rmtree(directory, ignore_errors=True)


def executed(
    command: Sequence[str],
    directory: Path,
    log: Path,
    limit: float | None = None,
    environment: Mapping[str, str] | None = None,
) -> str | None:
    """Run a program in a directory to its end; what went wrong, if anything did.

    What it prints goes to the log. It is ended after `limit` [s], or when its task is cancelled,
    and in any case all that it started ends with it.
    """
    deadline = time.monotonic() + (limit if limit is not None else float("inf"))
    with log.open("wb") as printed:
        try:
            process = subprocess.Popen(
                command, cwd=directory, stdin=subprocess.DEVNULL, stdout=printed, stderr=printed,
                env=os.environ | dict(environment or {}),
                start_new_session=True,  # so that what it starts itself can be ended with it
            )  # fmt: skip
        except OSError as error:
            return f"cannot be started: {(error.strerror or str(error)).lower()}"
    try:
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                status = process.wait(POLL)
                return None if status == 0 else _ended(status)
            if time.monotonic() >= deadline:
                return f"took longer than its limit of {limit:g} s; give it more"
            if is_cancelled():
                return "was cancelled"
    finally:
        _end(process)


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a program and all that it started."""
    if not hasattr(os, "killpg"):  # Windows
        process.kill()
        process.wait()
        return
    for number, patience in ((signal.SIGTERM, 1.0), (signal.SIGKILL, None)):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(patience)


def _ended(status: int) -> str:
    return f"ended with status {status}" if status > 0 else f"was killed by signal {-status}"


def _keep(job: Job, directory: Path) -> dict[str, bytes]:
    """Move results to where they are kept, all at once."""
    files = {name: (directory / name).read_bytes() for name in job.wanted}
    for entry in sorted(directory.rglob("*"), reverse=True):
        if entry.is_dir() and not entry.is_symlink():
            with contextlib.suppress(OSError):
                entry.rmdir()
        elif entry.relative_to(directory).as_posix() not in (*job.wanted, LOG):
            entry.unlink()
    with contextlib.suppress(FileNotFoundError):
        shutil.rmtree(job.place)  # something else, which lacked what is wanted
    directory.rename(job.place)
    return files


def _failed(job: Job, directory: Path) -> Path:
    """Keep the directory of a failed run, for a person to look into."""
    place = job.store / "failed" / job.key[:12]
    place.parent.mkdir(exist_ok=True)
    shutil.rmtree(place, ignore_errors=True)
    directory.rename(place)
    return place


def _told(job: Job, place: Path, problem: str) -> str:
    last = "\n".join(f"    {line}" for line in last_lines(place / LOG)) or "    (nothing)"
    return f"`{' '.join(job.command)}` {problem}; its directory: {place}; it said last:\n{last}"


def last_lines(log: Path) -> list[str]:
    """The end of a log, without what might command a terminal."""
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - 8192))
        text = file.read().decode(errors="replace")
    lines = [line.rstrip() for line in text.splitlines() if line.strip()]
    return ["".join(c if c.isprintable() else "?" for c in line)[:300] for line in lines[-LAST:]]


def settled(job: Job, found: Ran) -> None:
    """Have results in this machine's store, where another machine kept them in its own."""
    if job.is_kept:
        return
    job.store.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=f"{job.key[:12]}-", dir=job.store))
    for name, contents in found.files.items():
        (beside / name).parent.mkdir(parents=True, exist_ok=True)
        (beside / name).write_bytes(contents)
    try:
        beside.rename(job.place)
    except OSError:  # another was sooner
        shutil.rmtree(beside, ignore_errors=True)
