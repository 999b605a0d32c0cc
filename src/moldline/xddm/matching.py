"""Which number of which variable or measure of a case an ID in a document stands for."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from ..errors import ParameterError
from .model import Value


class Place(NamedTuple):
    """One number among those of a variable or a measure."""

    name: str
    number: int


def places(values: Iterable[Value], sizes: Mapping[str, int], what: str) -> dict[str, Place]:
    """Places of all values by their full names; each number is named but once.

    `dz[2]` is number 2 of dz, counted from 0 as everywhere in moldline. `dz[3,1]` is counted from
    1, as modelers write it: rows after each other. The name is the ID, or joined with the IDs of
    the namespaces around it, as in `sections_dz`, where the case has such a one.
    """
    groups: dict[str, list[Value]] = {}
    for value in values:
        groups.setdefault(stem(value, sizes, what), []).append(value)
    found: dict[str, Place] = {}
    taken: dict[Place, str] = {}
    for name, members in groups.items():
        columns = _columns(members)
        for value in members:
            place = Place(name, _number(value, sizes[name], columns, len(members), what))
            if place in taken:
                raise ParameterError(
                    f"{taken[place]} and {value.name} are both number {place.number} of the "
                    f"case's {what} {name!r}; keep one"
                )
            taken[place] = value.name
            found[value.name] = place
    return found


def stem(value: Value, known: Iterable[str], what: str) -> str:
    """The variable or measure whose number a value is."""
    names = dict.fromkeys(known)
    ids = [one.id for one in value.element.ancestors() if one.parent is not None and one.id]
    for count in range(len(ids), -1, -1):
        name = "_".join([*reversed(ids[:count]), value.base])
        if name in names:
            return name
    raise ParameterError(
        f"{value.name}: the case has no {what} {value.base!r}; it has: {', '.join(names) or 'none'}"
    )


def _columns(members: Iterable[Value]) -> int:
    """The most columns of any place in brackets."""
    return max((value.indices[1] for value in members if len(value.indices) == 2), default=1)


def _number(value: Value, size: int, columns: int, count: int, what: str) -> int:
    indices = value.indices
    if len(indices) == 2:
        if columns > 1 and count < size:
            raise ParameterError(
                f"{value.name}: of {count} numbers in {columns} columns nobody knows which of the "
                f"{size} of the case's {what} they are; name all, or write {value.base}[number]"
            )
        number = (indices[0] - 1) * columns + indices[1] - 1
        is_right = min(indices) > 0 and number < size
    else:
        number = indices[0] if indices else 0
        is_right = len(indices) == 1 if indices else size == 1
        is_right = is_right and number < size
    if not is_right:
        known = value.base if size == 1 else f"{value.base}[0] to {value.base}[{size - 1}]"
        raise ParameterError(f"{value.name}: the case's {what} has {size} numbers: {known}")
    return number
