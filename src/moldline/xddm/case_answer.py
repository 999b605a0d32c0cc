"""Answers of a case: a request's values in, a surface, measures and their derivatives out."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from .. import case as cases
from ..case import Case, built
from ..case.options import MeasureTable
from ..errors import ParameterError
from ..mesh import Surface
from ..parameters.variable import Variable
from ..pipeline.measurements import Maker, Measurements
from ..pipeline.pipeline import Pipeline
from .asked import differentiated
from .chain import Quantity
from .exchange import Answer, Linearised
from .matching import Place, places, stem
from .measure_table import measure_table
from .model import Design, Value
from .upstream import Server, Upstream, behind, is_inner


def case_of(source: Design) -> Path:
    """The case file that a Model names, beside its document."""
    return source.document.path.parent / (source.target.get("Case") or "")


def answered(design: Design, source: Design, folder: Path, serve: Server) -> Answer:
    """The answer of the case that a Model names in its attribute Case."""
    case = cases.load(case_of(source))
    return of_case(case, design, behind(case, design, source, folder, serve))


def of_case(case: Case, design: Design, upstream: Upstream | None = None) -> Answer:
    """The answer of a case, or of its pipeline behind other Models."""
    up = upstream or Upstream(case.pipeline, {}, {}, ())
    numbers = _numbers(case, design) | {name: Place(*one) for name, one in up.numbers.items()}
    values = _values(case, design, numbers)
    wanted = [v.name for v in differentiated(design) if v.name in numbers]
    pipeline = up.pipeline.at(values)
    geometry = pipeline(values)
    if not isinstance(geometry, Surface):
        raise ParameterError(
            f"{case.path}: it makes a {type(geometry).__name__}, a framework needs a surface of "
            "triangles"
        )
    columns = _columns(pipeline, values, {name: numbers[name] for name in wanted})
    results = dict(up.results)
    results |= _measured(case, design, pipeline, values, {n: numbers[n] for n in wanted})
    notes = (*up.notes, *_ignored(design))
    surfaces = {design.target.id or "model": Linearised(geometry, columns)}
    return Answer(design, surfaces, results, case.units(), notes).completed()


def _numbers(case: Case, design: Design) -> dict[str, Place]:
    """Places of the request's inputs among the numbers of the case's variables."""
    own = [value for value in design.inputs if not is_inner(design, value)]
    variables = case.pipeline.variables
    sizes = {name: variable.size for name, variable in variables.items()}
    try:
        found = places(own, sizes, "variable")
    except ParameterError as problem:
        raise ParameterError(f"{design.document.path}: {problem}") from None
    for value in own:
        _check(design, value, variables[found[value.name].name])
    return found


def _check(design: Design, value: Value, variable: Variable) -> None:
    """Refuse another unit than the case's, and a value outside the request's own bounds."""
    unit = value.element.get("Unit")
    if unit is not None and unit.strip() != variable.unit:
        design.document.refuse(
            value.element,
            f"Unit={unit!r}, the case has {variable.name!r} in {variable.unit or 'no unit'!r}; "
            "convert Value, Min, Max and TypicalSize",
        )
    low = -np.inf if value.lower is None else value.lower
    high = np.inf if value.upper is None else value.upper
    if value.value is not None and not low <= value.value <= high:
        design.document.refuse(
            value.element, f"Value={value.value:g} is outside [{low:g}, {high:g}]"
        )


def _values(case: Case, design: Design, numbers: Mapping[str, Place]) -> dict[str, np.ndarray]:
    """The case's values with the request's in their places; bounds are the case's."""
    values = {
        name: np.array(variable.value, float) for name, variable in case.pipeline.variables.items()
    }
    for value in design.inputs:
        place = numbers.get(value.name)
        if place is not None and place.name in values and value.value is not None:
            values[place.name][place.number] = value.value
    try:
        return {name: np.asarray(value) for name, value in case.values(values).items()}
    except ParameterError as problem:
        raise ParameterError(f"{design.document.path}: {problem}") from None


def _columns(
    pipeline: Pipeline, values: dict[str, np.ndarray], wanted: Mapping[str, Place]
) -> dict[str, np.ndarray]:
    """Derivatives of the points, by full names."""
    known = {
        name: pipeline.sensitivity(values, name)
        for name in dict.fromkeys(place.name for place in wanted.values())
    }
    return {name: known[place.name][..., place.number] for name, place in wanted.items()}


def _measured(
    case: Case,
    design: Design,
    pipeline: Pipeline,
    values: dict[str, np.ndarray],
    wanted: Mapping[str, Place],
) -> dict[str, Quantity]:
    """What the request's Analyses measure, by full names."""
    own = [
        value
        for value in design.analyses
        if not is_inner(design, value) and value.element.first("AeroFun") is None
    ]
    tables: dict[str, MeasureTable] = dict(case.tables.measure)
    for value in own:
        if (text := value.element.get("Measure")) and value.base not in tables:
            try:
                tables[value.base] = measure_table(text)
            except ParameterError as problem:
                design.document.refuse(value.element, problem)
    try:
        asked = dict.fromkeys(stem(value, tables, "measure") for value in own)
        measures = Measurements(
            pipeline, {name: _maker(case, name, tables[name]) for name in asked}
        )
        sizes = {name: one.measure.size for name, one in measures.constraints.items()}
        found = places(own, sizes, "measure")
    except ParameterError as problem:
        raise ParameterError(f"{design.document.path}: {problem}") from None
    if not found:
        return {}
    numbers = measures(values)
    slopes = measures.jacobian(values) if wanted else {}
    return {
        name: Quantity(
            float(numbers[of.name][of.number]),
            {v: float(slopes[of.name][by.name][of.number, by.number]) for v, by in wanted.items()}
            if wanted
            else None,
        )
        for name, of in found.items()
    }


def _maker(case: Case, name: str, table: MeasureTable) -> Maker:
    return lambda geometry: built.measure(str(case.path), f"measure.{name}", table, geometry)


def _ignored(design: Design) -> list[str]:
    """What the request asks for and the case cannot give."""
    found = [f"{e.label} is not obeyed: the case's own triangles move"
             for e in design.target.all("Tessellate")]  # fmt: skip
    return found + [
        f"{value.name} is for a flow solver" for value in design.analyses
        if value.element.first("AeroFun") is not None
    ]  # fmt: skip
