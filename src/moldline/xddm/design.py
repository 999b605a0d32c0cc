"""A design document: all its Models run, their wetted surfaces made, and what is made of those."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from ..case import built
from ..errors import FileError, GeometryError, MoldlineError, ParameterError
from ..measures.base import Constraint
from ..mesh import Surface
from ..mesh.io import read
from ..modelers.union import Union
from ..modelers.wetting import Wetting
from .asked import asking, differentiated
from .chain import Quantity, quantities
from .document import Document
from .document import read as read_document
from .edit import Edit
from .element import JOINT, Element
from .exchange import Answer, Linearised, deliver, folder_name
from .matching import places
from .measure_table import measure_table
from .model import Design, Intersect, Value
from .upstream import Server

MODELS = "models"
"""Folder of the Models' answers, each in one of its own, within the one of the design's."""

OPTIONS = {"Symmetry": "symmetry", "Apart": "apart", "Crossings": "crossings", "Slivers": "slivers"}
"""Attributes of an Intersect that are options of the union."""


@dataclass(frozen=True)
class Part:
    """A part of wetted surfaces, with the results of the Model that made it.

    Attributes
    ----------
    name
        The Model's ID, or the file's name.
    linearised
        Its surface, with derivatives by the names that the design document has for variables.
    results
        By the names that the design document has for them, or by those of the Model.
    notes
        What the user should know.
    """

    name: str
    linearised: Linearised
    results: Mapping[str, Quantity]
    notes: tuple[str, ...] = ()


def driven(design: Design, source: Design, folder: Path, serve: Server) -> Answer:
    """Values and derivatives of all that a design document says of geometry.

    Its Models are asked in the order of the Intersects' Parts, for the values that the document has
    for them, and leave their answers in folders of their own. Results of flow solvers stay as they
    are; what is made of one that is not there yet waits.
    """
    ids = [one.id for one in design.intersects]
    if len(ids) > 1 and (len(set(ids)) < len(ids) or "" in ids):
        design.document.refuse(design.target, "each of several Intersects needs an ID of its own")
    names = dict.fromkeys(part for one in design.intersects for part in one.parts)
    if not names:
        design.document.refuse(design.target, "has no Intersect with Parts, so nothing to make")
    parts = {name: _part(name, design, source, folder, serve) for name in names}
    results: dict[str, Quantity] = {}
    for part in parts.values():
        results |= part.results
    wetted: dict[str, Wetted] = {}
    for one in design.intersects:
        wetted[one.id] = Wetted(design, one, [parts[name] for name in one.parts])
    surfaces = {name or "wetted": one.linearised for name, one in wetted.items()}
    for value in design.analyses:
        if value.element.get("Measure") and _is_own(value):
            results[value.name] = wetted[_geometry(design, value)].measured(
                design, value, source.document.path
            )
    notes = tuple(note for part in parts.values() for note in part.notes)
    return Answer(design, surfaces, results, notes=(*notes, *_ignored(design))).completed()


def _is_own(value: Value) -> bool:
    """Whether a value is the design's own, and not that of a Model within it."""
    return all(around.tag != "Model" for around in value.element.ancestors())


def _geometry(design: Design, value: Value) -> str:
    """The Intersect of an Analysis: by its own Geometry, its DesignPoint's, or the only one."""
    for element in (value.element, *value.element.ancestors()):
        if (name := element.get("Geometry")) is not None:
            if name in {one.id for one in design.intersects}:
                return name
            design.document.refuse(element, f"Geometry={name!r} is the ID of no Intersect")
    if len(design.intersects) > 1:
        design.document.refuse(value.element, 'say of which Intersect: Geometry="..."')
    return design.intersects[0].id


def _part(name: str, design: Design, source: Design, folder: Path, serve: Server) -> Part:
    """A part: a triangulation as it is, or what a Model makes."""
    places = [base / name for base in (folder, source.document.path.parent)]
    path = next((place for place in places if place.is_file()), None)
    if path is None:
        raise FileError(
            f"{design.document.path}: Parts: no file {name!r}; looked at "
            f"{' and '.join(map(str, places))}"
        )
    if path.suffix.lower() != ".xml":
        surface = read(path)
        if not isinstance(surface, Surface):
            raise GeometryError(f"{path}: is a {type(surface).__name__}, expected triangles")
        return Part(path.name.split(".")[0], Linearised(surface, {}), {})
    return _model(path, design, folder, serve)


