"""Runs of a program at many values, and the geometries they leave."""

import abc
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from typing_extensions import override

from .._types import Array
from ..errors import FileError, GeometryError, ParameterError, TaskError
from ..mesh import Geometry
from ..mesh.io import read, write
from ..mesh.io.sensitivities import read_sensitivities
from ..workers import AbstractExecutor
from ..workers.programs import Job, ran, settled
from .program_recipe import Recipe


class Place(NamedTuple):
    """What a program is run at: numbers and points, and imaginary parts of both."""

    numbers: np.ndarray
    points: np.ndarray | None
    imaginary: np.ndarray | None = None
    points_imaginary: np.ndarray | None = None


class AbstractRuns(abc.ABC):
    """Runs something foreign at many values.

    Attributes
    ----------
    given
        The geometry that it takes, whose points others replace; None where it takes none.
    """

    given: Geometry | None

    @property
    @abc.abstractmethod
    def labels(self) -> Sequence[str]:
        """A name for each number that it takes."""

    @property
    @abc.abstractmethod
    def told(self) -> str:
        """What messages call it."""

    @abc.abstractmethod
    def points(
        self, places: Sequence[Place], names: Sequence[str], rest: Geometry
    ) -> list[np.ndarray]:
        """Points at each place; `names` are what errors call the places."""

    def imaginary(
        self, places: Sequence[Place], names: Sequence[str], rest: Geometry
    ) -> list[np.ndarray]:
        """Imaginary parts of the points at complex places."""
        raise ParameterError(f"{self.told} does not compute with complex numbers")

    def linearised(self, place: Place, rest: Geometry) -> dict[str, np.ndarray]:
        """Derivatives of the points that it knows itself, by label."""
        raise ParameterError(f"{self.told} knows no derivatives itself")

    @abc.abstractmethod
    def check_seen(self, numbers: np.ndarray, moved: np.ndarray, name: str) -> None:
        """Refuse a step that it would not see."""


class Runs(AbstractRuns):
    """Runs a program, several at a time, and reads what they leave.

    Attributes
    ----------
    recipe
        How the program is run.
    given
        The geometry that it takes, whose points others replace; None where it takes none.
    """

    recipe: Recipe
    given: Geometry | None

    def __init__(
        self,
        recipe: Recipe,
        given: Geometry | None,
        units: str | None,
        format: str | None,
        executor: AbstractExecutor,
    ):
        self.recipe, self.given = recipe, given
        self._units, self._format, self._executor = units, format, executor

    @property
    @override
    def labels(self) -> Sequence[str]:
        return self.recipe.labels

    @property
    @override
    def told(self) -> str:
        return self.recipe.told

    def first(self, numbers: np.ndarray) -> Geometry:
        """The geometry that its own values make."""
        points = None if self.given is None else np.asarray(self.given.points)
        (job,) = self._run([self._job(Place(numbers, points))], ["its own values"])
        return self._read(job, self.recipe.output)

    @override
    def points(
        self, places: Sequence[Place], names: Sequence[str], rest: Geometry
    ) -> list[np.ndarray]:
        found: list[np.ndarray] = []
        several = max(8, 4 * self._executor.count)  # the files in of all need memory
        for start in range(0, len(places), several):
            own = names[start : start + several]
            jobs = [self._job(place) for place in places[start : start + several]]
            for job, name in zip(self._run(jobs, own), own, strict=True):
                found.append(self._checked(self._read(job, self.recipe.output), rest, name))
        return found

    @override
    def imaginary(
        self, places: Sequence[Place], names: Sequence[str], rest: Geometry
    ) -> list[np.ndarray]:
        output = self.recipe.beside(self.recipe.output)
        jobs = self._run(
            [self._job(place, (self.recipe.output, output)) for place in places], names
        )
        return [
            self._checked(self._read(job, output), rest, name)
            for job, name in zip(jobs, names, strict=True)
        ]

    @override
    def linearised(self, place: Place, rest: Geometry) -> dict[str, np.ndarray]:
        recipe = self.recipe
        (job,) = self._run([self._job(place)], ["the linearisation"])
        file = job.place / recipe.linearised
        geometry, columns = read_sensitivities(file, units=self._units)
        self._checked(geometry, rest, "the linearisation")
        missing = [label for label in recipe.labels if label not in columns]
        if missing:
            raise FileError(
                f"{file}: {recipe.told} wrote no derivative by {missing[0]!r}, only by "
                f"{', '.join(columns) or 'nothing'}; take differences, or let it write one"
            )
        return columns

    @override
    def check_seen(self, numbers: np.ndarray, moved: np.ndarray, name: str) -> None:
        zeros, recipe = np.zeros(len(numbers)), self.recipe
        if recipe.parameter_text(numbers, zeros) == recipe.parameter_text(moved, zeros):
            raise ParameterError(
                f"{recipe.parameter_file}: {name} is written with too few digits to be seen to "
                "change by a step: give its place in the template more, as in "
                f"{{{name}:.17g}}, or give a larger step"
            )

    def _run(self, jobs: Sequence[Job], names: Sequence[str]) -> Sequence[Job]:
        """Have all jobs' results in the store."""
        new = {job.key: (name, job) for name, job in zip(names, jobs, strict=True)}
        tasks = {f"{name} ({key[:8]})": job for key, (name, job) in new.items() if not job.is_kept}
        if tasks:
            for job, found in zip(tasks.values(), self._executor.all(ran, tasks), strict=True):
                settled(job, found)
        return jobs

    def _job(self, place: Place, wanted: Sequence[str] = ()) -> Job:
        given: dict[str, bytes] = {}
        if self.given is not None:
            name = self.recipe.input
            given[name] = self._file(name, place.points)
            if self.recipe.is_complex:
                parts = place.points_imaginary
                zeros = np.zeros(self.given.points.shape)
                beside = self.recipe.beside(name)
                given[beside] = self._file(beside, zeros if parts is None else parts)
        outs = dict.fromkeys(filter(None, (self.recipe.output, self.recipe.linearised)))
        return self.recipe.job(place.numbers, given, place.imaginary, wanted or tuple(outs))

    def _file(self, name: str, points: Array | None) -> bytes:
        assert self.given is not None and points is not None
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / Path(name).name
            write(path, self.given.moved(np.asarray(points)), units=self._units)
            return path.read_bytes()

    def _read(self, job: Job, name: str) -> Geometry:
        try:
            return read(job.place / name, units=self._units, format=self._format)
        except FileError as error:
            raise TaskError(f"{self.recipe.told} left what cannot be read: {error}") from None

    def _checked(self, geometry: Geometry, rest: Geometry, name: str) -> np.ndarray:
        """Its points, where its connectivity is that of the program's own values."""
        points = np.asarray(geometry.points, float)
        if points.shape != rest.points.shape:
            raise GeometryError(
                f"{self.recipe.told} makes {len(points)} points for {name}, and "
                f"{len(rest.points)} for its own values: its connectivity must never change; fix "
                "the counts in its input"
            )
        faces, own = (np.asarray(getattr(one, "faces", ())) for one in (geometry, rest))
        if faces.size and own.size and not np.array_equal(faces, own):
            alike = faces.shape == own.shape
            changed = np.flatnonzero((faces != own).any(axis=-1)) if alike else [0]
            raise GeometryError(
                f"{self.recipe.told} joins its points otherwise for {name} than for its own "
                f"values ({len(changed)} faces, first: {changed[0]}): its connectivity must never "
                "change"
            )
        return points
