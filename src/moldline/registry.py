"""Names to classes, by entry point: ours and other people's are found alike."""

from functools import cache
from importlib.metadata import entry_points
from typing import Any

from .errors import ParameterError

GROUPS = {kind: f"moldline.{kind}" for kind in ("deformers", "measures", "modelers")}


def deformers() -> list[str]:
    """Names of all installed deformers."""
    return _names("deformers")


def measures() -> list[str]:
    """Names of all installed measures."""
    return _names("measures")


def modelers() -> list[str]:
    """Names of all installed modelers."""
    return _names("modelers")


def deformer(name: str) -> Any:
    """The deformer that is installed under a name."""
    return _named("deformers", name)


def measure(name: str) -> Any:
    """The measure that is installed under a name."""
    return _named("measures", name)


def modeler(name: str) -> Any:
    """The modeler that is installed under a name."""
    return _named("modelers", name)


def _names(kind: str) -> list[str]:
    return sorted({point.name for point in entry_points(group=GROUPS[kind])})


@cache
def _named(kind: str, name: str) -> Any:
    found = {point.name: point for point in entry_points(group=GROUPS[kind])}
    if name not in found:
        raise ParameterError(f"no {kind} named {name!r}; installed: {', '.join(sorted(found))}")
    return found[name].load()
