"""Somebody else's program as a modeler: parameters and files in, a geometry out."""

import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

import equinox as eqx
import numpy as np
from typing_extensions import override

from .._types import Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Geometry
from ..workers import AbstractExecutor, Threads
from .base import AbstractModeler
from .program_kernels import Values
from .program_making import ProgramMaking
from .program_recipe import Recipe, check_template, given_file, labels, plain_name, words
from .program_runs import Runs
from .program_slopes import Slopes

Derivatives = Literal["differences", "linearised", "complex"]

TRIAL = 0.01
"""A step that matters, as a part of a parameter's value; of 1 where that is 0."""


class Program(AbstractModeler):
    """Runs a command in a directory of its own and reads the geometry that it leaves there.

    The program finds its parameters in a file: JSON, or made from a template with a place such as
    {length} or {radii[1]:.12e} for each number. With `input` it takes a geometry too, as a file.
    Its connectivity must never change. What it left is kept by the content of all it was given, so
    that nothing runs twice.

    Attributes
    ----------
    recipe
        How it is run.
    parameters, values
        Its parameters; numbers are passed as they are (m, rad inside).
    derivatives
        "differences", with steps that suit the program's noise; "linearised", read from what it
        writes; "complex", from imaginary parts that it takes and leaves.
    trials, lower, upper
        Per number a step that matters, and bounds that no difference leaves.
    units, format
        Of the file out and the file in: the unit of length, and the name of the format.
    is_controlled
        Whether differences choose their steps; else they take `steps` as they are.
    input_step
        A motion of the points of the file in that matters [m]; None for a part of their extent.
    executor
        What runs the program, by default as many at a time as there are cores.
    """

    recipe: Recipe = eqx.field(static=True)
    names: dict[str, np.ndarray]
    own: np.ndarray
    derivatives: str = eqx.field(static=True)
    trials: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    units: str | None = eqx.field(static=True)
    format: str | None = eqx.field(static=True)
    is_controlled: bool = eqx.field(static=True)
    input_step: float | None = eqx.field(static=True)
    executor: AbstractExecutor = eqx.field(static=True)

    def __init__(
        self,
        command: str | list[str],
        output: str,
        *,
        parameters: dict[str, float | list[float]] | None = None,
        input: str = "",
        template: Path | None = None,
        parameter_file: str = "",
        files: list[Path] | None = None,
        units: str | None = None,
        format: str | None = None,
        derivatives: Derivatives = "differences",
        linearised: str = "",
        steps: dict[str, float] | None = None,
        bounds: dict[str, tuple[float, float]] | None = None,
        step_control: bool = True,
        input_step: float | None = None,
        limit: float | None = None,
        retries: int = 0,
        environment: dict[str, str] | None = None,
        cache: Path = Path(".moldline"),
        workers: int | None = None,
        executor: AbstractExecutor | None = None,
        folder: Path = Path(),
    ):
        """Paths (`template`, `files`, `cache`) are relative to `folder`, other names to the run's.

        `files` are laid into the program's directory; they decide, with all else that it is given,
        whether it must run again. `steps` and `bounds` are by the parameter's name.
        """
        if derivatives not in get_args(Derivatives):
            known = ", ".join(get_args(Derivatives))
            raise ParameterError(f"a program's derivatives are one of {known}, got {derivatives!r}")
        if (limit is not None and not limit > 0) or retries < 0:
            raise ParameterError(
                f"a program's limit is a time above 0 [s] and its retries a count, got {limit} "
                f"and {retries}"
            )
        arrays = _arrays(parameters or {})
        self.names = _numbered(arrays)
        self.own = np.concatenate([np.zeros(0), *(np.atleast_1d(a) for a in arrays.values())])
        self.derivatives, self.units, self.format = derivatives, units, format
        self.is_controlled, self.input_step = step_control, input_step
        self.executor = executor or Threads(workers)
        self.trials = self._per_number(steps or {}, "steps", _trials(self.own))
        pairs = {k: np.asarray(v, float).reshape(2) for k, v in (bounds or {}).items()}
        low, high = ({k: pair[i] for k, pair in pairs.items()} for i in (0, 1))
        self.lower = self._per_number(low, "bounds", np.full(len(self.own), -np.inf))
        self.upper = self._per_number(high, "bounds", np.full(len(self.own), np.inf))
        text, name = _template(template and folder / template, parameter_file)
        self.recipe = Recipe(
            command=words(command),
            labels=labels(arrays),
            template=text,
            parameter_file=plain_name(name, "parameter file"),
            input=plain_name(input, "input") if input else "",
            output=plain_name(output, "output"),
            linearised=_linearised(derivatives, linearised, output),
            is_complex=derivatives == "complex",
            files=tuple(given_file(folder / path) for path in files or []),
            store=(folder / cache / "programs").absolute(),
            environment=tuple(sorted((environment or {}).items())),
            limit=limit,
            retries=retries,
        )

    def __check_init__(self) -> None:
        check_template(self.recipe)
        bad = np.flatnonzero(~(self.trials > 0) | ~(self.lower < self.upper))
        if len(bad):
            k = bad[0]
            raise ParameterError(
                f"parameter {self.recipe.labels[k]!r} needs a step above 0 and a lower bound below "
                f"the upper one, got {self.trials[k]:g} and {self.lower[k]:g}, {self.upper[k]:g}"
            )

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "Program":
        return cls(folder=folder, **options)

    @classmethod
    @override
    def options(cls) -> dict[str, inspect.Parameter]:
        known = inspect.signature(cls, eval_str=True).parameters
        return {k: p for k, p in known.items() if k not in ("folder", "executor")}

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return self.names

    @property
    @override
    def values(self) -> Vector:
        return self.own

    @property
    @override
    def takes(self) -> tuple[int, float]:
        return (1, 1) if self.recipe.input else (0, 0)

    @override
    def bind(self, *geometries: Geometry, names: Sequence[str] | None = None) -> ProgramMaking:
        """Run it with its own values and the geometry's points: the geometry that it then makes."""
        if len(geometries) != self.takes[0]:
            raise GeometryError(
                f"{self.recipe.told} takes {self.takes[0]} geometries, got {len(geometries)}"
            )
        runs = Runs(
            self.recipe,
            geometries[0] if geometries else None,
            self.units,
            self.format,
            self.executor,
        )
        rest = runs.first(self.own)
        slopes = Slopes(runs, rest, self.derivatives, self.trials, (self.lower, self.upper))
        slopes.control.is_fixed = not self.is_controlled
        slopes.input_trial = self.input_step or slopes.input_trial
        return ProgramMaking(rest, Values(slopes))

    def _per_number(self, given: Mapping[str, float], what: str, default: np.ndarray) -> np.ndarray:
        found = default.copy()
        for name, value in given.items():
            if name not in self.names:
                raise ParameterError(
                    f"a program's {what} name {name!r}, which is none of its parameters: "
                    f"{', '.join(self.names) or 'it has none'}"
                )
            found[self.names[name]] = value
        return found


