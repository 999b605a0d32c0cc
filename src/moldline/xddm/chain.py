"""Values and derivatives of a document's expressions, by the chain rule through its results."""

from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import ParameterError
from .element import Element
from .expression import Expression, parsed
from .model import Design, Value
from .names import plain
from .order import ordered


@dataclass(frozen=True)
class Quantity:
    """A number and its derivatives.

    Attributes
    ----------
    value
        The number, in the unit that the document has it in.
    gradient
        Derivatives by variables, each by its full name; a variable that is not there has no
        influence. None where nobody has computed them.
    """

    value: float
    gradient: Mapping[str, float] | None = None


def quantities(design: Design) -> dict[str, Quantity]:
    """What a document itself says of its inputs and results, by full names; unset ones are out."""
    found = {}
    for value in (*design.inputs, *design.analyses):
        if value.value is None:
            continue
        if value.element.tag == "Analysis":
            gradient = sensitivities(design, value.element)
        else:
            gradient = {value.name: 1.0} if value.is_variable else {}
        found[value.name] = Quantity(value.value, gradient)
    return found


def sensitivities(design: Design, element: Element) -> dict[str, float] | None:
    """The numbers of an element's SensitivityArray by full names; None without one."""
    array = element.first("SensitivityArray")
    if array is None:
        return None
    found = {}
    for one in array.all("Sensitivity"):
        value = design.document.number(one, "Value")
        if value is None:
            design.document.refuse(one, "has no Value, expected a derivative")
        found[full_name(design, one)] = value
    return found


def full_name(design: Design, sensitivity: Element) -> str:
    """The full name of the variable that a Sensitivity is about, of this document or another."""
    name = sensitivity.get("P") or ""
    try:
        found = design.names.find(name, sensitivity.parent)
    except ParameterError as problem:
        design.document.refuse(sensitivity, problem)
    return name if found is None else found.full_name


def evaluated(
    design: Design,
    given: Mapping[str, Quantity] | None = None,
    waiting: list[str] | None = None,
) -> dict[str, Quantity]:
    """Functions, Objectives, Constraints and Sums of a document, by full names.

    `given` holds, by full names, what the document does not say itself, such as results of other
    documents, and what is to be taken in place of what it says. An expression of something whose
    derivatives nobody has computed has none either. One of something that has no value yet is an
    error; with `waiting` it is left out, and a sentence about it goes there.
    """
    known = quantities(design) | dict(given or {})
    foreign = {plain(name): name for name in given or {}}
    links = {value.name: _Link(design, value, foreign) for value in design.expressions}
    found: dict[str, Quantity] = {}
    order, circle = ordered({name: link.names.values() for name, link in links.items()})
    if circle:
        design.document.refuse(
            design.by_name[circle[0]].element,
            f"Expr: circular: {' -> '.join([*circle, circle[0]])}; let one of them name no other",
        )
    for name in order:
        absent = links[name].absent(known)
        if absent is not None and waiting is not None:
            waiting.append(f"{name} waits for a Value of {absent}")
            continue
        known[name] = found[name] = links[name].quantity(known)
    return found


class _Link:
    """An expression, and which of the document's values its names stand for."""

    def __init__(self, design: Design, value: Value, foreign: Mapping[str, str]):
        self.design, self.value = design, value
        try:
            self.expression: Expression = parsed(value.expression)
        except ParameterError as problem:
            design.document.refuse(value.element, f"Expr: {problem}")
        self.names = {name: self._full(name, foreign) for name in self.expression.names}

    def _full(self, name: str, foreign: Mapping[str, str]) -> str:
        try:
            return meant(self.design, self.value.element, name, foreign)
        except ParameterError as problem:
            column = self.expression.column(name)
            self.design.document.refuse(self.value.element, f"Expr: column {column}: {problem}")

    def absent(self, known: Mapping[str, Quantity]) -> str | None:
        """The first of its names that has no value yet."""
        return next((full for full in self.names.values() if full not in known), None)

    def quantity(self, known: Mapping[str, Quantity]) -> Quantity:
        for name, full in self.names.items():
            if full not in known:
                column = self.expression.column(name)
                self.design.document.refuse(
                    self.value.element,
                    f"Expr: column {column}: {full} has no Value yet; set it, or run what fills it",
                )
        values = {name: known[full].value for name, full in self.names.items()}
        try:
            value, slopes = self.expression.value_and_gradient(values)
        except ParameterError as problem:
            self.design.document.refuse(self.value.element, f"Expr: {problem}")
        total: dict[str, float] = {}
        for name, slope in slopes.items():
            gradient = known[self.names[name]].gradient
            if gradient is None and slope != 0.0:
                return Quantity(value)
            for variable, by_variable in (gradient or {}).items():
                total[variable] = total.get(variable, 0.0) + slope * by_variable
        return Quantity(value, total)


def meant(
    design: Design, element: Element, name: str, foreign: Mapping[str, str] | None = None
) -> str:
    """The full name of what a name in an element's expression stands for.

    `foreign` are names that other documents have, in full.
    """
    found = design.names.find(name, element.parent)
    if found is not None:
        return found.full_name
    if name in (foreign or {}):
        return (foreign or {})[name]
    raise ParameterError(f"nothing is named {name!r}; known are: {design.listing}")
