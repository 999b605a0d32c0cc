"""What is wrong in an XDDM document, and what in it is not read."""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

from ..errors import FileError, ParameterError
from ..mesh.io.text import quoted
from .aero import FIELDS, functionals
from .chain import meant
from .document import Document
from .element import JOINT, Element
from .expression import parsed
from .model import Design
from .order import ordered
from .vocabulary import (
    EXPRESSIONS,
    NEEDED,
    NUMBERS,
    PLAIN,
    POINT,
    POSITIVE,
    VALUED,
    WORDS,
    is_namespace,
)

CUT = 4096
"""Characters after which other readers of XDDM cut."""


@dataclass(frozen=True)
class Findings:
    """Sentences about a document, each with file and line.

    Attributes
    ----------
    problems
        What is wrong, and would be refused or misread.
    notes
        What is not read, or may surprise.
    """

    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def problems(document: Document, path: str = "") -> list[str]:
    """What is wrong in a document, or in the part that an XPath chooses; empty if all is well."""
    return findings(document, path).problems


def findings(document: Document, path: str = "") -> Findings:
    """What is wrong in a document, and what in it is not read, in the order of its lines."""
    check = _Check(Design(document, path))
    for element in check.design.target.descendants():
        check.attributes(element)
        check.place(element)
    check.names()
    check.references()
    check.expressions()
    return Findings(*(_in_order(found) for found in (check.wrong, check.noted)))


def _in_order(found: Iterable[tuple[int, str]]) -> list[str]:
    return [text for _, text in sorted(dict.fromkeys(found), key=lambda pair: pair[0])]


