"""Values of all variables for each of many shapes: spread evenly, or from a table."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FileError, ParameterError
from .case import Case

MOST = 10**7
"""More samples are a slip of the pen."""


@dataclass(frozen=True)
class Samples:
    """Numbers of all variables, in the designers' units.

    Attributes
    ----------
    sizes
        How many numbers each variable has, by name.
    labels
        A name for each number.
    numbers
        One row per sample, one column per label.
    """

    sizes: dict[str, int]
    labels: tuple[str, ...]
    numbers: np.ndarray

    def __len__(self) -> int:
        return len(self.numbers)

    def values(self, number: int) -> dict[str, np.ndarray]:
        """One sample's values by name."""
        ends = np.cumsum(list(self.sizes.values()))
        parts = np.split(self.numbers[number], ends[:-1])
        return dict(zip(self.sizes, parts, strict=True))


def hypercube(
    case: Case,
    count: int,
    seed: int = 0,
    names: Sequence[str] = (),
    base: Mapping[str, Any] | None = None,
) -> Samples:
    """A Latin hypercube between the bounds of the variables, all that have bounds unless named.

    Each number takes every one of `count` equal parts of its range once. Others keep `base`, or
    the case's values.
    """
    from scipy.stats import qmc

    known = case.pipeline.variables
    if not 1 <= count <= MOST:
        raise ParameterError(f"a sweep takes 1 to {MOST} samples, got {count}")
    for name in names:
        if name not in known:
            raise ParameterError(f"no variable {name!r} to vary; there is: {', '.join(known)}")
    lower, upper = (
        np.array([x for v in known.values() for x in side(v)], float)
        for side in (attrgetter("lower"), attrgetter("upper"))
    )
    labels = [label for variable in known.values() for label in variable.labels()]
    owners = [name for name in known for _ in known[name].value]
    bounded = np.isfinite(lower) & np.isfinite(upper)
    varied = bounded & (lower < upper) & np.isin(owners, list(names) or list(known))
    free = [k for k in np.flatnonzero(~bounded) if owners[k] in names]
    if free or not varied.any():
        which = labels[free[0]] if free else "no variable"
        has = "no bounds" if free else "bounds to sample between"
        raise ParameterError(
            f"{case.path}: {which} has {has}; give bounds = [lower, upper] in the case file, or "
            "a table of values"
        )
    start = _row(case, base)
    numbers = np.tile(start, (count, 1))
    cube = qmc.LatinHypercube(int(varied.sum()), rng=seed).random(count)
    numbers[:, varied] = lower[varied] + cube * (upper - lower)[varied]
    return Samples(_sizes(case), tuple(labels), numbers)


def from_table(case: Case, path: Path, base: Mapping[str, Any] | None = None) -> Samples:
    """One sample per line of a CSV file, whose first line names the numbers: span, twist[0] ...

    Numbers without a column keep `base`, or the case's values.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            head, *rows = [row for row in csv.reader(file) if row] or [[]]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FileError(f"{path}: cannot be read as a CSV table: {error}") from None
    labels = tuple(label for v in case.pipeline.variables.values() for label in v.labels())
    head = [word.strip() for word in head]
    for word in head:
        if word not in labels or head.count(word) > 1:
            why = "twice" if word in labels else "which is no number of a variable"
            raise FileError(f"{path}: the first line names {word!r}, {why}; there is: "
                            f"{', '.join(labels)}")  # fmt: skip
    if not rows:
        raise FileError(f"{path}: has no line of numbers below its first line")
    numbers = np.tile(_row(case, base), (len(rows), 1))
    columns = [labels.index(word) for word in head]
    for k, row in enumerate(rows):
        if len(row) != len(head):
            raise FileError(f"{path}: row {k + 1} has {len(row)} numbers, expected {len(head)}")
        try:
            numbers[k, columns] = [float(word) for word in row]
        except ValueError as error:
            raise FileError(f"{path}: row {k + 1}: {error}") from None
    return Samples(_sizes(case), labels, numbers)


def _sizes(case: Case) -> dict[str, int]:
    return {name: variable.size for name, variable in case.pipeline.variables.items()}


def _row(case: Case, base: Mapping[str, Any] | None) -> np.ndarray:
    values = case.pipeline.values(base)
    return np.concatenate([np.asarray(value) for value in values.values()] or [np.zeros(0)])
