"""What an XDDM document says: its variables, results, expressions, design points and parts."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from ..errors import FileError
from ..mesh.io.text import quoted
from .aero import Functional, functionals
from .document import Document
from .element import Element
from .names import Names, named
from .vocabulary import DIFFERENCED, EXPRESSIONS, INPUTS, POINT, VALUED
from .xpath import chosen

_PLACE = re.compile(r"(.*)\[\s*([0-9]{1,9}(?:\s*,\s*[0-9]{1,9})*)\s*\]", re.DOTALL)
_FACES = re.compile(r"Face\s+Label\s*=\s*([0-9]{1,9}(?:\s*,\s*[0-9]{1,9})*)")


@dataclass(frozen=True)
class Value:
    """A Variable, Constant, Analysis, Function, Objective, Constraint or Sum.

    Attributes
    ----------
    element
        Where it stands; its `tag`, `id` and `full_name` say which it is.
    value
        None if it is absent or not set.
    lower, upper
        Bounds: Min and Max; of an expression with a Bound, the one of them that it says.
    typical, step
        A change that matters, and the step of differences that is asked for.
    is_required
        Whether its derivatives are asked for.
    expression
        The text of an Expr; empty where there is none.
    """

    element: Element
    value: float | None = None
    lower: float | None = None
    upper: float | None = None
    typical: float | None = None
    step: float | None = None
    is_required: bool = False
    expression: str = ""

    @property
    def name(self) -> str:
        """Its full name."""
        return self.element.full_name

    @property
    def id(self) -> str:
        """Its own name in its namespace."""
        return self.element.id

    @property
    def is_variable(self) -> bool:
        """Whether it is an input that is differentiated."""
        return self.element.tag == "Variable"

    @property
    def differencing(self) -> str | None:
        """FD or oFD, where its Comment forces differences of this kind."""
        comment = (self.element.get("Comment") or "").strip()
        return comment if comment in DIFFERENCED else None

    @property
    def base(self) -> str:
        """Its ID without the place in brackets: dz of dz[3,1]."""
        found = _PLACE.fullmatch(self.id)
        return found[1] if found else self.id

    @property
    def indices(self) -> tuple[int, ...]:
        """The place in brackets, as it is written: (3, 1) of dz[3,1]."""
        found = _PLACE.fullmatch(self.id)
        return tuple(int(i) for i in found[2].split(",")) if found else ()


@dataclass(frozen=True)
class Intersect:
    """Parts that make one wetted surface; their order is that of the components."""

    element: Element
    parts: tuple[str, ...]

    @property
    def id(self) -> str:
        """What a DesignPoint's Geometry names."""
        return self.element.id


@dataclass(frozen=True)
class DesignPoint:
    """One flow condition, of the geometry of an Intersect."""

    element: Element
    geometry: str
    values: tuple[Value, ...]


@dataclass(frozen=True)
class Tessellation:
    """Sizes of triangles; `body` is 0 where they are for all that have no own."""

    element: Element
    body: int
    edge: float | None
    sag: float | None
    angle: float | None


@dataclass(frozen=True)
class Component:
    """A component of a configuration: labels of faces, or a container of others."""

    element: Element
    name: str
    parent: str
    is_container: bool
    labels: tuple[int, ...]


