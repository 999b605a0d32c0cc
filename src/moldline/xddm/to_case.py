"""A Model as a case: its Variables, Analyses and Constraints in a case file's words."""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..case import Case, load, schema
from ..errors import ParameterError
from ..mesh.io.files import replacing
from ..parameters.variable import Variable, variable
from .chain import meant
from .document import Document
from .expression import parsed
from .matching import places, stem
from .measure_table import measure_table
from .model import Design, Value
from .upstream import is_inner

WORDLESS = ("Function", "Objective", "Sum", "DesignPoint", "Intersect", "Tessellate", "AeroFun",
            "SensitivityArray", "Model")  # fmt: skip
"""Elements that a case cannot say."""


class Stated(NamedTuple):
    """A case file's tables, what it could not say, and the case that said the rest."""

    tables: schema.CaseTable
    notes: tuple[str, ...]
    case: Case | None = None

    def save(self, path: Path | str) -> None:
        """Write the case file; its paths are made for that place."""
        if self.case is not None:
            replace(self.case, tables=self.tables).save(path)
            return
        import tomli_w

        text = tomli_w.dumps(self.tables.model_dump(exclude_unset=True))
        with replacing(Path(path)) as file:
            file.write(text.encode())


def to_case(document: Document) -> Stated:
    """The case that a Model names, with the Model's variables, measures and bounds in it.

    Of a Model that names none there is no more than these: stages must be written by hand.
    """
    design = Design(document)
    name = design.target.get("Case")
    case = load(document.path.parent / name) if name else None
    tables: dict[str, Any] = {"moldline": 1}
    if case is not None:
        tables = case.tables.model_dump(exclude_unset=True)
    notes = _untold(design)
    try:
        tables["variable"] = tables.get("variable", {}) | _variables(design, case, notes)
        measures = tables.get("measure", {}) | _measures(design, case, notes)
    except ParameterError as problem:
        raise ParameterError(f"{document.path}: {problem}") from None
    tables |= {"measure": measures} if measures else {}
    if case is None:
        notes.append("the Model names no Case, so there is no geometry and no stage: add them")
    return Stated(schema.CaseTable.model_validate(tables), tuple(notes), case)


def _groups(values: Iterable[Value], known: Iterable[str], what: str) -> dict[str, list[Value]]:
    """Values by the variable or measure whose numbers they are, of the case or new."""
    found: dict[str, list[Value]] = defaultdict(list)
    names = list(known)
    for value in values:
        try:
            name = stem(value, names, what)
        except ParameterError:
            around = [e.id for e in value.element.ancestors() if e.parent is not None and e.id]
            name = re.sub(r"\W", "_", "_".join([*reversed(around), value.base]))
        found[name].append(value)
    return found


def _numbers(name: str, members: list[Value], size: int | None, what: str) -> dict[str, int]:
    """Which number each value is; without a known size, all must be there."""
    if size is None:
        size = 1
        for axis in range(max(len(value.indices) for value in members)):
            last = max(value.indices[axis : axis + 1] or (0,) for value in members)[0]
            size *= last + (1 if all(len(v.indices) == 1 for v in members) else 0)
        if len(members) != size:
            raise ParameterError(f"{what} {name!r}: {len(members)} of {size} numbers are there")
    bases = {value.base for value in members}
    if len(bases) > 1:
        raise ParameterError(f"{' and '.join(sorted(bases))} would both be {what} {name!r}")
    found = places(members, {members[0].base: size, name: size}, what)
    return {full: place.number for full, place in found.items()}


def _variables(design: Design, case: Case | None, notes: list[str]) -> dict[str, Any]:
    """Tables of variables that say something else than the case does."""
    known = {} if case is None else case.pipeline.variables
    own = [value for value in design.inputs if not is_inner(design, value)]
    found = {}
    for name, members in _groups(own, known, "variable").items():
        old = known.get(name)
        numbers = _numbers(name, members, old.size if old else None, "variable")
        new = _variable(name, members, numbers, old)
        if len({value.typical for value in members} - {None}) > 1:
            notes.append(f"TypicalSize of {name}: a case has one for all, the smallest is taken")
        if any(len(value.indices) == 2 for value in members):
            notes.append(f"{members[0].id} becomes {name}[{numbers[members[0].name]}]")
        if new != old:
            found[name] = _table(new)
    return found


