"""An ensemble of a case's shapes: measured, written and drawn, one by one and never twice."""

import contextlib
import hashlib
import json
from collections.abc import Generator
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import CaseError, FileError, GeometryError, ParameterError
from ..mesh.io import write
from ..mesh.io.files import replacing
from ..workers import AbstractExecutor
from ..workers.locks import locked
from .case import Case, load
from .samples import Samples
from .sweep_tables import write_tables

PLAN, RECORDS = "sweep.json", "records.jsonl"

ALONE = {
    **dict.fromkeys(("MOLDLINE_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
}
"""Workers share the cores: each takes one."""


@dataclass(frozen=True)
class Record:
    """What came of one sample: measures by name, or an error."""

    number: int
    measures: dict[str, list[float]]
    is_within: bool
    error: str | None
    seconds: float


@dataclass(frozen=True)
class Order:
    """One sample for a worker, with all that it needs."""

    case: Path
    files: dict[str, str]
    values: dict[str, list[float]]
    shape: Path | None
    picture: Path | None


class Sweep:
    """A folder with what is to be made of a case, and what is made already.

    It is begun anew or gone on with: samples that are finished stay. A case or samples that have
    changed since are refused.

    Attributes
    ----------
    case, samples, folder
        What is sampled, where, and where records go.
    shapes, format, pictures
        Folders for the geometries, in which format, and for pictures; None for none.
    records
        What is done, by number.
    """

    def __init__(
        self,
        case: Case,
        samples: Samples,
        folder: Path,
        *,
        shapes: Path | None = None,
        format: str = "tri",
        pictures: Path | None = None,
        is_anew: bool = False,
    ):
        if not (case.measurements.constraints or shapes or pictures):
            raise ParameterError(
                f"{case.path}: has no measures, so there is nothing to record: add a table such as "
                '[measure.volume] with measure = "volume", or ask for shapes'
            )
        self.case, self.samples, self.folder = case, samples, folder
        self.shapes, self.format, self.pictures = shapes, format, pictures
        self._files = fingerprints(case)
        self.records: dict[int, Record] = {}
        for place in (folder, shapes, pictures):
            if place is not None:
                place.mkdir(parents=True, exist_ok=True)
        if is_anew:
            for name in (PLAN, RECORDS):
                (folder / name).unlink(missing_ok=True)
        self._check_plan()
        self.records = _read_records(folder / RECORDS, samples)

    def waiting(self, is_retried: bool = False) -> list[int]:
        """Numbers of the samples that are not finished; with `is_retried` failed ones are not."""
        return [
            number for number in range(len(self.samples)) if not self._is_done(number, is_retried)
        ]

    def run(
        self, executor: AbstractExecutor, limit: float | None = None, is_retried: bool = False
    ) -> Generator[Record, None, None]:
        """Do what is not finished; each record as it comes, kept before it is told.

        Whoever stops listening, or is interrupted, can go on later. Tables are written at the end.
        """
        with locked(self.folder / "lock", is_patient=False):
            numbers = self.waiting(is_retried)
            tasks = {f"sample {number}": self._order(number) for number in numbers}
            with (
                (self.folder / RECORDS).open("ab") as file,
                contextlib.closing(executor.run(sampled, tasks, limit)) as outcomes,
            ):
                try:
                    for outcome in outcomes:
                        number = numbers[outcome.number]
                        found = outcome.value or {"measures": {}, "is_within": False}
                        problem = None if outcome.error is None else str(outcome.error)
                        record = Record(number, **found, error=problem, seconds=outcome.seconds)
                        file.write(json.dumps(asdict(record)).encode() + b"\n")
                        file.flush()
                        self.records[number] = record
                        yield record
                finally:
                    write_tables(self)

    def _is_done(self, number: int, is_retried: bool) -> bool:
        record = self.records.get(number)
        if record is None or (is_retried and record.error is not None):
            return False
        order = self._order(number)
        wanted = [place for place in (order.shape, order.picture) if place is not None]
        return record.error is not None or all(place.exists() for place in wanted)

    def _order(self, number: int) -> Order:
        name = f"{number:0{len(str(len(self.samples) - 1))}}"
        return Order(
            self.case.path.resolve(),
            self._files,
            {k: v.tolist() for k, v in self.samples.values(number).items()},
            self.shapes.resolve() / f"{name}.{self.format}" if self.shapes else None,
            self.pictures.resolve() / f"{name}.png" if self.pictures else None,
        )

    def _check_plan(self) -> None:
        """Write down what is sampled, or compare it with what was."""
        digest = hashlib.sha256(np.ascontiguousarray(self.samples.numbers).tobytes()).hexdigest()
        plan = {"samples": len(self.samples), "numbers": digest, "files": self._files}
        place = self.folder / PLAN
        if not place.exists():
            with replacing(place) as file:
                file.write(json.dumps(plan, indent=1).encode() + b"\n")
            return
        try:
            old = json.loads(place.read_bytes())
            files: dict[str, str] = old["files"]
            was = old["samples"], old["numbers"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise FileError(f"{place}: is no sweep of ours: {error}; name another folder") from None
        changed = [k for k in {**files, **self._files} if files.get(k) != self._files.get(k)]
        if was != (len(self.samples), digest):
            changed.append(f"the samples (then {was[0]}, now {len(self.samples)})")
        if changed:
            raise CaseError(
                f"{self.case.path}: {', '.join(changed)} changed since the sweep in {self.folder} "
                "was begun, so that its samples no longer fit; name another folder, or begin anew "
                "with --restart"
            )


def sampled(order: Order) -> dict[str, Any]:
    """On a worker: measure one sample, write and draw it; a file appears only when it is whole."""
    case = _case(order.case, tuple(sorted(order.files.items())))
    values = case.values(order.values)
    numbers = case.measurements(values) if case.measurements.constraints else {}
    for name, found in numbers.items():
        if not np.isfinite(found).all():
            raise GeometryError(f"measure {name!r} is {found[~np.isfinite(found)][0]}")
    if order.shape is not None or order.picture is not None:
        geometry = case.pipeline(values)
        if order.shape is not None:
            write(order.shape, geometry, units=case.units())
        if order.picture is not None:
            from ..plot import pictures, save

            save(pictures.of_geometry(geometry, title=order.picture.stem), order.picture)
    return {
        "measures": {name: found.tolist() for name, found in numbers.items()},
        "is_within": not case.measurements.beyond(numbers) if numbers else True,
    }


@lru_cache(maxsize=1)
def _case(path: Path, files: tuple[tuple[str, str], ...]) -> Case:
    """The case, once per worker, if it is still the one that the sweep was begun with."""
    case = load(path)
    if fingerprints(case) != dict(files):
        raise CaseError(f"{path}: it, or a file that it names, has changed since the sweep began")
    return case


def fingerprints(case: Case) -> dict[str, str]:
    """Hashes of the case file and of all files that it names, by their names in it."""
    folder = case.path.parent
    named = {case.path.name: case.path}
    for word in _words(case.tables.model_dump(exclude={"output"})):
        with contextlib.suppress(OSError, ValueError):
            if (folder / word).is_file():
                named[word] = folder / word
    found = {}
    for name, path in named.items():
        with path.open("rb") as file:
            found[name] = hashlib.file_digest(file, "sha256").hexdigest()
    return found


def _words(table: Any) -> Generator[str, None, None]:
    if isinstance(table, dict):
        table = list(table.values())
    if isinstance(table, list | tuple):
        for one in table:
            yield from _words(one)
    elif isinstance(table, str) and table:
        yield table


def _read_records(path: Path, samples: Samples) -> dict[int, Record]:
    """What an earlier run left; a line that an interruption cut short is taken off."""
    if not path.exists():
        return {}
    whole = path.read_bytes()
    kept = whole[: whole.rfind(b"\n") + 1]
    if len(kept) < len(whole):
        with replacing(path) as file:
            file.write(kept)
    found = {}
    for number, line in enumerate(kept.splitlines(), 1):
        try:
            record = Record(**json.loads(line))
        except (ValueError, TypeError) as error:
            raise FileError(f"{path}: line {number} is no record: {error}") from None
        if 0 <= record.number < len(samples):
            found[record.number] = record
    return found