def _arrays(parameters: Mapping[str, float | list[float]]) -> dict[str, np.ndarray]:
    arrays = {}
    for name, value in parameters.items():
        array = np.asarray(value, float)
        if not name.isidentifier() or name == "imaginary":
            raise ParameterError(f"a parameter's name is a word without spaces, got {name!r}")
        if array.ndim > 1 or not array.size or not np.isfinite(array).all():
            raise ParameterError(f"parameter {name!r} is a finite number or a list, got {value}")
        arrays[name] = array
    return arrays


def _numbered(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    found, start = {}, 0
    for name, array in arrays.items():
        found[name] = np.arange(start, start + array.size)
        start += array.size
    return found


def _trials(values: np.ndarray) -> np.ndarray:
    return TRIAL * np.where(values == 0, 1.0, np.abs(values))


def _template(path: Path | None, name: str) -> tuple[str | None, str]:
    """Text of a template, and the name of the file that it becomes."""
    if path is None:
        return None, name or "parameters.json"
    try:
        return given_file(path).contents.decode(), name or path.name.removesuffix(".template")
    except UnicodeDecodeError as error:
        raise ParameterError(
            f"{path}: is no text: byte {error.start} is not UTF-8; a template is a text file"
        ) from None


def _linearised(derivatives: str, name: str, output: str) -> str:
    if name and derivatives != "linearised":
        raise ParameterError(
            f'linearised = {name!r} is only read with derivatives = "linearised", got '
            f"{derivatives!r}"
        )
    return plain_name(name or output, "linearised output") if derivatives == "linearised" else ""