def _variable(
    name: str, members: list[Value], numbers: Mapping[str, int], old: Variable | None
) -> Variable:
    size = old.size if old else len(members)
    values = np.zeros(size) if old is None else np.array(old.value)
    bounds = np.array([[-np.inf, np.inf]] * size if old is None else [old.lower, old.upper])
    bounds = bounds if old is None else bounds.T
    for value in members:
        k = numbers[value.name]
        values[k] = values[k] if value.value is None else value.value
        if value.is_variable:
            bounds[k] = (
                -np.inf if value.lower is None else value.lower,
                np.inf if value.upper is None else value.upper,
            )
        else:
            bounds[k] = values[k]
    typical = min((v.typical for v in members if v.typical), default=old.typical if old else None)
    units = {value.element.get("Unit") for value in members} - {None}
    if len(units) > 1:
        raise ParameterError(f"{name} has the units {', '.join(sorted(map(str, units)))}; give one")
    unit = next(iter(units), old.unit if old else "")
    pairs = [(float(low), float(high)) for low, high in bounds]
    return variable(name, size, values.tolist(), pairs, typical, str(unit).strip())


def _table(one: Variable) -> dict[str, Any]:
    """A variable as a case file's table."""
    table: dict[str, Any] = {"value": list(one.value)}
    pairs: Any = [list(pair) for pair in zip(one.lower, one.upper, strict=True)]
    if one.size == 1:
        table["value"], pairs = one.value[0], pairs[0]
    if np.isfinite(pairs).any():
        table["bounds"] = pairs
    table["typical"] = one.typical
    return table | ({"unit": one.unit} if one.unit else {})


def _measures(design: Design, case: Case | None, notes: list[str]) -> dict[str, Any]:
    """Tables of measures that are new, or have other bounds than the case's."""
    known = {} if case is None else case.measurements.constraints
    own = [
        value
        for value in design.analyses
        if not is_inner(design, value) and value.element.first("AeroFun") is None
    ]
    bounds = _bounds(design, notes)
    found: dict[str, Any] = {}
    for name, members in _groups(own, known, "measure").items():
        text = members[0].element.get("Measure")
        if name not in known and text is None:
            notes.append(f"{members[0].name}: neither the case nor an attribute Measure says what")
            continue
        old = known.get(name)
        size = None if old is None else old.measure.size
        numbers = _numbers(name, members, size, "measure")
        pairs = np.array([[-np.inf, np.inf]] * (size or len(members)))
        if old is not None:
            pairs = np.stack(old.bounds, axis=1)
        for value in members:
            pairs[numbers[value.name]] = bounds.get(value.name, (-np.inf, np.inf))
        if old is not None and np.array_equal(pairs, np.stack(old.bounds, axis=1)):
            continue
        table: dict[str, Any] = (
            measure_table(text or "").model_dump(exclude_unset=True)
            if case is None or name not in known
            else case.tables.measure[name].model_dump(exclude_unset=True)
        )
        table.pop("bounds", None)
        if np.isfinite(pairs).any():
            is_one = len(np.unique(pairs, axis=0)) == 1
            table["bounds"] = pairs[0].tolist() if is_one else pairs.tolist()
        found[name] = table
    return found


def _bounds(design: Design, notes: list[str]) -> dict[str, tuple[float, float]]:
    """Bounds of Analyses by full names, from Constraints that bound one of them."""
    found: dict[str, tuple[float, float]] = {}
    for value in design.expressions:
        if value.element.tag != "Constraint":
            continue
        expression = parsed(value.expression)
        name = expression.names[0] if len(expression.steps) == 1 and expression.names else ""
        full = meant(design, value.element, name) if name else ""
        if full not in design.by_name or design.by_name[full].element.tag != "Analysis":
            notes.append(
                f"{value.name}: a case bounds measures alone, not {value.expression.strip()!r}"
            )
            continue
        low, high = found.get(full, (-np.inf, np.inf))
        found[full] = (
            max(low, -np.inf if value.lower is None else value.lower),
            min(high, np.inf if value.upper is None else value.upper),
        )
    return found


def _untold(design: Design) -> list[str]:
    """What a case has no words for."""
    counts: Counter[str] = Counter()
    for element in design.target.descendants():
        if element.tag in WORDLESS and element is not design.target:
            counts[f"{element.tag}s"] += 1
        if element.tag in ("Variable", "Constant", "Analysis", "Constraint"):
            for name in ("FDstep", "Comment", "Sensitivity", "DiscretizationError"):
                if element.get(name) is not None:
                    counts[f"{name} of {element.tag}s"] += 1
    return [f"{count} {what}: a case has no word for them" for what, count in counts.items()]
