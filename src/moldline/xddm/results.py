"""Results into a document: values, and derivatives as SensitivityArrays."""

from collections.abc import Mapping

from ..errors import ParameterError
from .chain import Quantity, full_name
from .document import Document
from .edit import Draft, Edit
from .element import Element
from .model import Design
from .numbers import written
from .vocabulary import INPUTS


def filled(design: Design, results: Mapping[str, Quantity]) -> Document:
    """The document with new Values and SensitivityArrays, by full names; the rest stays as it was.

    What an array holds already keeps its place and comments. Without derivatives an element ends
    up without an array: an old one would be wrong. Inputs get their Value alone.
    """
    edit = Edit()
    for name, result in results.items():
        if name not in design.by_name:
            raise ParameterError(
                f"{design.document.path}: nothing is named {name!r}, so its result has no place"
            )
        element = design.by_name[name].element
        edit.set_number(element, "Value", result.value)
        if element.tag not in INPUTS:
            _fill(edit, design, element, result.gradient)
    return design.document.edited(edit)


def _fill(
    edit: Edit, design: Design, element: Element, gradient: Mapping[str, float] | None
) -> None:
    arrays = element.all("SensitivityArray")
    for surplus in arrays if gradient is None else arrays[1:]:
        edit.remove(surplus)
    if gradient is None:
        return
    missing = dict(gradient)
    for one in arrays[0].all("Sensitivity") if arrays else ():
        name = full_name(design, one)
        if name in missing:
            edit.set_number(one, "Value", missing.pop(name))
        else:
            edit.remove(one)
    drafts = [
        Draft("Sensitivity", {"P": name, "Value": written("Value", slope)})
        for name, slope in missing.items()
    ]
    if not arrays:
        edit.add(element, Draft("SensitivityArray", children=drafts))
    for draft in drafts if arrays else ():
        edit.add(arrays[0], draft)
