"""Where Blender is: a Blender, or a Python that has it as a module."""

import os
import shutil
import sys
from pathlib import Path

from ..errors import ParameterError

VARIABLE = "MOLDLINE_BLENDER"
"""Environment variable that says where."""

BESIDE = ".venv-blender"
"""An environment of this name in the current folder, or in that of the file, is taken."""

VERSIONS = {"4.5": "3.11", "5.2": "3.13"}
"""Long-term versions of Blender as a Python module, and the Python that each needs."""


def cache() -> Path:
    """The folder of this user where environments are made."""
    if sys.platform == "win32":
        start = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData/Local")
    elif sys.platform == "darwin":
        start = Path.home() / "Library/Caches"
    else:
        start = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return start / "moldline"


def environment(version: str, folder: Path | None = None) -> Path:
    """The folder of the environment that `moldline blender make` makes for a version."""
    return folder or cache() / f"blender-{version}"


def python_of(folder: Path) -> Path:
    """The interpreter of a virtual environment."""
    windows = folder / "Scripts/python.exe"
    return windows if sys.platform == "win32" else folder / "bin/python"


def found_interpreter(given: Path | None = None, beside: Path = Path()) -> Path:
    """The Blender to run: `given`, that of the variable, one made, one beside, or on PATH."""
    if given is not None:
        return _named(str(given), "the key python")
    if own := os.environ.get(VARIABLE):
        return _named(own, f"the environment variable {VARIABLE}")
    folders = [environment(version) for version in VERSIONS]
    folders += [Path(BESIDE).absolute(), (beside / BESIDE).absolute()]
    folders = list(dict.fromkeys(folders))
    for python in map(python_of, folders):
        if python.exists():
            return python
    on_path = shutil.which("blender")
    if on_path:
        return Path(on_path)
    raise ParameterError(
        "there is no Blender: `moldline blender make` makes an environment with it; or say where "
        f"one is, a Blender or a Python that has bpy, with the key python or with {VARIABLE}. "
        f"Looked for: {', '.join(map(str, folders))}, and blender on PATH"
    )


def _named(name: str, where: str) -> Path:
    """A program by its path or by its name on PATH."""
    path = Path(name)
    if path.is_dir() and python_of(path).exists():
        return python_of(path)
    if path.is_file():
        return path.absolute()  # a link of an environment must stay one
    on_path = shutil.which(name)
    if on_path is None:
        raise ParameterError(
            f"{where} says that Blender is {name!r}, and there is no such program; it is a "
            "Blender, a Python that has bpy, or the folder of an environment with one"
        )
    return Path(on_path)