class Design:
    """A document, or the part of it that an XPath chooses, as what it means.

    Attributes
    ----------
    document
        Which it reads.
    target
        The element that was chosen; only what is below it counts.
    """

    def __init__(self, document: Document, path: str = ""):
        self.document = document
        self.target = chosen(document, path)

    @cached_property
    def switch(self) -> bool | None:
        """Whether Configure asks for all derivatives, or for none; None if it says neither."""
        found = [e for e in self.document.root.descendants() if e.tag == "Configure"]
        if len(found) > 1:
            self.document.refuse(
                found[1], f"a second one (the first is in line {found[0].line}); keep one"
            )
        return _is_required(found[0]) if found else None

    @cached_property
    def values(self) -> tuple[Value, ...]:
        """All that has a value, in the order of the document."""
        return tuple(self._value(e) for e in self.valued)

    @cached_property
    def elements(self) -> tuple[Element, ...]:
        """All that has an ID, in the order of the document."""
        return tuple(named(self.target))

    @cached_property
    def valued(self) -> tuple[Element, ...]:
        """Elements of all that has a value."""
        return tuple(e for e in self.elements if e.tag in VALUED)

    @property
    def listing(self) -> str:
        """Some full names of values, for messages."""
        known = ", ".join(quoted(e.full_name)[1:-1] for e in self.valued[:8]) or "none"
        return known + ", ..." * (len(self.valued) > 8)

    @cached_property
    def names(self) -> Names:
        """Finds values by full names, by the last parts of them, and by IDs."""
        return Names(self.elements)

    @cached_property
    def by_name(self) -> dict[str, Value]:
        """Values by full names."""
        return {value.name: value for value in self.values}

    @property
    def inputs(self) -> tuple[Value, ...]:
        """Variables and Constants."""
        return self._of(INPUTS)

    @property
    def variables(self) -> tuple[Value, ...]:
        """Inputs that are differentiated."""
        return self._of(("Variable",))

    @property
    def analyses(self) -> tuple[Value, ...]:
        """Results that a server fills in."""
        return self._of(("Analysis",))

    @property
    def expressions(self) -> tuple[Value, ...]:
        """Functions, Objectives, Constraints and Sums."""
        return self._of(EXPRESSIONS)

    @property
    def intersects(self) -> tuple[Intersect, ...]:
        """Wetted surfaces, each of several parts."""
        found = []
        for element in self.target.all("Intersect"):
            parts = [part.strip() for part in (element.get("Parts") or "").split(",")]
            found.append(Intersect(element, tuple(part for part in parts if part)))
        return tuple(found)

    @property
    def points(self) -> tuple[DesignPoint, ...]:
        """Flow conditions, each with its own values."""
        found = [e for e in self.elements if e.tag == POINT]
        return tuple(
            DesignPoint(
                e,
                e.get("Geometry") or "",
                tuple(v for v in self.values if e in v.element.ancestors()),
            )
            for e in found
        )

    @property
    def tessellations(self) -> tuple[Tessellation, ...]:
        """Sizes of triangles, of all bodies and of some."""
        return tuple(self.tessellation(e) for e in self.target.all("Tessellate"))

    @property
    def components(self) -> tuple[Component, ...]:
        """Components of a configuration."""
        return tuple(_component(e) for e in self.target.all("Component"))

    @property
    def functionals(self) -> dict[str, list[Functional]]:
        """Lines of AeroFuns, by the full name of the Analysis or of the AeroFun itself."""
        owners = [e for e in self.elements if e.tag in ("Analysis", "AeroFun")]
        texts = {e.full_name: e if e.tag == "AeroFun" else e.first("AeroFun") for e in owners}
        return {k: functionals(self.document, e) for k, e in texts.items() if e is not None}

    def find(self, name: str, scope: Element | None = None) -> Value:
        """The value of a name: full, the end of a full one, or an ID; one must have it."""
        try:
            element = self.names.find(name, scope)
        except ValueError as problem:
            raise FileError(f"{self.document.path}: {problem}") from None
        if element is None:
            raise FileError(
                f"{self.document.path}: nothing is named {quoted(name)}; it has: {self.listing}"
            )
        return self.by_name[element.full_name]

    def tessellation(self, element: Element) -> Tessellation:
        """What a Tessellate says."""
        body = element.id.strip()
        if body and not (body.isascii() and body.isdigit() and len(body) < 10 and int(body)):
            self.document.refuse(element, "the ID must be the number of a body, from 1 on")
        edge, sag, angle = (self.document.number(element, k) for k in ("MaxEdge", "Sag", "Angle"))
        return Tessellation(element, int(body or 0), edge, sag, angle)

    def is_required(self, element: Element) -> bool:
        """Whether derivatives are asked for: by Configure, else by itself or what is around it."""
        if self.switch is not None:
            return self.switch
        for one in (element, *element.ancestors()):
            asked = _is_required(one)
            if asked is not None:
                return asked
        return False

    def _of(self, tags: Sequence[str]) -> tuple[Value, ...]:
        return tuple(value for value in self.values if value.element.tag in tags)

    def _value(self, element: Element) -> Value:
        def number(attribute: str) -> float | None:
            return self.document.number(element, attribute)

        is_bounded = element.tag in EXPRESSIONS
        bound = (element.get("Bound") or "").strip().lower() if is_bounded else ""
        return Value(
            element,
            number("Value"),
            None if bound == "upper" else number("Min"),
            None if bound == "lower" else number("Max"),
            number("TypicalSize"),
            number("FDstep"),
            self.is_required(element),
            element.get("Expr") or "",
        )


def _is_required(element: Element) -> bool | None:
    word = (element.get("Sensitivity") or "").strip().lower()
    return {"required": True, "none": False}.get(word)


def _component(element: Element) -> Component:
    labels = [
        int(label)
        for data in element.all("Data")
        for found in _FACES.finditer(data.text)
        for label in found[1].split(",")
    ]
    return Component(
        element,
        element.get("Name") or "",
        element.get("Parent") or "",
        (element.get("Type") or "").strip().lower() == "container",
        tuple(labels),
    )
