"""Measures as attributes: a name, or a table such as `{measure = 'chord', at = 2.0}`."""

import math
import re
import tomllib
from typing import Any

from pydantic import ValidationError

from ..case.options import MeasureTable
from ..errors import ParameterError
from ..mesh.io.text import quoted

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def measure_table(text: str) -> MeasureTable:
    """What an attribute Measure says, as a case file would."""
    table: Any = {"measure": text.strip()}
    if text.lstrip().startswith("{"):
        try:
            table = tomllib.loads(f"table = {text.strip()}")["table"]
        except (ValueError, RecursionError) as problem:
            raise ParameterError(
                f"Measure={quoted(text)} is no table of TOML in one line: {problem}"
            ) from None
    try:
        return MeasureTable.model_validate(table)
    except ValidationError:
        raise ParameterError(
            f"Measure={quoted(text)}: expected the name of a measure, or a table such as "
            "{measure = 'chord', at = 2.0}"
        ) from None


def attribute(table: MeasureTable) -> str:
    """The same as text, without bounds."""
    given = table.model_dump(exclude_unset=True, exclude={"bounds"})
    return table.measure if len(given) == 1 else _inline(given)


def _inline(value: Any) -> str:
    """A value of TOML in one line."""
    if isinstance(value, dict):
        pairs = (f"{_key(k)} = {_inline(v)}" for k, v in value.items() if v is not None)
        return "{" + ", ".join(pairs) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_inline, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, int):
        return str(value)
    return _text(str(value))


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _text(key)


def _text(text: str) -> str:
    if "'" not in text and text.isprintable():
        return f"'{text}'"
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + re.sub(r"[\x00-\x1f\x7f]", lambda c: f"\\u{ord(c[0]):04x}", escaped) + '"'
