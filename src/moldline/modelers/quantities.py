"""The named numbers that a shape is made of, in one vector."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float

from .._types import Array, Vector
from ..errors import ParameterError

Numbers: TypeAlias = float | Sequence[float] | np.ndarray
"""One number for all stations, or one each."""

MOST_POINTS = 2**26
"""More points than this have no place in memory."""


class Quantities(eqx.Module):
    """Numbers under names, one after another.

    What was given as one number for all of its places stays one number; a list has one each.

    Attributes
    ----------
    names
        In the order of their numbers.
    numbers
        Each name's own values [m, rad, 1].
    """

    names: tuple[str, ...] = eqx.field(static=True)
    numbers: tuple[np.ndarray, ...]

    def __init__(self, given: Mapping[str, Any]):
        self.names = tuple(given)
        self.numbers = tuple(np.array(given[name], float).ravel() for name in given)
        for name, own in zip(self.names, self.numbers, strict=True):
            if not np.isfinite(own).all():
                raise ParameterError(f"{name} must be finite numbers, got {own.tolist()}")

    @property
    def rows(self) -> dict[str, np.ndarray]:
        """Which numbers of the vector each name has."""
        ends = np.cumsum([0, *map(len, self.numbers)])
        return {name: np.arange(ends[i], ends[i + 1]) for i, name in enumerate(self.names)}

    @property
    def values(self) -> Float[np.ndarray, "k"]:
        """All of them."""
        return np.concatenate([np.asarray(own) for own in self.numbers])

    def parted(self, vector: Vector) -> dict[str, Array]:
        """The numbers of each name, out of other ones in the same order."""
        vector = vector if isinstance(vector, jax.Array) else np.asarray(vector)
        size = sum(map(len, self.numbers))
        if vector.shape != (size,):
            raise ParameterError(
                f"this shape has {size} parameters ({', '.join(self.names)}), got "
                f"{vector.size} numbers"
            )
        return {name: vector[rows[0] : rows[-1] + 1] for name, rows in self.rows.items()}


def spread(name: str, given: Any, count: int, what: str) -> Float[np.ndarray, "_"]:
    """One number for all, or one each."""
    numbers = np.array(given, float)
    if numbers.shape not in ((), (1,), (count,)):
        raise ParameterError(
            f"{name} takes one number for all or {count}, one for each {what}; got {given}"
        )
    return np.atleast_1d(numbers)


def positive(name: str, numbers: np.ndarray, unit: str = "m") -> None:
    """Refuse sizes that are not above 0."""
    if not np.all(numbers > 0):
        raise ParameterError(f"{name} must be above 0 [{unit}], got {numbers.tolist()}")


def finite(**given: float | None) -> None:
    """Refuse what is no number; None, which stands for nothing given, passes."""
    for name, value in given.items():
        if value is not None and not np.isfinite(value):
            raise ParameterError(f"{name} must be a finite number, got {value}")


def reaches(name: str, given: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    """How far stations are from the first, and what takes numbers to the places of all stations.

    One number is the last one's distance, with the others spread evenly between; a list has the
    distance of each station but the first.
    """
    numbers = np.array(given, float)
    if numbers.ndim == 0:
        positive(name, numbers[None])
        return numbers[None], np.linspace(0.0, 1.0, count)[:, None]
    if numbers.shape != (count - 1,):
        raise ParameterError(
            f"{name} takes one number, or the distance from the first station of each of the "
            f"{count - 1} others; got {given}"
        )
    ascending(name, numbers)
    return numbers, np.eye(count)[:, 1:]


def ascending(name: str, numbers: np.ndarray) -> None:
    """Refuse distances of stations that turn back."""
    if not np.all(np.diff(numbers, prepend=0.0) > 0):
        raise ParameterError(
            f"{name} has the distances of stations from the first one, ascending and above 0 [m]; "
            f"got {numbers.tolist()}"
        )


def radians(is_degrees: bool, **angles: Any) -> dict[str, Any]:
    """Angles in radians, which they are unless given in degrees; lists stay lists."""
    if not is_degrees:
        return angles
    turned = {name: np.radians(given) for name, given in angles.items()}
    return {name: given.tolist() for name, given in turned.items()}


def choices(**given: tuple[Any, Any]) -> None:
    """Refuse what is none of the words that an option takes."""
    for name, (value, allowed) in given.items():
        words = getattr(allowed, "__args__", allowed)
        if value not in words:
            raise ParameterError(
                f"{name} must be one of {', '.join(map(str, words))}; got {value!r}"
            )


def base_points_of(given: int, is_blunt: bool) -> int:
    """Points inside a base, checked."""
    if given < 0 or (given and not is_blunt):
        raise ParameterError(
            f"base_points = {given}: it must be 0 or more, and 0 where the trailing edge is sharp"
        )
    return given


def affordable(**counts: int) -> None:
    """Refuse more points than have a place in memory."""
    if np.prod([float(count) for count in counts.values()]) > MOST_POINTS:
        told = " and ".join(f"{name} = {count}" for name, count in counts.items())
        raise ParameterError(f"{told} make more than {MOST_POINTS} points; give fewer")


def even_ring(around: int) -> int:
    """Edges in half a ring of so many."""
    if around < 6 or around % 2:
        raise ParameterError(f"around must be an even number, 6 at least; got {around}")
    return around // 2


def station_count(each: Mapping[str, Any], panels: Mapping[str, Any], what: str) -> int:
    """Stations: as many as the lists say, or two.

    What speaks of each station has one entry for it, what speaks of panels one less.
    """
    said = {name: len(given) for name, given in each.items() if _is_list(given)}
    said |= {name: len(given) + 1 for name, given in panels.items() if _is_list(given)}
    if len(set(said.values())) > 1:
        told = ", ".join(f"{name} for {count}" for name, count in said.items())
        raise ParameterError(
            f"lists must speak of the same number of stations, got {told}; "
            f"{', '.join(each)} have one entry for each station, {', '.join(panels)} one less"
        )
    count = next(iter(said.values()), 2)
    if count < 2:
        raise ParameterError(f"a {what} needs two or more stations, its lists have {count}")
    return count


def placed(origin: Any, is_halved: bool, what: str) -> np.ndarray:
    """A place (x, y, z), without y where a mirror plane at y = 0 is to stay."""
    place = np.array(origin, float)
    if place.shape != (3,):
        raise ParameterError(f"origin is a place (x, y, z), got {origin}")
    if not is_halved:
        return place
    if place[1] != 0:
        raise ParameterError(f"{what} begins at y = 0, got origin = {origin}")
    return place[[0, 2]]


def _is_list(given: Any) -> bool:
    return isinstance(given, list | tuple) or (isinstance(given, np.ndarray) and given.ndim > 0)
