"""What a program is called with: its command, its parameter file, its files in and out."""

import json
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from ..errors import FileError, ParameterError
from ..workers.programs import LOG, GivenFile, Job

IMAGINARY = "_imaginary"
"""What the names of files with imaginary parts have behind their stems."""

PLACE = re.compile(r"\{(\w+)(?:\[(\d+)\])?(\.imag)?(:[^{}]*)?\}")


@dataclass(frozen=True)
class Recipe:
    """How a program is run; everything but numbers and the geometry that it takes.

    Attributes
    ----------
    command
        The program and its arguments.
    labels
        A name for each number of the parameters: length, or radii[0] radii[1] ...
    template
        Text of the parameter file with places for numbers; None for JSON.
    parameter_file, input, output, linearised
        Names of the files in the program's directory; `input` is empty where it takes none, and
        `linearised` where derivatives are not read.
    is_complex
        Whether it takes and leaves imaginary parts.
    files
        What else it finds there.
    store, environment, limit, retries
        As a `Job` has them.
    """

    command: tuple[str, ...]
    labels: tuple[str, ...]
    template: str | None
    parameter_file: str
    input: str
    output: str
    linearised: str
    is_complex: bool
    files: tuple[GivenFile, ...]
    store: Path
    environment: tuple[tuple[str, str], ...]
    limit: float | None
    retries: int

    @property
    def told(self) -> str:
        """The command, for messages."""
        return f"`{' '.join(self.command)}`"

    def job(
        self,
        numbers: np.ndarray,
        given: Mapping[str, bytes],
        imaginary: np.ndarray | None,
        wanted: Sequence[str],
    ) -> Job:
        """One run; `given` are the geometry files that it takes, `wanted` those that it leaves."""
        parts = np.zeros(len(numbers)) if imaginary is None else imaginary
        text = self.parameter_text(np.asarray(numbers, float), np.asarray(parts, float))
        own = [GivenFile(self.parameter_file, text.encode())]
        own += [GivenFile(name, contents) for name, contents in given.items()]
        return Job(
            self.command, (*self.files, *own), tuple(wanted), self.store,
            self.environment, self.limit, self.retries,
        )  # fmt: skip

    def parameter_text(self, numbers: np.ndarray, imaginary: np.ndarray) -> str:
        """The parameter file's contents."""
        values = dict(zip(self.labels, numbers.tolist(), strict=True))
        parts = dict(zip(self.labels, imaginary.tolist(), strict=True))
        if self.template is None:
            found = _nested(values)
            if self.is_complex:
                found["imaginary"] = _nested(parts)
            return json.dumps(found, indent=1) + "\n"

        def number(match: re.Match[str]) -> str:
            label = _label(match)
            if label not in values:
                return match[0]
            value = (parts if match[3] else values)[label]
            return format(value, match[4][1:]) if match[4] else repr(value)

        return PLACE.sub(number, self.template)

    def beside(self, name: str) -> str:
        """The name of the file with the imaginary parts of a geometry."""
        path = PurePosixPath(name)
        return str(path.with_name(f"{path.stem}{IMAGINARY}{path.suffix}"))


def check_template(recipe: Recipe) -> None:
    """Refuse a template that leaves a parameter out or asks for what is no format."""
    if recipe.template is None:
        return
    used = {(_label(m), bool(m[3])) for m in PLACE.finditer(recipe.template)}
    kinds = (False, True) if recipe.is_complex else (False,)
    for label in recipe.labels:
        for is_imaginary in kinds:
            if (label, is_imaginary) not in used:
                place = f"{{{label}{'.imag' if is_imaginary else ''}}}"
                raise ParameterError(
                    f"{recipe.parameter_file}: the template has no {place}, so the program would "
                    "never see that parameter; put it in, perhaps with a format as in "
                    f"{place[:-1]}:.17g}}"
                )
    numbers = np.zeros(len(recipe.labels))
    try:
        recipe.parameter_text(numbers, numbers)
    except (ValueError, TypeError) as error:
        raise ParameterError(
            f"{recipe.parameter_file}: the template has a format that numbers do not take: {error}"
        ) from None


def labels(parameters: Mapping[str, np.ndarray]) -> tuple[str, ...]:
    """A name for each number: those of lists are counted."""
    return tuple(
        label
        for name, numbers in parameters.items()
        for label in (
            [name] if numbers.ndim == 0 else [f"{name}[{i}]" for i in range(len(numbers))]
        )
    )


def words(command: str | Sequence[str]) -> tuple[str, ...]:
    """The command in words; {python} is the interpreter that runs this."""
    found = shlex.split(command) if isinstance(command, str) else list(command)
    if not found:
        raise ParameterError("a program's command is empty; name the program and its arguments")
    return tuple(word.replace("{python}", sys.executable) for word in found)


def plain_name(name: str, what: str) -> str:
    """A name of a file within the program's directory."""
    path = PurePosixPath(name)
    if not name or path.is_absolute() or ".." in path.parts or name == LOG or "\0" in name:
        raise ParameterError(
            f"a program's {what} is a file in its own directory, got {name!r}; name it without a "
            f"folder above it, and not {LOG}"
        )
    return str(path)


def given_file(path: Path) -> GivenFile:
    """A file that is laid into the program's directory, by its own name."""
    try:
        contents = path.read_bytes()
        return GivenFile(path.name, contents, bool(path.stat().st_mode & 0o111))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise FileError(f"{path}: cannot be read for the program: {reason}") from None


def _label(match: re.Match[str]) -> str:
    return match[1] if match[2] is None else f"{match[1]}[{match[2]}]"


def _nested(values: Mapping[str, float]) -> dict[str, float | list[float] | dict]:
    """By name, with counted ones as lists."""
    found: dict = {}
    for label, value in values.items():
        name, bracket, _ = label.partition("[")
        if bracket:
            found.setdefault(name, []).append(value)
        else:
            found[name] = value
    return found
