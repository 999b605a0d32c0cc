"""An airfoil from what one calls it: a designation, a file of coordinates, or options."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import ParameterError
from .airfoil import AbstractAirfoil
from .kulfan import Kulfan
from .naca4 import Naca4
from .naca5 import Naca5
from .naca_modified import NacaModified
from .tabulated import Tabulated, table, tables

FAMILIES: dict[str, type[AbstractAirfoil]] = {
    "naca4": Naca4,
    "naca5": Naca5,
    "naca_modified": NacaModified,
    "kulfan": Kulfan,
    "tabulated": Tabulated,
}
"""Families by the name that a mapping gives; others' are classes of their own."""

_DESIGNATIONS: list[tuple[str, type[AbstractAirfoil]]] = [
    (r"(?:naca)?-?(\d{4}-?\d{2})", NacaModified),
    (r"(?:naca)?-?(\d{5})", Naca5),
    (r"(?:naca)?-?(\d{4})", Naca4),
]


def airfoil(given: Any, folder: Path = Path(), **options: Any) -> AbstractAirfoil:
    """The airfoil of a name, a path or options; what is one already passes through.

    Names are read without regard to case, spaces and dashes: "NACA 2412", "naca23012",
    "0012-64", "RAE 2822", "SC(2)-0714", "Onera D". A path ends in `.dat` and is relative to
    `folder`. A mapping names the family, {"airfoil": "naca4", "thickness": 0.15}, or anything
    that text may say, with options beside it.
    """
    if isinstance(given, AbstractAirfoil):
        if options:
            raise ParameterError(
                f"{given.name} is an airfoil already; options {', '.join(options)} come too late"
            )
        return given
    if isinstance(given, Mapping):
        own = dict(given)
        if "airfoil" not in own:
            raise ParameterError(
                f"options of an airfoil need airfoil = its family or name beside them; got "
                f"{', '.join(map(str, own)) or 'none'}"
            )
        return airfoil(own.pop("airfoil"), folder, **(options | own))
    said = str(given)
    if said in FAMILIES:
        return _built(FAMILIES[said], folder, options)
    if said.lower().endswith(".dat") or table(said) is not None:
        return _built(Tabulated, folder, {"section": said, **options})
    short = re.sub(r"[\s_]", "", said.lower())
    for pattern, family in _DESIGNATIONS:
        found = re.fullmatch(pattern, short)
        if found:
            return _built(family, folder, {"designation": found[1], **options})
    raise ParameterError(
        f"no airfoil is known as {said!r}. Known are NACA's of four digits (2412), of five (23012) "
        f"and modified (0012-64), {', '.join(tables())}, files that end in .dat, and "
        f"the families {', '.join(FAMILIES)} with their options"
    )


def _built(
    family: type[AbstractAirfoil], folder: Path, options: Mapping[str, Any]
) -> AbstractAirfoil:
    unknown = [name for name in options if name not in family.options()]
    if unknown:
        raise ParameterError(
            f"{family.__name__} has no option {', '.join(unknown)}; it has "
            f"{', '.join(family.options())}"
        )
    try:
        made = family.build(folder, **options)
    except ParameterError:
        raise
    except (TypeError, ValueError, AttributeError) as error:  # words where numbers are due
        said = ", ".join(f"{name} = {value!r}" for name, value in options.items())
        raise ParameterError(f"{family.__name__} cannot be made of {said}: {error}") from None
    assert isinstance(made, AbstractAirfoil)
    return made
