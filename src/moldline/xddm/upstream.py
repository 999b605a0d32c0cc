"""Models within a Model: what they make is what the outer one deforms."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from ..case import Case
from ..errors import ParameterError
from ..mesh.io import METRES
from ..parameters.link import Link
from ..parameters.variable import Variable
from ..pipeline.construction import Construction
from ..pipeline.pipeline import Pipeline
from .asked import asking, differentiated
from .chain import Quantity
from .element import JOINT, Element
from .exchange import Answer, Linearised, folder_name
from .linearised_shape import LinearisedShape
from .model import Design, Value

Server: TypeAlias = Callable[[Design, Design, Path], Answer]
"""Answers a request to a Model, in a folder."""


class Upstream(NamedTuple):
    """A pipeline behind other Models.

    Attributes
    ----------
    pipeline
        With what they make in the places of the case's geometries.
    numbers
        Of their variables, by full names: the variable of the pipeline and which of its numbers.
    results
        Theirs, by full names.
    notes
        What they say.
    """

    pipeline: Pipeline
    numbers: Mapping[str, tuple[str, int]]
    results: Mapping[str, Quantity]
    notes: tuple[str, ...]


def is_inner(design: Design, value: Value) -> bool:
    """Whether a value is that of a Model within the one that was asked."""
    return inner(design, value.element) is not None


def inner(design: Design, element: Element) -> Element | None:
    """The Model within the one that was asked around an element."""
    around = [one for one in element.ancestors() if one.tag == "Model" and one is not design.target]
    return next((one for one in reversed(around) if design.target in one.ancestors()), None)


def behind(case: Case, design: Design, source: Design, folder: Path, serve: Server) -> Upstream:
    """The case's pipeline behind the Models within the one that was asked.

    The ID of each is the name of the geometry whose place its surface takes; what deforms the
    case's geometry is built around the file that the case names, and bound to this surface.
    """
    pipeline, numbers = case.pipeline, {}
    results: dict[str, Quantity] = {}
    notes: list[str] = []
    makers: list[Construction] = []
    for number, model in enumerate(_asked(design, source)):
        if model.target.id not in case.tables.geometry:
            raise ParameterError(
                f"{source.document.place(model.target)}: its ID must be the name of a geometry of "
                f"{case.path}: {', '.join(case.tables.geometry) or 'it has none'}"
            )
        asked = _request(design, model)
        answer = serve(asked, model, folder / "models" / folder_name(model.target.id))
        (surface,) = answer.surfaces.values()
        metres = METRES[case.tables.geometry[model.target.id].units or "m"]
        scaled = Linearised(
            surface.surface.moved(np.asarray(surface.surface.points) * metres),
            {name: column * metres for name, column in surface.columns.items()},
        )
        values = {v.name: float(v.value or 0.0) for v in asked.variables}
        variable, maker = _maker(f"upstream_{number}", model.target.id, scaled, values)
        makers.append(maker)
        for k, name in enumerate(surface.columns):
            numbers[_outer(design, name)] = (variable, k)
        results |= {
            _outer(design, name): Quantity(
                one.value,
                None if one.gradient is None else
                {_outer(design, variable): slope for variable, slope in one.gradient.items()},
            )
            for name, one in answer.results.items()
        }  # fmt: skip
        notes += answer.notes
    if makers:
        pipeline = _rebuilt(case, makers)
    return Upstream(pipeline, numbers, results, tuple(notes))


def _asked(design: Design, source: Design) -> list[Design]:
    """The Models within, as the server's own document has them."""
    within = source.target.all("Model")
    for one in design.target.all("Model"):
        if one.id not in {model.id for model in within}:
            design.document.refuse(
                one, f"is not within {source.target.label} of {source.document.path}"
            )
    return [Design(source.document.part(model)) for model in within]


def _request(design: Design, model: Design) -> Design:
    """What is asked of a Model within: what the request says of it, else what it says itself."""
    within = [one for one in design.target.all("Model") if one.id == model.target.id]
    document = design.document.part(within[0]) if within else model.document
    return Design(asking(document, bool(differentiated(design))))


def _outer(design: Design, name: str) -> str:
    """The full name in the request of what a Model within calls so."""
    return design.target.full_name + JOINT + name


def _maker(
    variable: str, geometry: str, linearised: Linearised, values: dict[str, float]
) -> tuple[str, Construction]:
    """A step of a pipeline that makes the surface, and the variable that turns it."""
    shape = LinearisedShape(linearised, values)
    if not shape.size:
        return variable, Construction(shape, to=geometry, name=geometry)
    start = tuple(map(float, shape.start))
    free = (float("-inf"),) * shape.size, (float("inf"),) * shape.size
    turned = Variable(variable, start, *free, 1.0)
    link = Link(np.eye(shape.size), rest=np.asarray(shape.start))
    return variable, Construction(shape, {turned: link}, geometry, name=geometry)


def _rebuilt(case: Case, makers: list[Construction]) -> Pipeline:
    made = {maker.to for maker in makers}
    given = {
        name: case.pipeline.branches[name].geometry
        for name in case.tables.geometry
        if name not in made
    }
    return Pipeline(given, [*makers, *case.pipeline.stages], case.pipeline.result)
