"""Properties of Blender's data by their paths: what they are, and setting them."""

import re
from dataclasses import dataclass
from typing import Any

import bpy  # type: ignore[import-not-found,unused-ignore]

from .wrong import Wrong, there_are

PART = re.compile(
    r"""\.?(?P<name>[A-Za-z]\w*)|\[(?P<index>\d+)\]|\[(?P<quote>["'])(?P<key>.*?)(?P=quote)\]"""
)

KINDS = {"ROTATION": "angle", "LENGTH": "length"}
"""Of properties by their unit."""

FACTORS = ("FACTOR", "PERCENTAGE")


@dataclass(frozen=True)
class Place:
    """A property, or one number of one.

    Attributes
    ----------
    path
        What it is called by.
    owner, last
        What has it, and by which name, key or index.
    chain
        What the path leads through, from the owner back.
    """

    path: str
    owner: Any
    last: tuple[str, Any]
    chain: tuple[Any, ...]

    @property
    def block(self) -> Any:
        """The data-block that it belongs to, which is told of changes."""
        return next(one.id_data for one in self.chain if isinstance(one, bpy.types.bpy_struct))

    def read(self) -> list[float]:
        """Its numbers."""
        value = _step(self.owner, *self.last, self.path)
        numbers: list[Any] = (
            [value] if isinstance(value, (bool, int, float, str)) else _listed(value)
        )
        if not numbers or not all(type(number) is float for number in numbers):
            is_whole = numbers and all(isinstance(number, (bool, int)) for number in numbers)
            what = f"{value!r}, a whole number or a choice" if is_whole else f"{value!r}"
            raise Wrong(
                "parameter",
                f"{self.path} is {what}; what is turned are real numbers and lists of them",
            )
        return numbers

    def write(self, numbers: list[float], is_list: bool) -> None:
        """Set it."""
        kind, last = self.last
        value: Any = numbers if is_list else numbers[0]
        if kind == "name":
            setattr(self.owner, last, value)
        else:
            self.owner[last] = value

    @property
    def is_list(self) -> bool:
        """Whether it has several numbers."""
        return not isinstance(_step(self.owner, *self.last, self.path), float)

    @property
    def limits(self) -> tuple[float, float]:
        """Between which Blender keeps it."""
        form = self._form
        if form is None:
            return float("-inf"), float("inf")
        if isinstance(self.owner, bpy.types.ShapeKey) and form.identifier == "value":
            return self.owner.slider_min, self.owner.slider_max
        least, most = form.hard_min, form.hard_max
        return (
            least if least > -1e30 else float("-inf"),
            most if most < 1e30 else float("inf"),
        )

    @property
    def kind(self) -> str:
        """What it measures: angle, length, factor or number."""
        form = self._form
        if form is None:
            return "number"
        is_factor = form.subtype in FACTORS or isinstance(self.owner, bpy.types.ShapeKey)
        return "factor" if is_factor else KINDS.get(form.unit, "number")

    @property
    def driver(self) -> str:
        """The expression of a driver that sets it; "" where there is none."""
        found = getattr(self.block, "animation_data", None)
        own = self._own_path
        for curve in found.drivers if found else ():
            if curve.data_path == own and self.last[1] in (curve.array_index, *self._names):
                return curve.driver.expression or "(no expression)"
        return ""

    @property
    def _names(self) -> tuple[Any, ...]:
        return () if self.last[0] == "index" else (self.last[1],)

    @property
    def _own_path(self) -> str:
        """Its path from its data-block."""
        holder, last = self.owner, self.last
        if last[0] == "index" and len(self.chain) > 1:
            tail = PART.findall(self.path)[-2]
            holder, last = self.chain[1], ("name", tail[0]) if tail[0] else ("key", tail[3])
        start = "" if holder == self.block else holder.path_from_id()
        if last[0] == "key":
            return f'{start}["{last[1]}"]'
        return f"{start}.{last[1]}" if start else str(last[1])

    @property
    def _form(self) -> Any:
        """What Blender says about the property; None of one that users have added."""
        owner, (kind, last) = self.owner, self.last
        if kind == "index" and len(self.chain) > 1:
            owner, last = self.chain[1], PART.findall(self.path)[-2][0]
        if kind == "key" or not isinstance(owner, bpy.types.bpy_struct):
            return None
        form = owner.bl_rna.properties.get(last)
        return form if form is not None and form.type == "FLOAT" else None


