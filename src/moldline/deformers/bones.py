"""Bones: a tree of lines at rest, checked, and read from and written to a file."""

import json
import math
import numbers
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from jaxtyping import Float, Int

from .._types import ArrayLike
from ..errors import FileError, ParameterError
from ..mesh.io import METRES
from ..mesh.io.files import contents, replacing

LARGEST = 1e50
"""What a length in a file may be at most [m]: its fourth power is still a number."""

NAMED = 8
"""Bones that an error lists."""


@dataclass(frozen=True)
class Bone:
    """A line from head to tail at rest, and how far it acts [m].

    Its own axes are y, along it; z, which is `up` as far as that is across it; and x = y × z. A
    bone along the span of a wing has those of space.

    Attributes
    ----------
    name, parent
        Its name, and that of the bone whose tail it rides on; None for a root.
    head, tail
        Its ends.
    up
        Where its z axis points; by default z of space, or x for bones within 6 degrees of z.
    radii
        Thickness at head and tail: closer than that, being closer counts no more. By default a
        tenth of the length.
    reach
        For weights by distance: no point farther away follows the bone. By default infinite.
    distance, strength
        For weights by envelope: how far beyond the radii it acts, by default a quarter of the
        length, and a factor.
    """

    name: str
    head: ArrayLike
    tail: ArrayLike
    parent: str | None = None
    up: ArrayLike | None = None
    radii: ArrayLike | None = None
    reach: float = math.inf
    distance: float | None = None
    strength: float = 1.0

    def __post_init__(self) -> None:
        for field in fields(self):
            self._put(field.name, _checked(field.name, getattr(self, field.name)))
        if self.length <= 1e-12 * max(map(abs, self.head + self.tail)):
            raise ParameterError(f"tail: the bone has no length: head and tail are {self.head}")
        if self.radii is None:
            self._put("radii", (0.1 * self.length, 0.1 * self.length))
        if self.distance is None:
            self._put("distance", 0.25 * self.length)
        elif self.distance < 0:
            raise ParameterError(f"distance: not below 0, got {self.distance}")
        for key in ("radii", "reach", "strength"):
            if np.min(getattr(self, key)) <= 0:
                raise ParameterError(f"{key}: above 0, got {getattr(self, key)}")
        if np.linalg.norm(np.cross(self.along, self._up)) <= 1e-6 * np.linalg.norm(self._up):
            raise ParameterError(f"up: {self.up} has no part across the bone; turn it")

    def _put(self, key: str, value: Any) -> None:
        object.__setattr__(self, key, value)  # the class is frozen

    @property
    def length(self) -> float:
        """From head to tail [m]."""
        return math.dist(self.head, self.tail)

    @property
    def along(self) -> Float[np.ndarray, "3"]:
        """Unit vector from head to tail."""
        return (np.array(self.tail) - self.head) / self.length

    @property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """Its own axes x, y and z, as columns."""
        across = self._up - self.along * (self._up @ self.along)
        z = across / np.linalg.norm(across)
        return np.stack([np.cross(self.along, z), self.along, z], axis=1)

    @property
    def _up(self) -> np.ndarray:
        if self.up is not None:
            return np.array(self.up)
        return np.eye(3)[0 if abs(self.along[2]) > math.cos(0.1) else 2]


@dataclass(frozen=True)
class Bones(Sequence[Bone]):
    """A tree of bones, or several.

    Raises ParameterError where two have one name, a parent is missing, or bones are each other's
    parents.
    """

    bones: tuple[Bone, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "bones", tuple(self.bones))
        if not self.bones:
            raise ParameterError("a skeleton needs one bone at least, got none")
        names = [bone.name for bone in self.bones]
        known = set(names)
        if len(known) < len(names):
            twice = next(name for i, name in enumerate(names) if name in names[:i])
            raise ParameterError(f"two bones are named {twice!r}; give each its own name")
        for bone in self.bones:
            if bone.parent is not None and bone.parent not in known:
                listed = ", ".join(names[:NAMED]) + (" ..." if len(names) > NAMED else "")
                raise ParameterError(
                    f"bone {bone.name!r}: no bone is named as its parent, {bone.parent!r}; there "
                    f"is: {listed}"
                )
        _ = self.order

    def __len__(self) -> int:
        return len(self.bones)

    def __getitem__(self, index: Any) -> Any:
        return self.bones[index]

    def __iter__(self) -> Iterator[Bone]:
        return iter(self.bones)

    @cached_property
    def parents(self) -> Int[np.ndarray, "b"]:
        """Number of each bone's parent, -1 for roots."""
        numbers = {bone.name: i for i, bone in enumerate(self.bones)}
        return np.array([-1 if b.parent is None else numbers[b.parent] for b in self.bones])

    @cached_property
    def order(self) -> Int[np.ndarray, "b"]:
        """Numbers of the bones, parents before their children."""
        found: dict[int, None] = {}
        for number in range(len(self)):
            path: dict[int, None] = {}
            while number >= 0 and number not in found:
                if number in path:
                    circle = [self.bones[i].name for i in path][list(path).index(number) :]
                    raise ParameterError(
                        f"bone {circle[0]!r} is its own ancestor ({' < '.join(circle[:NAMED])} "
                        "...); leave out the parent of one of them"
                    )
                path[number] = None
                number = int(self.parents[number])
            found |= dict.fromkeys(reversed(path))
        return np.array(list(found))

    @property
    def heads(self) -> Float[np.ndarray, "b 3"]:
        """Heads at rest [m]."""
        return np.array([bone.head for bone in self.bones])

    @property
    def tails(self) -> Float[np.ndarray, "b 3"]:
        """Tails at rest [m]."""
        return np.array([bone.tail for bone in self.bones])

    @property
    def axes(self) -> Float[np.ndarray, "b 3 3"]:
        """The bones' own axes as columns of matrices."""
        return np.stack([bone.axes for bone in self.bones])

    @classmethod
    def read(cls, path: Path | str) -> "Bones":
        """From a TOML or JSON file: a list `bone` of tables whose keys are a Bone's attributes.

        A key `units` beside it tells the unit of length of all of them. Errors name file and key.
        """
        tables, scale = _tables(path)
        found = [_bone(path, f"bone.{i}", table, scale) for i, table in enumerate(tables)]
        try:
            return cls(tuple(found))
        except ParameterError as error:
            raise FileError(f"{path}: {error}") from None

    def write(self, path: Path | str) -> None:
        """To a TOML or JSON file, in metres; it reads back as these bones."""
        bones = [
            {f.name: value for f in fields(Bone) if _is_told(value := getattr(bone, f.name))}
            for bone in self.bones
        ]
        text = (
            json.dumps({"bone": bones}, indent=1)
            if _is_json(path)
            else tomli_w.dumps({"bone": bones})
        )
        with replacing(path) as stream:
            stream.write(text.encode())


