"""Which derivatives a document asks for."""

from .document import Document
from .edit import Draft, Edit
from .model import Design, Value


def differentiated(design: Design) -> tuple[Value, ...]:
    """Variables by which results and the surface are differentiated.

    All of them as soon as anything asks for derivatives, but for those that say
    `Sensitivity="None"` themselves; a Configure wins.
    """
    if design.switch is False or not any(value.is_required for value in design.values):
        return ()
    return tuple(
        value
        for value in design.variables
        if design.switch or (value.element.get("Sensitivity") or "").strip().lower() != "none"
    )


def asking(document: Document, is_required: bool) -> Document:
    """The document with a Configure that asks for all derivatives, or for none."""
    word = "Required" if is_required else "None"
    found = [e for e in document.root.descendants() if e.tag == "Configure"]
    edit = Edit()
    if found:
        edit.set(found[0], "Sensitivity", word)
    else:
        edit.add(document.root, Draft("Configure", {"Sensitivity": word}))
    return document.edited(edit)
