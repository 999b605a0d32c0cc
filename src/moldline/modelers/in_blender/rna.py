"""Properties of Blender's data by their paths: what they are, and setting them."""

import re
from dataclasses import dataclass
from typing import Any, NamedTuple

import bpy  # type: ignore[import-not-found,unused-ignore]

from .wrong import Wrong, there_are

PART = re.compile(
    r"""\.?(?P<name>[A-Za-z]\w*)|\[(?P<index>\d+)\]|\[(?P<quote>["'])(?P<key>.*?)(?P=quote)\]"""
)

KINDS = {"ROTATION": "angle", "LENGTH": "length"}
"""Of properties by their unit."""

FACTORS = ("FACTOR", "PERCENTAGE")


class Step(NamedTuple):
    """A part of a path: from what it goes on, and by a name, a key or an index."""

    owner: Any
    kind: str
    last: Any


@dataclass(frozen=True)
class Place:
    """A property, or one number of one.

    Attributes
    ----------
    path
        What it is called by.
    steps
        What the path leads through.
    """

    path: str
    steps: tuple[Step, ...]

    @property
    def block(self) -> Any:
        """The data-block that it belongs to, which is told of changes."""
        return next(
            step.owner.id_data
            for step in reversed(self.steps)
            if isinstance(step.owner, bpy.types.bpy_struct)
        )

    def read(self) -> list[float]:
        """Its numbers."""
        value = self._value
        numbers: list[Any] = _listed(value)
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
        owner, kind, last = self.steps[-1]
        value: Any = numbers if is_list else numbers[0]
        if kind == "name":
            setattr(owner, last, value)
        else:
            owner[last] = value

    @property
    def is_list(self) -> bool:
        """Whether it has several numbers."""
        return not isinstance(self._value, float)

    @property
    def limits(self) -> tuple[float, float]:
        """Between which Blender keeps it."""
        form, owner = self._form, self._whole.owner
        if form is None:
            return float("-inf"), float("inf")
        if isinstance(owner, bpy.types.ShapeKey) and form.identifier == "value":
            return owner.slider_min, owner.slider_max
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
        is_factor = form.subtype in FACTORS or isinstance(self._whole.owner, bpy.types.ShapeKey)
        return "factor" if is_factor else KINDS.get(form.unit, "number")

    @property
    def driver(self) -> str:
        """The expression of a driver that sets it; "" where there is none."""
        animation = getattr(self.block, "animation_data", None)
        owner, kind, last = self._whole
        start = "" if owner == self.block else owner.path_from_id()
        own = f'{start}["{last}"]' if kind == "key" else f"{start}.{last}".removeprefix(".")
        index = self.steps[-1].last if self.steps[-1].kind == "index" else None
        for curve in animation.drivers if animation else ():
            if curve.data_path == own and index in (None, curve.array_index):
                return curve.driver.expression or "(no expression)"
        return ""

    @property
    def _value(self) -> Any:
        return _step(*self.steps[-1], self.path)

    @property
    def _whole(self) -> Step:
        """The property, where the path is of one of its numbers."""
        is_part = self.steps[-1].kind == "index" and len(self.steps) > 1
        return self.steps[-2] if is_part else self.steps[-1]

    @property
    def _form(self) -> Any:
        """What Blender says about the property; None of one that users have added."""
        owner, kind, last = self._whole
        if kind != "name" or not isinstance(owner, bpy.types.bpy_struct):
            return None
        form = owner.bl_rna.properties.get(last)
        return form if form is not None and form.type == "FLOAT" else None


def place(path: str) -> Place:
    """Find a property by its path from bpy.data."""
    text = path.strip().removeprefix("bpy.data.")
    steps: list[Step] = []
    owner, end = bpy.data, 0
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
        last: Any = int(found[kind]) if kind == "index" else found[kind]
        step = Step(owner, kind, last)
        if kind == "key" and isinstance(owner, bpy.types.NodesModifier):
            step = _input(owner, last, path)
        owner, end = _step(*step, path), match.end()
        steps.append(step)
    if len(steps) < 2:
        raise Wrong("parameter", f"{path!r} leads to no property of anything")
    return Place(path, tuple(steps))


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


def _input(modifier: Any, key: str, path: str) -> Step:
    """An input of geometry nodes, by its identifier or by the name that users see."""
    known = sockets(modifier)
    found = [identifier for identifier, name in known if key in (identifier, name)]
    if len(found) != 1:
        raise Wrong(
            "parameter",
            f"{path}: {len(found)} inputs of the modifier {modifier.name!r} are named {key!r}; "
            f"{there_are([name for _, name in known])}",
        )
    if hasattr(modifier, "properties"):  # Blender 5.2 and later
        return Step(getattr(modifier.properties.inputs, found[0]), "name", "value")
    return Step(modifier, "key", found[0])


def _listed(value: Any) -> list[Any]:
    if isinstance(value, (bool, int, float, str)):
        return [value]
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