def place(path: str) -> Place:
    """Find a property by its path from bpy.data."""
    text = path.strip().removeprefix("bpy.data.")
    parts, end = [], 0
    while end < len(text):
        match = PART.match(text, end)
        if match is None:
            raise Wrong(
                "parameter",
                f"{path!r} is no path of Blender's: it stops making sense at {text[end:]!r}; an "
                'example: objects["wing"].modifiers["Bend"].angle',
            )
        found = match.groupdict()
        kind = next(k for k in ("name", "index", "key") if found[k] is not None)
        parts.append((kind, int(found[kind]) if kind == "index" else found[kind]))
        end = match.end()
    if len(parts) < 2:
        raise Wrong("parameter", f"{path!r} leads to no property of anything")
    owner: Any = bpy.data
    chain: list[Any] = []
    for kind, last in parts[:-1]:
        owner = _step(owner, kind, last, path)
        chain.insert(0, owner)
    kind, last = parts[-1]
    if kind == "key" and isinstance(owner, bpy.types.NodesModifier):
        last = _socket(owner, last, path)
    found_place = Place(path, owner, (kind, last), tuple(chain))
    _step(owner, kind, last, path)
    return found_place


def _step(owner: Any, kind: str, last: Any, path: str) -> Any:
    """One part of a path further; an error says what there is."""
    try:
        if kind == "name":
            return getattr(owner, last)
        return owner[last]
    except (AttributeError, KeyError, IndexError, TypeError):
        pass
    if kind == "name":
        told = f"has no property {last!r}; {there_are(properties(owner))}"
    elif kind == "key":
        told = f"has nothing named {last!r}; {there_are(_keys(owner))}"
    else:
        told = f"has no number {last}; it has {len(owner) if hasattr(owner, '__len__') else 'none'}"
    raise Wrong("parameter", f"{path}: {_called(owner)} {told}")


def properties(owner: Any) -> list[str]:
    """Names of what can be turned, or else of all that leads on."""
    if not isinstance(owner, bpy.types.bpy_struct) and not hasattr(owner, "bl_rna"):
        return []
    own = [p for p in owner.bl_rna.properties if p.identifier != "rna_type"]
    turned = [p.identifier for p in own if p.type == "FLOAT" and not p.is_readonly]
    return turned or [p.identifier for p in own]


def sockets(modifier: Any) -> list[tuple[str, str]]:
    """Identifier and name of the inputs of a modifier of geometry nodes that are real numbers."""
    if modifier.node_group is None:
        return []
    return [
        (item.identifier, item.name)
        for item in modifier.node_group.interface.items_tree
        if item.item_type == "SOCKET"
        and item.in_out == "INPUT"
        and item.socket_type in ("NodeSocketFloat", "NodeSocketVector")
    ]


def _socket(modifier: Any, key: Any, path: str) -> str:
    """Identifier of an input of geometry nodes, by itself or by the name that users see."""
    if key in modifier.keys():  # noqa: SIM118, it is no dictionary
        return key
    known = sockets(modifier)
    found = [identifier for identifier, name in known if name == key]
    if len(found) != 1:
        raise Wrong(
            "parameter",
            f"{path}: {len(found)} inputs of the modifier {modifier.name!r} are named {key!r}; "
            f"{there_are([name for _, name in known])}",
        )
    return found[0]


def _listed(value: Any) -> list[Any]:
    try:
        return list(value)
    except TypeError:
        return []


def _keys(owner: Any) -> list[str]:
    try:
        return list(map(str, owner.keys()))
    except (AttributeError, TypeError):
        return []


def _called(owner: Any) -> str:
    if owner is bpy.data:
        return "the file"
    name = getattr(owner, "name", "")
    kind = getattr(getattr(owner, "bl_rna", None), "name", type(owner).__name__)
    return f"{kind} {name!r}" if name else str(kind)
