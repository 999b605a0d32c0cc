"""What can be turned in a Blender file, for people."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import ParameterError
from .blender_found import found_interpreter
from .blender_process import Pool, Setup

LIMIT = 120.0
"""Reading a file may take this long [s]."""


def turnable(file: Path, python: Path | None = None) -> list[dict[str, Any]]:
    """For each object of a file: its modifiers, parameters with their paths, control points."""
    pool = Pool(found_interpreter(python, Path(file).absolute().parent))
    try:
        opened, _ = pool.ask(Setup({"do": "list", "file": str(Path(file).absolute())}), limit=LIMIT)
    finally:
        pool.close()
    return list(opened[0]["listed"])


def of_object(listed: Sequence[dict[str, Any]], name: str) -> list[dict[str, Any]]:
    """What is listed of one object."""
    found = [one for one in listed if one["object"] == name]
    if not found:
        known = ", ".join(one["object"] for one in listed)
        raise ParameterError(f"the file has no object {name!r}; there are {known or 'none'}")
    return found


def sentences(listed: Sequence[dict[str, Any]]) -> list[str]:
    """Lines for a person; paths can be put into a case file as they are."""
    lines = []
    for one in listed:
        lines.append(f"{one['object']}  {_kind(one)}")
        paths = [p["path"] for p in one["parameters"]]
        width = max(map(len, paths), default=0)
        for parameter in one["parameters"]:
            lines.append(f"    {parameter['path']:{width}}  {_value(parameter)}")
    return lines


def _kind(one: dict[str, Any]) -> str:
    told = [one["type"].lower()]
    if "shape" in one:
        told.append(" x ".join(map(str, one["shape"])) + f" points, 0 to {one['points'] - 1}")
    elif "points" in one:
        told.append(f"{one['points']} vertices")
    if one.get("bones"):
        told.append("bones " + ", ".join(one["bones"]))
    if one["groups"]:
        told.append("groups " + ", ".join(one["groups"]))
    if one["modifiers"]:
        told.append(
            "modifiers " + ", ".join(f"{m['name']} ({m['type']})" for m in one["modifiers"])
        )
    return "; ".join(told)


def _value(parameter: dict[str, Any]) -> str:
    numbers = parameter["value"]
    own = numbers if isinstance(numbers, list) else [numbers]
    told = ", ".join(f"{number:.6g}" for number in own)
    low, high = parameter["limits"]
    if abs(low) != float("inf") or abs(high) != float("inf"):
        told += f"  ({low:g} to {high:g})"
    if parameter["driver"]:
        told += f"  set by a driver: {parameter['driver']}"
    return told
