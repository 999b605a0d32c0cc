# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python environment that has moldline: found, or made by a button."""

import os
import re
import shutil
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

OLDEST = (3, 11)
"""Python that moldline needs."""

_PROBE = "import sys, venv, ensurepip; print(*sys.version_info[:2])"

_QUIETLY = {"creationflags": 0x08000000} if os.name == "nt" else {}
"""Without a console window for each command, on Windows."""

_LOG: deque[str] = deque(maxlen=200)
_making: threading.Thread | None = None


class Unmade(Exception):
    """Why there is no environment, and what to do."""


def folder() -> Path:
    """Where the add-on's own environment is, or will be."""
    return Path(bpy.utils.extension_path_user(__package__, path="environment", create=True))


def python() -> str:
    """The interpreter that has moldline: the user's choice, or the add-on's own."""
    chosen = _chosen()
    if chosen:
        if not Path(chosen).is_file():
            raise Unmade(f"no Python at {chosen}; correct it in the add-on's preferences")
        return chosen
    own = _python_in(folder())
    if not own.is_file():
        raise Unmade("moldline is not installed yet: press 'Make environment'")
    return str(own)


def wheel() -> Path | None:
    """The moldline that came with the add-on."""
    found = sorted((Path(__file__).parent / "moldline").glob("moldline-*.whl"))
    return found[-1] if found else None


def version() -> str:
    """The moldline that the add-on is made for; empty where it came without one."""
    own = wheel()
    return own.name.split("-")[1] if own else ""


def is_own() -> bool:
    """Whether the environment is the add-on's, so that the button can renew it."""
    return not _chosen()


def button() -> str:
    """What the button says."""
    return "Update environment" if _python_in(folder()).is_file() else "Make environment"


def is_made() -> bool:
    """Whether there is an interpreter to start."""
    try:
        python()
    except Unmade:
        return False
    return True


def is_making() -> bool:
    """Whether the button is at work."""
    return _making is not None and _making.is_alive()


def log() -> list[str]:
    """What was said while it was made, the latest last."""
    return list(_LOG)


def progress() -> str:
    """The latest of it, while it is being made."""
    return _LOG[-1] if is_making() and _LOG else ""


def check() -> None:
    """Raise what stands against making one now."""
    if is_making():
        raise Unmade("the environment is being made already")
    if not bpy.app.online_access:
        raise Unmade(
            "Blender may not go online: allow it in Preferences > System > Network, or name the "
            "Python of an environment that has moldline in the add-on's preferences"
        )


def make(then: Callable[[str], None] | None = None) -> None:
    """Make the environment in the background; `then` is told in that thread what went wrong, or "".

    What can be told at once is raised.
    """
    global _making
    check()
    where, own = folder(), wheel()
    _LOG.clear()
    _making = threading.Thread(target=_make, args=(where, own, then), daemon=True)
    _making.start()
    if bpy.app.background:
        _making.join()


def _make(where: Path, own: Path | None, then: Callable[[str], None] | None) -> None:
    said = ""
    try:
        _install(where, own)
    except Unmade as problem:
        said = str(problem)
        _LOG.append(said)
    except Exception as error:  # a thread's error would be seen by nobody
        said = f"the environment could not be made: {error}"
        _LOG.append(said)
    if then is not None:
        then(said)


def _install(where: Path, own: Path | None) -> None:
    """A virtual environment with moldline; one that is there is renewed."""
    program = _python_in(where)
    if not _works(program):
        base = base_python()
        _LOG.append(f"making an environment by {base}")
        shutil.rmtree(where, ignore_errors=True)
        _told([base, "-m", "venv", str(where)], "the environment could not be made")
    _LOG.append("installing moldline and what it needs; this takes a minute or two")
    what = [str(own)] if own else ["moldline"]
    command = [str(program), "-m", "pip", "install", "--upgrade", "--no-input"]
    _told(
        [*command, "--disable-pip-version-check", "--progress-bar", "off", *what],
        "moldline could not be installed; is the package index within reach?",
    )
    if own:  # the same version from another build is no upgrade to pip
        _told(
            [*command, "--disable-pip-version-check", "--force-reinstall", "--no-deps", *what],
            "moldline could not be installed",
        )
    _told([str(program), "-c", "import moldline"], "moldline is installed but does not start")
    _LOG.append("the environment is ready")


def base_python() -> str:
    """A Python that can make environments: Blender's own, or one of the system's."""
    seen = []
    for program in _candidates():
        try:
            told = subprocess.run(
                [program, "-c", _PROBE],
                capture_output=True,
                text=True,
                timeout=60,
                env=_clean(),
                **_QUIETLY,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            seen.append(f"{program}: {error}")
            continue
        if told.returncode:
            reason = (told.stderr.strip().splitlines() or ["no reason given"])[-1]
            seen.append(f"{program}: {reason}")
        elif tuple(map(int, told.stdout.split())) >= OLDEST:
            return program
        else:
            seen.append(f"{program}: is {told.stdout.strip().replace(' ', '.')}")
    raise Unmade(
        f"no Python {OLDEST[0]}.{OLDEST[1]} or later that can make environments "
        f"({'; '.join(seen) or 'none found'}); install one (on Debian and Ubuntu: apt install "
        "python3-venv), or name an environment's Python in the add-on's preferences"
    )


def _candidates() -> Iterator[str]:
    yield sys.executable
    names = ["python3.13", "python3.12", "python3.11", "python3", "python"]
    for name in names:
        found = shutil.which(name)
        if found:
            yield found


def _told(command: list[str], complaint: str) -> None:
    """Run a command; what it says goes into the log."""
    try:
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            text=True,
            errors="replace",
            env=_clean(),
            **_QUIETLY,
        )
    except OSError as error:
        raise Unmade(f"{complaint}: {error}") from None
    assert process.stdout is not None
    last = ""
    for line in process.stdout:
        last = line.strip() or last
        _LOG.append(last)
    if process.wait():
        raise Unmade(f"{complaint}: {last or 'no reason given'}")


def _works(program: Path) -> bool:
    """Whether an interpreter is there and still runs; a renewed Blender may have taken its base."""
    if not program.is_file():
        return False
    try:
        told = subprocess.run(
            [str(program), "-m", "pip", "--version"],
            capture_output=True,
            timeout=60,
            env=_clean(),
            **_QUIETLY,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return told.returncode == 0


def _python_in(where: Path) -> Path:
    """The interpreter of a virtual environment."""
    return where / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def _chosen() -> str:
    held = bpy.context.preferences.addons.get(__package__)
    chosen = held.preferences.python if held and held.preferences else ""
    return bpy.path.abspath(chosen) if chosen else ""


def _clean() -> dict[str, str]:
    """Without what would lead another Python to Blender's libraries."""
    return {
        k: v for k, v in os.environ.items() if not re.fullmatch("PYTHON(HOME|PATH)|__PYVENV.*", k)
    }
