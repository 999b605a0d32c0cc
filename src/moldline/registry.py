"""Names to classes, by entry point: ours and other people's are found alike."""

from functools import cache
from importlib.metadata import entry_points
from typing import Any

from .errors import ParameterError

GROUP = "moldline.deformers"


def deformers() -> list[str]:
    """Names of all installed deformers."""
    return sorted({point.name for point in entry_points(group=GROUP)})


@cache
def deformer(name: str) -> Any:
    """The class that is installed under a name."""
    found = {point.name: point for point in entry_points(group=GROUP)}
    if name not in found:
        raise ParameterError(f"no deformers named {name!r}; installed: {', '.join(deformers())}")
    return found[name].load()
