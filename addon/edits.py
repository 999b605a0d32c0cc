# SPDX-License-Identifier: GPL-3.0-or-later
"""What is written into a case for variables and measures: plain tables, without Blender."""

import functools
import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Edits = list[dict[str, Any]]
"""What `client.amend` takes: set, remove or append, each at a path of keys and indices."""

UNITS = {
    "": 1.0, "m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048,
    "rad": 1.0, "deg": math.pi / 180, "%": 0.01,
}  # fmt: skip
"""What one unit is in SI and radians; the names are those of case files."""

FREE = (-math.inf, math.inf)

LONGEST = 63
"""Bytes of a property's name in Blender."""

NETS = ("lattice", "control_volume", "cage")
"""Deformers whose control points are moved one by one."""


class Wrong(Exception):
    """An input that cannot serve; its text is a sentence for the person who gave it."""


@functools.lru_cache(maxsize=4)
def tables(text: str) -> dict[str, Any]:
    """What a case's text holds; empty tables where it is not TOML (the server says why)."""
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        return {}


def variables(case: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Tables of variables by name."""
    return case.get("variable", {})


def measures(case: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Tables of measures by name."""
    return case.get("measure", {})


def size_of(table: Mapping[str, Any]) -> int:
    """How many numbers a variable's table stands for."""
    value = table.get("value", 0.0)
    return int(table.get("size", len(value) if isinstance(value, list) else 1))


def values_of(table: Mapping[str, Any]) -> list[float]:
    """Its numbers as the case says them."""
    return _spread(table.get("value", 0.0), size_of(table))


def is_same(table: Any, numbers: Sequence[float]) -> bool:
    """Whether a variable's table, as a person may have written it, says these numbers."""
    try:
        return values_of(table) == list(numbers)
    except (AttributeError, TypeError, ValueError):
        return False


def bounds_of(table: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Lower and upper bound of each of its numbers."""
    given = table.get("bounds", FREE)
    if given and isinstance(given[0], list | tuple):
        return [(float(low), float(high)) for low, high in given]
    return [(float(given[0]), float(given[1]))] * size_of(table)


def labels_of(name: str, table: Mapping[str, Any]) -> list[str]:
    """A name for each number: t for one, t[0] t[1] ... for several."""
    size = size_of(table)
    return [name] if size == 1 else [f"{name}[{i}]" for i in range(size)]


def links_of(case: Mapping[str, Any], variable: str) -> list[tuple[int, int, dict[str, Any]]]:
    """Where a variable is linked: stage, number of the link, its table."""
    return [
        (i, j, link)
        for i, stage in enumerate(case.get("stage", []))
        for j, link in enumerate(stage.get("link", []))
        if link.get("variable") == variable
    ]


def unique(name: str, taken: Iterable[str]) -> str:
    """The name, or the first of name_2, name_3 ... that is free."""
    known = set(taken)
    number, found = 1, name
    while found in known:
        number += 1
        found = f"{name}_{number}"
    return found


def check_name(name: str, taken: Iterable[str], what: str) -> str:
    """A new name, as a case can hold it."""
    name = name.strip()
    if not name.isidentifier():
        raise Wrong(
            f"the name of a {what} is one word of letters, digits and underscores that does not "
            f"begin with a digit, got {name!r}"
        )
    if name in set(taken):
        raise Wrong(f"there is a {what} {name!r} already; choose another name")
    return name


def unfit(names: Iterable[str]) -> str:
    """What is wrong with a variable's name for a property of an object, or nothing."""
    for name in names:
        if name.startswith("moldline") or len(name.encode()) > LONGEST:
            return (
                f"variable {name!r}: in Blender a name has at most {LONGEST} bytes and does not "
                "begin with 'moldline'; choose another name"
            )
    return ""


def check_size(name: str, table: Mapping[str, Any], size: int) -> None:
    """A variable that is to move more has as many numbers as that takes."""
    if size_of(table) != size:
        raise Wrong(
            f"{name!r} has {size_of(table)} numbers, what is chosen takes {size}; they must be "
            f"as many to join"
        )


def check_bounds(lower: float, upper: float) -> list[float]:
    """A pair of bounds that leaves a choice."""
    if not lower < upper:
        raise Wrong(f"the lower bound must be below the upper one, got {lower:g} and {upper:g}")
    return [tidy(lower), tidy(upper)]


def tidy(number: float) -> float:
    """What was typed: Blender's fields hold single precision, 0.1 comes as 0.10000000149."""
    return float(f"{number:.7g}")


def stations(shape: Sequence[int], along: str, frozen: Sequence[bool] = ()) -> int:
    """How many stations a lattice has along an axis, without those where all is frozen."""
    axis = "xyz".index(along)
    held = list(frozen) or [False] * math.prod(shape)
    free = {_unravelled(n, shape)[axis] for n in range(math.prod(shape)) if not held[n]}
    return len(free)


def variable_table(
    size: int,
    value: float | Sequence[float] = 0.0,
    bounds: Sequence[Any] | None = None,
    unit: str = "",
    typical: float = 0.0,
) -> dict[str, Any]:
    """A variable that is not there yet; keys that say nothing are left out."""
    table: dict[str, Any] = {"size": size}
    table["value"] = float(value) if isinstance(value, int | float) else list(value)
    if bounds is not None:
        table["bounds"] = list(bounds)
    if typical > 0:
        table["typical"] = tidy(typical)
    return table | ({"unit": unit} if unit else {})


def as_change(measured: Mapping[str, Any]) -> dict[str, Any]:
    """A variable for the change of what another measures: zero, with bounds as wide."""
    pairs = zip(bounds_of(measured), values_of(measured), strict=True)
    near = [[tidy(low - value), tidy(high - value)] for (low, high), value in pairs]
    found = variable_table(size_of(measured), 0.0, near, measured.get("unit", ""))
    return found | ({} if "bounds" in measured else {"bounds": list(FREE)})


def new_link(stage: int, variable: str, link: Mapping[str, Any]) -> Edits:
    """One more link of a stage."""
    return [{"append": ["stage", stage, "link"], "value": {"variable": variable, **link}}]


def removed_variable(case: Mapping[str, Any], name: str) -> Edits:
    """Without a variable and its links; the last link of a stage goes first, so numbers hold."""
    gone = [{"remove": ["stage", i, "link", j]} for i, j, _ in reversed(links_of(case, name))]
    return [*gone, {"remove": ["variable", name]}]


def changed_variable(
    case: Mapping[str, Any], old: str, new: str, table: Mapping[str, Any]
) -> Edits:
    """A variable with another table, under another name where that is one, with its links."""
    was = variables(case)[old]
    if new == old:
        gone = [{"remove": ["variable", old, key]} for key in was if key not in table]
        keys = [key for key in table if table[key] != was.get(key)]
        return [*gone, *({"set": ["variable", old, key], "to": table[key]} for key in keys)]
    check_name(new, variables(case), "variable")
    turned = [
        {"set": ["stage", i, "link", j, "variable"], "to": new} for i, j, _ in links_of(case, old)
    ]
    return [
        {"set": ["variable", new], "to": dict(table)},
        *turned,
        {"remove": ["variable", old]},
    ]


def in_unit(table: Mapping[str, Any], unit: str) -> dict[str, Any]:
    """A variable's table in another unit: the same lengths and angles, in other numbers."""
    factor = UNITS[table.get("unit", "")] / UNITS[unit]
    if factor == 1.0:
        return dict(table) if unit == table.get("unit", "") else {**table, "unit": unit}
    found = dict(table)
    for key in ("value", "bounds", "typical"):
        if key in found:
            found[key] = _scaled(found[key], factor)
    return {**found, "unit": unit}


def bounds_around(
    values: Sequence[float], reach: float, by_share: bool, least: float = 1e-3
) -> list[Any]:
    """Bounds to both sides of each value, by a distance or by a share of its size."""
    if not reach > 0:
        raise Wrong(f"bounds reach to both sides of the value, by more than 0, got {reach:g}")
    pairs = []
    for value in values:
        half = max(abs(value) * reach, least * reach) if by_share else reach
        pairs.append([tidy(value - half), tidy(value + half)])
    is_one = all(pair == pairs[0] for pair in pairs)
    return pairs[0] if is_one else pairs


def kept(
    how: str, numbers: Sequence[float], slack: float, lower: float = 0.0, upper: float = 0.0
) -> list[Any] | None:
    """Bounds of a measure from its present numbers, or those given; None for none.

    `how` is FREE, EQUAL, LEAST, MOST, BETWEEN (within the share `slack` of the number) or NUMBERS.
    """
    if how == "FREE":
        return None
    if how == "NUMBERS":
        if not lower <= upper:
            raise Wrong(f"no number is at least {lower:g} and at most {upper:g}")
        return [tidy(lower), tidy(upper)]
    pairs: list[list[float]] = []
    for number in map(float, numbers):
        half = abs(number) * slack
        low = {"EQUAL": number, "LEAST": number, "BETWEEN": number - half}.get(how, -math.inf)
        high = {"EQUAL": number, "MOST": number, "BETWEEN": number + half}.get(how, math.inf)
        pairs.append([low, high])
    return pairs[0] if len(pairs) == 1 else pairs


def numbers_in(text: str, what: str) -> list[float]:
    """Numbers that a person wrote, apart by commas or spaces."""
    words = re.split(r"[,;\s]+", text.strip())
    try:
        found = [float(word) for word in words if word]
    except ValueError:
        raise Wrong(f"{what}: numbers apart by commas are expected, got {text!r}") from None
    if not all(map(math.isfinite, found)):
        raise Wrong(f"{what}: finite numbers are expected, got {text!r}")
    return found


def _unravelled(number: int, shape: Sequence[int]) -> list[int]:
    """(i, j, k) of a number that runs through a shape in C order."""
    found = []
    for count in reversed(shape):
        number, rest = divmod(number, count)
        found.append(rest)
    return found[::-1]


def _spread(value: Any, size: int) -> list[float]:
    return [float(v) for v in value] if isinstance(value, list) else [float(value)] * size


def _scaled(value: Any, factor: float) -> Any:
    return [_scaled(v, factor) for v in value] if isinstance(value, list) else value * factor