def _is_told(value: Any) -> bool:
    return value is not None and value != math.inf


def _is_json(path: Path | str) -> bool:
    suffix = Path(os.fspath(path)).suffix.lower()
    if suffix not in (".toml", ".json"):
        raise FileError(f"{path}: bones are kept in files that end in .toml or .json")
    return suffix == ".json"


def _tables(path: Path | str) -> tuple[list[Any], float]:
    """What a file says of each bone, and its unit of length [m]."""
    is_json = _is_json(path)
    kind = "JSON" if is_json else "TOML"
    try:
        text = contents(path).decode()
        data = json.loads(text) if is_json else tomllib.loads(text)
    except ValueError as error:
        raise FileError(f"{path}: not {kind}: {str(error)[:300]}") from None
    except RecursionError:
        raise FileError(f"{path}: not {kind}: nested too deep") from None
    if not isinstance(data, dict) or not isinstance(data.get("bone"), list):
        raise FileError(f"{path}: bone: a list of bones must be there, [[bone]] in TOML")
    unknown = sorted(data.keys() - {"bone", "units"})
    if unknown:
        raise FileError(f"{path}: {unknown[0]!r}: there is no such key, only bone and units")
    units = data.get("units", "m")
    if not isinstance(units, str) or units not in METRES:
        raise FileError(f"{path}: units: one of {', '.join(METRES)}, got {units!r}")
    return data["bone"], METRES[units]


def _bone(path: Path | str, where: str, table: Any, scale: float) -> Bone:
    keys = {f.name: f.default is MISSING for f in fields(Bone)}
    if not isinstance(table, Mapping):
        raise FileError(f"{path}: {where}: a table with name, head and tail, got {table!r:.80}")
    unknown = sorted(table.keys() - keys)
    missing = [key for key, is_needed in keys.items() if is_needed and key not in table]
    if unknown or missing:
        key, told = (
            (unknown[0], "there is no such key") if unknown else (missing[0], "must be there")
        )
        raise FileError(f"{path}: {where}.{key}: {told}; a bone has {', '.join(keys)}")
    try:
        given = {key: _checked(key, value) for key, value in table.items()}
        return Bone(**{key: _scaled(key, value, scale) for key, value in given.items()})
    except ParameterError as error:
        raise FileError(f"{path}: {where}.{error}") from None


def _scaled(key: str, value: Any, scale: float) -> Any:
    if value is None or key in ("name", "parent", "up", "strength"):
        return value
    return tuple(scale * x for x in value) if isinstance(value, tuple) else scale * value


COUNTS = {"head": 3, "tail": 3, "up": 3, "radii": 2}
"""How many numbers a key takes, where it is more than one."""

OPTIONAL = ("parent", "up", "radii", "distance")
"""Keys that may be left open."""


def _checked(key: str, value: Any) -> Any:
    """What a key of a bone is to be: names, tuples of numbers and numbers."""
    if value is None and key in OPTIONAL:
        return None
    if key in ("name", "parent"):
        if not isinstance(value, str) or not value.strip() or not value.isprintable():
            raise ParameterError(f"{key}: a name of printable characters, got {value!r:.80}")
        return value
    if key not in COUNTS:
        return math.inf if key == "reach" and value == math.inf else _number(key, value)
    try:
        items = tuple(value)
    except TypeError:
        items = ()
    if len(items) != COUNTS[key]:
        raise ParameterError(f"{key}: {COUNTS[key]} numbers, got {value!r:.80}")
    return tuple(_number(key, item) for item in items)


def _number(key: str, value: Any) -> float:
    is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not is_number or not abs(value) < LARGEST:  # refuses nan too
        raise ParameterError(f"{key}: a number between -1e50 and 1e50, got {value!r:.80}")
    return float(value)