class _Check:
    """Collects what is found."""

    def __init__(self, design: Design):
        self.design, self.document = design, design.document
        self.wrong: list[tuple[int, str]] = []
        self.noted: list[tuple[int, str]] = []

    def _tell(self, element: Element, text: object) -> None:
        self.wrong.append((element.line, f"{self.document.place(element)}: {text}"))

    def _note(self, element: Element, text: str) -> None:
        self.noted.append((element.line, f"{self.document.place(element)}: {text}"))

    def attributes(self, element: Element) -> None:
        """Those it needs, numbers, words, lengths."""
        for name in NEEDED.get(element.tag, ()):
            if not (element.get(name) or "").strip():
                self._tell(element, f'has no {name}, expected one; add {name}="..."')
        numbers = {name: self._number(element, name) for name in NUMBERS.get(element.tag, ())}
        for name in POSITIVE:
            value = numbers.get(name)
            if value is not None and value <= 0.0:
                self._tell(element, f"{name}={value:g}, expected a number above zero")
        self._bounds(element, numbers)
        for name, words in WORDS.items():
            word = element.get(name)
            is_ours = element.tag == "Component" if name == "Type" else element.tag != "Component"
            if word is not None and is_ours and word.strip().lower() not in map(str.lower, words):
                self._tell(element, f"{name}={quoted(word)}, expected {' or '.join(words)}")
        for name, text in element.attributes.items():
            if len(text) > CUT:
                self._note(
                    element,
                    f"{name} has {len(text)} characters; others may read {CUT} of them only",
                )

    def _number(self, element: Element, name: str) -> float | None:
        try:
            return self.document.number(element, name)
        except FileError as problem:
            self.wrong.append((element.line, str(problem)))
            return None

    def _bounds(self, element: Element, numbers: dict[str, float | None]) -> None:
        value, lower, upper = (numbers.get(name) for name in ("Value", "Min", "Max"))
        if lower is not None and upper is not None and lower > upper:
            self._tell(element, f"Min={lower:g} is above Max={upper:g}; swap them")
        elif element.tag not in EXPRESSIONS and value is not None:
            if lower is not None and value < lower:
                self._tell(element, f"Value={value:g} is below Min={lower:g}; change one of them")
            if upper is not None and value > upper:
                self._tell(element, f"Value={value:g} is above Max={upper:g}; change one of them")

    def place(self, element: Element) -> None:
        """What may stand but once, what is not read, and what its text says."""
        counts: dict[str, list[Element]] = defaultdict(list)
        for child in element.children:
            counts[child.tag].append(child)
            self._reading(element, child)
        once = ["SensitivityArray"] + ["AeroFun"] * (element.tag == "Analysis")
        for tag in once:
            for surplus in counts[tag][1:]:
                self._tell(surplus, f"a second one within {element.label}; keep one")
        if element.tag == "AeroFun":
            self._aero(element)
        if element.tag == "SensitivityArray":
            first: dict[str, Element] = {}
            for one in element.all("Sensitivity"):
                twin = first.setdefault(one.get("P") or "", one)
                if twin is not one:
                    self._tell(one, f"a second one for it (the first is in line {twin.line})")
        if element.tag == "Sensitivity" and (element.get("P") or "").strip():
            self._sensitivity(element)

    def _reading(self, parent: Element, child: Element) -> None:
        if child.tag in (*VALUED, *PLAIN, POINT):
            return
        if parent.tag in (*VALUED, *PLAIN):
            self._note(child, f"is not read within {parent.label}")
        elif not is_namespace(child):
            self._note(child, "is no element of XDDM and has no ID, so what is in it is not read")

    def _aero(self, element: Element) -> None:
        try:
            for one in functionals(self.document, element):
                if one.kind not in FIELDS:
                    self._note(
                        element, f"the kind {quoted(one.kind)} in line {one.line} is not known"
                    )
        except FileError as problem:
            self.wrong.append((element.line, str(problem)))

    def _sensitivity(self, element: Element) -> None:
        name = element.get("P") or ""
        try:
            found = self.design.names.find(name, element.parent)
        except ParameterError as problem:
            self._tell(element, problem)
            return
        if found is None:
            self._unknown(element, f"P={quoted(name)}", name)
        elif found.tag != "Variable":
            self._tell(element, f"P={quoted(name)} names the {found.label}, expected a Variable")

    def _unknown(self, element: Element, what: str, name: str) -> None:
        """A name of another document is none of this one's business."""
        root = self.document.root
        if name.startswith("Model" + JOINT) and not name.startswith(root.own_name + JOINT):
            self._note(element, f"{what} must be of another document")
        else:
            self._tell(element, f"{what} is not in the document; known are: {self.design.listing}")

    def names(self) -> None:
        """Full names must differ; one Configure is enough."""
        first: dict[str, Element] = {}
        for element in self.design.elements:
            name = element.full_name
            if name in first:
                self._tell(
                    element,
                    f"the full name {quoted(name)} is taken in line {first[name].line}; "
                    "give it another ID",
                )
            first.setdefault(name, element)
        try:
            _ = self.design.switch
        except FileError as problem:
            self.wrong.append((self.document.root.line, str(problem)))

    def references(self) -> None:
        """Geometries of design points, parents of components, bodies of tessellations."""
        known = {one.id for one in self.design.intersects if one.id}
        for element in self.design.elements:
            geometry = element.get("Geometry")
            if element.tag == POINT and geometry and known and geometry not in known:
                names = ", ".join(sorted(known))
                self._tell(
                    element,
                    f"Geometry={quoted(geometry)}, expected the ID of an Intersect: {names}",
                )
        bodies: dict[str, int] = {}
        for one in self.design.target.all("Tessellate"):
            try:
                self.design.tessellation(one)
            except FileError as problem:
                self.wrong.append((one.line, str(problem)))
            if one.id in bodies:
                self._tell(one, f"a second one for the same, as in line {bodies[one.id]}; keep one")
            bodies.setdefault(one.id, one.line)
        components = {one.name: one for one in self.design.components}
        for component in self.design.components:
            if component.parent and component.parent not in components:
                self._tell(
                    component.element,
                    f"Parent={quoted(component.parent)}, expected the Name of another Component",
                )

    def expressions(self) -> None:
        """They must parse, name what there is, and not go round in circles."""
        made_of: dict[str, list[str]] = {}
        where: dict[str, Element] = {}
        for element in self.design.valued:
            text = element.get("Expr") or ""
            if element.tag in EXPRESSIONS and text.strip():
                made_of[element.full_name] = self._names(element, text)
                where[element.full_name] = element
        _, circle = ordered(made_of)
        if circle:
            self._tell(
                where[circle[0]], f"Expr: circular: {' -> '.join([*circle, circle[0]])}; break it"
            )

    def _names(self, element: Element, text: str) -> list[str]:
        try:
            expression = parsed(text)
        except ParameterError as problem:
            self._tell(element, f"Expr: {problem}")
            return []
        found = []
        for name in expression.names:
            try:
                found.append(meant(self.design, element, name))
            except ParameterError as problem:
                column = expression.column(name)
                if self.design.names.has(name):
                    self._tell(element, f"Expr: column {column}: {problem}")
                else:
                    self._unknown(element, f"Expr: column {column}: {quoted(name)}", name)
        return found
