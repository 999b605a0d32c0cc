"""A case as a Model: its variables, measures and bounds in XDDM's words."""

import math
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..case import Case
from ..parameters.variable import Variable
from .document import Document, made
from .edit import Draft
from .measure_table import attribute
from .numbers import written


class Modelled(NamedTuple):
    """A Model's document, and what it could not say."""

    document: Document
    notes: tuple[str, ...]


def to_model(case: Case, path: Path | str = "model.xml") -> Modelled:
    """A case as a Model's document, which is to be saved as `path`.

    It names the case file, which still says what deforms what. A number whose two bounds are equal
    is a Constant. Each number of a measure is an Analysis, its bounds are a Constraint.
    """
    place = Path(path)
    attributes = {
        "ID": re.sub(r"\W+", "_", case.path.stem),
        "Modeler": "moldline",
        "Case": _beside(case.path, place),
        "Wrapper": f"moldline serve {place.name}",
    }
    children = [
        Draft("Configure", {"Sensitivity": "Required"}),
        *(one for variable in case.pipeline.variables.values() for one in _inputs(variable)),
        *(one for name in case.tables.measure for one in _analyses(case, name)),
        *(one for name in case.tables.measure for one in _constraints(case, name)),
    ]
    return Modelled(made(Draft("Model", attributes, children), place), tuple(_untold(case)))


def exact(value: float) -> str:
    """A number in as few digits as give it back."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)


def _beside(case: Path, model: Path) -> str:
    """The case file as the Model names it."""
    try:
        place = os.path.relpath(case.resolve(), model.resolve().parent)
    except ValueError:  # on another drive
        return case.resolve().as_posix()
    return Path(place).as_posix()


def _inputs(variable: Variable) -> Iterator[Draft]:
    rows = zip(variable.labels(), variable.value, variable.lower, variable.upper, strict=True)
    for label, value, lower, upper in rows:
        attributes = {"ID": label, "Value": written("Value", value)}
        is_constant = lower == upper == value
        if not is_constant:
            attributes |= _bounds(lower, upper)
        attributes["TypicalSize"] = exact(variable.typical)
        if variable.unit:
            attributes["Unit"] = variable.unit
        yield Draft("Constant" if is_constant else "Variable", attributes)


def _bounds(lower: float, upper: float) -> dict[str, str]:
    bounds = {"Min": lower, "Max": upper}
    return {name: exact(bound) for name, bound in bounds.items() if math.isfinite(bound)}


def measure_labels(name: str, size: int) -> list[str]:
    """What the numbers of a measure are called."""
    return [name] if size == 1 else [f"{name}[{i}]" for i in range(size)]


def _analyses(case: Case, name: str) -> Iterator[Draft]:
    size = case.measurements.constraints[name].measure.size
    measure = attribute(case.tables.measure[name])
    for label in measure_labels(name, size):
        yield Draft("Analysis", {"ID": label, "Measure": measure})


def _constraints(case: Case, name: str) -> Iterator[Draft]:
    constraint = case.measurements.constraints[name]
    labels = measure_labels(name, constraint.measure.size)
    for label, lower, upper in zip(labels, *constraint.bounds, strict=True):
        bounds = _bounds(float(lower), float(upper))
        if not bounds:
            continue
        side: dict[tuple[str, ...], dict[str, str]]
        side = {("Min",): {"Bound": "Lower"}, ("Max",): {"Bound": "Upper"}}
        own = label.replace(name, f"{name}_bounds", 1)
        expression = {"ID": own, "Expr": f"Analysis__{label}"}
        yield Draft("Constraint", expression | bounds | side.get(tuple(bounds), {}))


def _untold(case: Case) -> Iterator[str]:
    """What XDDM has no words for."""
    kept = [
        f"{count} {what}{'s' * (count > 1)}"
        for what, count in (
            ("geometry file", len(case.tables.geometry)),
            ("stage", len(case.tables.stage)),
            ("rider", len(case.tables.rider)),
            ("output", int(np.sum([v is not None for _, v in case.tables.output]))),
        )
        if count
    ]
    if kept:
        yield f"{', '.join(kept)}: these stay in {case.path}, which the Model names"
