"""An environment with Blender as a Python module, made by one call."""

import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from ..errors import ParameterError, TaskError
from .blender_found import VERSIONS, environment, python_of

PACKAGES = {
    "libEGL.so.1": "libegl1", "libGL.so.1": "libgl1", "libICE.so.6": "libice6",
    "libSM.so.6": "libsm6", "libX11.so.6": "libx11-6", "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6", "libXrender.so.1": "libxrender1", "libXxf86vm.so.1": "libxxf86vm1",
    "libgomp.so.1": "libgomp1", "libxkbcommon.so.0": "libxkbcommon0",
}  # fmt: skip
"""Debian's packages of the system libraries that Blender wants."""

IMPORT_LIMIT = 120.0
"""Blender has this long to be imported [s]."""


def make(version: str, folder: Path | None = None, say: Callable[[str], None] = print) -> Path:
    """Make the environment, or find it made; the interpreter that imports bpy.

    It takes 800 MB, of which 400 MB come from the package index. uv makes it where there is one
    (and finds or fetches the right Python), else a Python of the right version does.
    """
    if version not in VERSIONS:
        known = ", ".join(VERSIONS)
        raise ParameterError(f"Blender {version} is not one that is made; it is one of {known}")
    place = environment(version, folder).absolute()
    python = python_of(place)
    if python.exists() and _problem(python) is None:
        return python
    say(f"making {place}: Blender {version} as a Python module, 800 MB ...")
    place.parent.mkdir(parents=True, exist_ok=True)
    wanted = f"bpy=={version}.*"
    uv, own = _uv(), _python(VERSIONS[version])
    if uv is not None:
        _run([uv, "venv", "--quiet", "--clear", "--python", own or VERSIONS[version], str(place)])
        _run([uv, "pip", "install", "--quiet", "--python", str(python), wanted])
    elif own is not None:
        _run([own, "-m", "venv", "--clear", str(place)])
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        _run([*pip, wanted])
    else:
        raise ParameterError(
            f"Blender {version} as a module needs Python {VERSIONS[version]} exactly, and there is "
            "none on PATH, nor uv, which would fetch it (pip install uv); or install Blender "
            "itself (blender.org) and put `blender` on PATH"
        )
    problem = _problem(python)
    if problem is not None:
        raise TaskError(f"Blender is installed in {place} but does not import: {problem}")
    return python


def missing_libraries(library: Path) -> list[str]:
    """System libraries that a shared library wants and that are not there."""
    if shutil.which("ldd") is None:
        return []
    told = subprocess.run(["ldd", str(library)], capture_output=True, text=True).stdout
    return sorted(set(re.findall(r"^\s*(\S+) => not found", told, re.M)))


def _problem(python: Path) -> str | None:
    """Why it does not import bpy; None where it does."""
    code = "import bpy, os, sys; sys.stdout.flush(); os._exit(0)"  # it may hang in cleaning up
    try:
        trial = subprocess.run(
            [str(python), "-c", code], capture_output=True, text=True, timeout=IMPORT_LIMIT
        )
    except subprocess.TimeoutExpired:
        return f"it took longer than {IMPORT_LIMIT:g} s"
    except OSError as error:
        return (error.strerror or str(error)).lower()
    if trial.returncode == 0:
        return None
    said = (trial.stderr.strip() or f"exit status {trial.returncode}").splitlines()[-1]
    root = python.parent.parent
    libraries = [*root.glob("lib*/python*/site-packages/bpy/__init__.so")]
    absent = missing_libraries(libraries[0]) if libraries else []
    if not absent:
        return said
    packages = " ".join(PACKAGES.get(name, name) for name in absent)
    return (
        f"{said}; system libraries that are not there: {', '.join(absent)}; on Debian and Ubuntu, "
        f"as root: apt-get install {packages}"
    )


def _uv() -> str | None:
    beside = Path(sys.executable).parent / ("uv.exe" if sys.platform == "win32" else "uv")
    return shutil.which("uv") or (str(beside) if beside.exists() else None)


def _python(needed: str) -> str | None:
    """A Python of exactly the version that it needs."""
    for name in (sys.executable, f"python{needed}", "python3", "python"):
        found = shutil.which(name)
        if found is None:
            continue
        code = "import sys; print('%d.%d' % sys.version_info[:2])"
        told = subprocess.run([found, "-c", code], capture_output=True, text=True)
        if told.stdout.strip() == needed:
            return found
    return None


def _run(words: Sequence[str]) -> None:
    """Run it; what it says goes to the error stream."""
    done = subprocess.run(words, stdout=sys.stderr.fileno() if _has_stream() else None)
    if done.returncode:
        raise TaskError(f"`{' '.join(words)}` ended with status {done.returncode}; see above")


def _has_stream() -> bool:
    try:
        return sys.stderr.fileno() >= 0
    except (OSError, ValueError, AttributeError):
        return False
