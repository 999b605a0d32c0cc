"""An airfoil from what one calls it: a designation, a file of coordinates, or options."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .. import registry
from ..errors import ParameterError
from .airfoil import AbstractAirfoil
from .naca4 import Naca4

KNOWN = "a NACA number such as 2412"


def airfoil(given: Any, folder: Path = Path(), **options: Any) -> AbstractAirfoil:
    """The airfoil of a name, a path or options; what is one already passes through.

    Names are read without regard to case, spaces and dashes: "NACA 2412", "naca23012",
    "0012-64", "RAE 2822", "SC(2)-0714", "Onera D". A path ends in `.dat` and is relative to
    `folder`. A mapping names the family, {"airfoil": "naca4", "thickness": 0.15}, or anything
    that text may say, with options beside it.
    """
    if isinstance(given, AbstractAirfoil):
        return given
    if isinstance(given, Mapping):
        own = dict(given)
        family = own.pop("airfoil", None)
        if family is None:
            raise ParameterError(f"options of an airfoil must name it, airfoil = ..., got {given}")
        return airfoil(family, folder, **(options | own))
    if isinstance(given, str) and given in registry.modelers():
        return registry.modeler(given).build(folder, **options)
    plain = re.sub(r"[^a-z0-9()]", "", str(given).lower())
    for pattern, make in _FAMILIES:
        found = re.fullmatch(pattern, plain)
        if found:
            return make(found[1], **options)
    raise ParameterError(f"no airfoil is known as {given!r}; known are {KNOWN}")


_FAMILIES: list[tuple[str, Callable[..., AbstractAirfoil]]] = [(r"(?:naca)?(\d{4})", Naca4)]
