"""Variable values from the command line."""

import argparse
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..case import Case


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments of every command that runs a case."""
    command.add_argument("case", type=Path, help="case file (TOML)")
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        dest="changes",
        help="a variable's value: thickness=0.1,0,0 or one of its numbers: thickness[2]=0.05",
    )
    command.add_argument(
        "--values", type=Path, metavar="FILE", help="JSON file of values: {name: number or list}"
    )
    command.add_argument(
        "--jobs", type=count, metavar="N", help="processor cores to use; all without it"
    )


def count(text: str) -> int:
    """A number of at least 1."""
    if not text.isdecimal() or not int(text):
        raise argparse.ArgumentTypeError(f"expected a count of at least 1, got {text!r}")
    return int(text)


def chosen(case: "Case", given: argparse.Namespace) -> dict[str, Any]:
    """The case's values with those of `--values` and then `--set` in their place."""
    changes: dict[str, Any] = {}
    if given.values is not None:
        changes.update(_from_file(given.values))
    own = case.pipeline.variables
    for text in given.changes:
        name, index, given_numbers = _assignment(text)
        if index is None:
            changes[name] = given_numbers
            continue
        if name not in own or index >= own[name].size or len(given_numbers) != 1:
            size = own[name].size if name in own else 0
            raise _problem(f"--set {text}: {name!r} has {size} numbers, counted from 0")
        present = changes.get(name, own[name].value)
        present = [present] if isinstance(present, float | int) else list(present)
        if index >= len(present):
            raise _problem(f"{given.values}: {name!r} has {own[name].size} numbers, got {present}")
        present[index] = given_numbers[0]
        changes[name] = present
    return case.values(changes)


def _assignment(text: str) -> tuple[str, int | None, list[float]]:
    match = re.fullmatch(r"\s*(\w+)\s*(?:\[(\d+)\])?\s*=(.+)", text)
    if match is None:
        raise _problem(f"--set {text}: expected NAME=VALUE, NAME=V,V,... or NAME[i]=VALUE")
    return match[1], int(match[2]) if match[2] else None, numbers(match[3], f"--set {text}")


def numbers(text: str, where: str) -> list[float]:
    """Numbers between commas."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise _problem(f"{where}: {text!r} is not a list of numbers") from None


def _from_file(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise _problem(f"{path}: cannot be read as JSON: {error}") from None
    if not isinstance(found, dict):
        raise _problem(f"{path}: expected an object of values by name, got {found!r:.40}")
    for name, value in found.items():
        each = value if isinstance(value, list) else [value]
        if not all(isinstance(one, float | int) for one in each):
            raise _problem(f"{path}: {name} must be a number or a list of them, got {value!r:.40}")
    return found


def _problem(text: str) -> Exception:
    from ..errors import ParameterError

    return ParameterError(text)
