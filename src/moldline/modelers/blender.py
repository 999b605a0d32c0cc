"""An object of a Blender file as a modeler: its modifiers, with derivatives by differences."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NotRequired

import equinox as eqx
import numpy as np
from typing_extensions import TypedDict, override

from .._types import Vector, is_concrete
from ..errors import GeometryError, ParameterError
from ..mesh import Geometry
from ..numerics.step_control import StepControl
from ..workers import Threads
from ..workers.base import cores
from .base import AbstractModeler
from .blender_found import found_interpreter
from .blender_process import Pool, Setup
from .blender_runs import BlenderRuns, Scene
from .program_kernels import Values
from .program_making import ProgramMaking
from .program_slopes import Slopes

TURN, PART = 0.2, 0.25
"""Steps that matter, unless they are given: of angles [rad] and factors; of lengths, by extent."""

INPUT = 0.05
"""A motion of the points of the geometry that is given, as a part of the extent."""

MOST = 4
"""Processes at a time, unless it is said: each takes a third of a gigabyte or more."""


class Controls(TypedDict):
    """Control positions of an object that are moved.

    Lattice points and vertices of meshes move along the axes of space [m], bones in the
    coordinates of their poses; numbers are changes of what the file has. `points` are numbers of
    them, `group` is a vertex group; without either it is all of them. `together` moves all by the
    same numbers, those of a group by their weights.
    """

    __pydantic_config__ = {"extra": "forbid"}  # type: ignore[misc]  # noqa: RUF012

    object: str
    points: NotRequired[list[int]]
    group: NotRequired[str]
    bones: NotRequired[list[str]]
    motion: NotRequired[Literal["location", "rotation", "scale"]]
    axes: NotRequired[str]
    together: NotRequired[bool]


class Blender(AbstractModeler):
    """Evaluates an object of a .blend file with all its modifiers, in a Blender without a window.

    Parameters are properties, named by their paths in Blender's data, and changes of control
    positions. Where it takes a geometry, that is put into the object's mesh first. The topology
    must never change. Derivatives are differences, with steps that suit single precision.

    Attributes
    ----------
    scene
        What is opened and asked.
    names, own
        Numbers of the parameters by name, and what they are in the file [m, rad, 1].
    trials
        Per number a step that matters; not a number where that is a part of the extent.
    lower, upper
        Between which Blender keeps each number, and no difference leaves.
    is_controlled
        Whether differences choose their steps; else they take the trial steps as they are.
    input_step
        A motion of the given geometry's points that matters [m]; None for a part of their extent.
    executor
        What drives the processes.
    """

    scene: Scene = eqx.field(static=True)
    names: dict[str, np.ndarray]
    own: np.ndarray
    trials: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    is_controlled: bool = eqx.field(static=True)
    input_step: float | None = eqx.field(static=True)
    executor: Threads = eqx.field(static=True)

    def __init__(
        self,
        file: Path,
        object: str,
        *,
        parameters: dict[str, str] | None = None,
        controls: dict[str, Controls] | None = None,
        values: dict[str, float | list[float]] | None = None,
        steps: dict[str, float] | None = None,
        bounds: dict[str, tuple[float, float]] | None = None,
        step_control: bool = True,
        input_step: float | None = None,
        limit: float | None = 120.0,
        workers: int | None = None,
        scripts: bool = False,
        python: Path | None = None,
    ):
        """From a file and the name of an object in it; `parameters` are paths by name.

        `values` replace those of the file, `steps` and `bounds` are by name too. `limit` is the
        time of each answer [s]. `scripts` lets drivers and scripts of the file run Python.
        `python` is a Blender, or a Python that has bpy; else it is looked for.
        """
        file = Path(file).absolute()
        paths, tables = dict(parameters or {}), dict(controls or {})
        if twice := set(paths) & set(tables):
            raise ParameterError(f"both a parameter and controls are named {min(twice)!r}")
        if limit is not None and not limit > 0:
            raise ParameterError(f"a limit is a time above 0 [s], got {limit}")
        told = {
            "do": "open",
            "file": str(file),
            "object": object,
            "scripts": scripts,
            "paths": paths,
            "controls": {name: _completed(name, table) for name, table in tables.items()},
        }
        pool = Pool(found_interpreter(python, file.parent))
        given = pool.ask(Setup(told), limit=limit)[0][0]["given"]
        labels = tuple(label for one in given.values() for label in one["labels"])
        self.scene = Scene(told, labels, limit, pool)
        counts = {name: len(one["values"]) for name, one in given.items()}
        starts = np.cumsum([0, *counts.values()])
        self.names = {
            k: s + np.arange(n) for (k, n), s in zip(counts.items(), starts, strict=False)
        }
        self.own = self._per_number(values or {}, "values", _each(given, "values"))
        self.trials = self._per_number(steps or {}, "steps", _trials(given, self.own))
        low, high = (self._limits(given, bounds or {}, k) for k in (0, 1))
        self.lower, self.upper = low, high
        self.is_controlled, self.input_step = step_control, input_step
        self.executor = Threads(workers or min(cores(), MOST))

    def __check_init__(self) -> None:
        bad = np.flatnonzero((self.trials <= 0) | ~(self.lower < self.upper))
        if len(bad):
            k = bad[0]
            raise ParameterError(
                f"{self.scene.labels[k]!r} needs a step above 0 and a lower bound below the upper "
                f"one, got {self.trials[k]:g} and {self.lower[k]:g}, {self.upper[k]:g}"
            )
        self.check(self.own)

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "Blender":
        places = {k: folder / v for k, v in options.items() if k in ("file", "python") and v}
        return cls(**options | places)

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
        return (0, 1)

    @override
    def check(self, parameters: Vector) -> None:
        if not is_concrete(parameters):
            return
        numbers = np.asarray(parameters, float)
        slack = 1e-6 * np.maximum(1.0, np.abs(numbers))  # limits are single precision
        bad = np.flatnonzero((numbers < self.lower - slack) | (numbers > self.upper + slack))
        if len(bad):
            k = bad[0]
            raise ParameterError(
                f"{self.scene.labels[k]} is {numbers[k]:g}; Blender keeps it from "
                f"{self.lower[k]:g} to {self.upper[k]:g}"
            )

    @override
    def bind(self, *geometries: Geometry, names: Sequence[str] | None = None) -> ProgramMaking:
        """Have it evaluated with its own values, and the geometry's points in its mesh."""
        if len(geometries) > 1:
            raise GeometryError(f"{self.scene.name} takes one geometry, got {len(geometries)}")
        runs = BlenderRuns(self.scene, geometries[0] if geometries else None, self.executor)
        rest = runs.first(self.own)
        extent = float(np.ptp(np.asarray(rest.points), axis=0).max()) or 1.0
        trials = np.where(np.isnan(self.trials), PART * extent, self.trials)
        slopes = Slopes(runs, rest, "differences", trials, (self.lower, self.upper))
        slopes.control = StepControl(not self.is_controlled, runs.rounding)
        slopes.input_trial = self.input_step or INPUT * extent
        return ProgramMaking(rest, Values(slopes))

    def close(self) -> None:
        """Let the processes go that wait; the next question begins new ones."""
        self.scene.pool.close()

    def _per_number(self, given: Mapping[str, Any], what: str, default: np.ndarray) -> np.ndarray:
        found = default.copy()
        for name, value in given.items():
            if name not in self.names:
                raise ParameterError(
                    f"{what} name {name!r}, which is neither a parameter nor controls: "
                    f"{', '.join(self.names) or 'there are none'}"
                )
            numbers = np.asarray(value, float)
            if numbers.shape not in ((), self.names[name].shape):
                raise ParameterError(
                    f"{what} of {name!r} are {numbers.size} numbers; it has {len(self.names[name])}"
                )
            found[self.names[name]] = numbers
        return found

    def _limits(
        self, given: Mapping[str, Any], bounds: Mapping[str, tuple[float, float]], side: int
    ) -> np.ndarray:
        own = np.concatenate(
            [np.zeros(0), *(np.full(len(g["values"]), g["limits"][side]) for g in given.values())]
        )
        wanted = {name: pair[side] for name, pair in bounds.items()}
        found = self._per_number(wanted, "bounds", own)
        return np.maximum(own, found) if side == 0 else np.minimum(own, found)