def _model(path: Path, design: Design, folder: Path, serve: Server) -> Part:
    """Ask a Model."""
    model = Design(read_document(path))
    if not model.target.id:
        model.document.refuse(model.target, "has no ID, expected one that names its results")
    within = [e for e in design.target.all("Model") if e.id == model.target.id]
    request = _set(model, design, within[0]) if within else model.document
    asked = Design(asking(request, bool(differentiated(design))))
    place = folder / MODELS / folder_name(model.target.id)
    place.mkdir(parents=True, exist_ok=True)
    try:
        answer = serve(asked, model, place)
    except MoldlineError as error:
        raise type(error)(f"{design.document.path}: {model.target.label}: {error}") from None
    deliver(answer, place, "one")
    (linearised,) = answer.surfaces.values()
    results = {
        _name(design, name): Quantity(
            one.value,
            None
            if one.gradient is None
            else {_name(design, by): slope for by, slope in one.gradient.items()},
        )
        for name, one in (quantities(asked) | dict(answer.results)).items()
    }
    columns = {_name(design, name): column for name, column in linearised.columns.items()}
    notes = tuple(f"{model.target.id}: {note}" for note in answer.notes)
    return Part(model.target.id, Linearised(linearised.surface, columns), results, notes)


def _set(model: Design, design: Design, within: Element) -> Document:
    """A Model's document with the values that the design document has for it."""
    edit = Edit()
    for value in design.inputs:
        if within in value.element.ancestors() and value.value is not None:
            name = model.target.full_name + JOINT + value.element.name_below(within)
            if name not in model.by_name:
                design.document.refuse(
                    value.element, f"{model.document.path} has no {name}; it has: {model.listing}"
                )
            edit.set_number(model.by_name[name].element, "Value", value.value)
    return model.document.edited(edit)


def _name(design: Design, name: str) -> str:
    """What the design document calls a Model's value, where it has it; else as the Model does."""
    found = design.names.find(name)
    return name if found is None else found.full_name


class Wetted:
    """A wetted surface, with the derivatives that its parts have."""

    def __init__(self, design: Design, intersect: Intersect, parts: list[Part]):
        surfaces = [part.linearised.surface for part in parts]
        columns: dict[str, np.ndarray] = {}
        self.geometry = surfaces[0]
        if len(parts) == 1:
            columns |= parts[0].linearised.columns
        else:
            making = _united(design, intersect, parts)
            self.geometry = making.geometry
            columns |= _pushed(making, parts)
        self.linearised = Linearised(self.geometry, columns)

    def measured(self, design: Design, value: Value, file: Path) -> Quantity:
        """A measure of it; derivatives by what its points do. Its files are beside `file`."""
        try:
            table = measure_table(value.element.get("Measure") or "")
            where = f"line {value.element.line}: {value.element.label}"
            made = built.measure(str(file), where, table, self.geometry)
            measure = made.measure if isinstance(made, Constraint) else made
            place = places([value], {value.base: measure.size}, "measure")[value.name]
        except ParameterError as problem:
            design.document.refuse(value.element, problem)
        points = jnp.asarray(self.geometry.points)
        number, slopes = jax.value_and_grad(lambda p: measure(p)[place.number])(points)
        gradient = {
            name: float(np.vdot(slopes, column)) for name, column in self.linearised.columns.items()
        }
        return Quantity(float(number), gradient if differentiated(design) else None)


def _united(design: Design, intersect: Intersect, parts: list[Part]) -> Wetting:
    """The union of parts, by the options that an Intersect has."""
    given = {
        option: text.strip().lower()
        for name, option in OPTIONS.items()
        if (text := intersect.element.get(name)) is not None
    }
    try:
        union = Union(**given)  # type: ignore[arg-type]
        return union.bind(*(p.linearised.surface for p in parts), names=[p.name for p in parts])
    except MoldlineError as problem:
        raise GeometryError(f"{design.document.place(intersect.element)}: {problem}") from None


def _pushed(making: Wetting, parts: list[Part]) -> dict[str, np.ndarray]:
    """Derivatives of a wetted surface: each of its points follows what it is made of."""
    points = [jnp.asarray(part.linearised.surface.points) for part in parts]
    still = [jnp.zeros_like(p) for p in points]
    _, push = jax.linearize(lambda *p: making(np.zeros(0), *p), *points)
    found = {}
    for k, part in enumerate(parts):
        for name, column in part.linearised.columns.items():
            moves = [*still[:k], jnp.asarray(column), *still[k + 1 :]]
            found[name] = np.asarray(push(*moves))
    return found


def _ignored(design: Design) -> tuple[str, ...]:
    """Attributes for other programs that make wetted surfaces."""
    return tuple(
        f"{one.element.label}: {name} is for another program and not obeyed"
        for one in design.intersects
        for name in ("Comp2tri", "Cutout", "Overlap", "PS")
        if one.element.get(name) is not None
    )
