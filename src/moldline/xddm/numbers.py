"""Numbers of XDDM documents: how they are read, and how they are written."""

import math
import re

from ..errors import ParameterError
from ..mesh.io.text import quoted

UNSET = -888888.0
"""What stands for no number."""

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def number(text: str) -> float | None:
    """A finite decimal number; None if it is empty or reserved for what is not set."""
    stripped = text.strip(" \t\r\n")
    if not stripped:
        return None
    if not _NUMBER.fullmatch(stripped) or not math.isfinite(value := float(stripped)):
        raise ParameterError(
            f"{quoted(text)} is no finite decimal number; expected one such as 1.5 or -2e-3"
        )
    return None if value == UNSET else value


def written(attribute: str, value: float) -> str:
    """A number as text: all its digits for a Value, as few as `%g` for others."""
    if not math.isfinite(value):
        raise ParameterError(f"{attribute} is {value}, expected a finite number to write")
    return f"{value:.17e}" if attribute.lower() == "value" else f"{value:g}"