def _completed(name: str, table: Controls) -> dict[str, Any]:
    """Controls with all that was not said."""
    found: dict[str, Any] = {"motion": "location", "axes": "xyz", "together": False} | {**table}
    axes = found["axes"]
    if not axes or set(axes) - set("xyz") or len(set(axes)) < len(axes):
        raise ParameterError(f"controls {name!r}: axes are some of xyz, got {axes!r}")
    if found["motion"] not in ("location", "rotation", "scale"):
        raise ParameterError(
            f"controls {name!r}: a motion is location, rotation or scale, got {found['motion']!r}"
        )
    if unknown := set(found) - set(Controls.__annotations__):
        known = ", ".join(Controls.__annotations__)
        raise ParameterError(f"controls {name!r} say {min(unknown)!r}; they may say {known}")
    return found


def _each(given: Mapping[str, Any], key: str) -> np.ndarray:
    return np.concatenate([np.zeros(0), *(np.asarray(one[key], float) for one in given.values())])


def _trials(given: Mapping[str, Any], own: np.ndarray) -> np.ndarray:
    kinds = np.array([one["kind"] for one in given.values() for _ in one["values"]], "U8")
    plain = np.maximum(0.1 * np.abs(own), 0.1)
    trials = np.where(np.isin(kinds, ("angle", "factor")), TURN, plain)
    return np.where(kinds == "length", np.nan, trials)
