"""What a worker answers: each operation takes a case and a request, and gives a message."""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from ..mesh import Geometry, Surface
from ..parameters.variable import Variable
from ..pipeline.pipeline import Pipeline
from . import description
from .checks import checked, point_normals
from .fitting import fitted
from .held import Held, array, numbers, text
from .protocol import Message, ServerError

Operation: TypeAlias = Callable[[Held, Message], Message]


def describe(held: Held, ask: Message) -> Message:
    """All that does not change with the values, and the result's points at rest and triangles."""
    shape = geometry(held, ask)
    own = {"case": ask.header.get("case")}
    return Message({**description.of_case(held.case), **shape.header, **own}, shape.arrays)


def geometry(held: Held, ask: Message) -> Message:
    """A geometry at the variables' own values before its stages, and what joins its points."""
    pipeline = held.pipeline(ask)
    fields, arrays = description.of_geometry(pipeline.geometry)
    fields["connectivity"] = held.connectivity(ask, pipeline.geometry)
    return Message(fields, {"points": np.asarray(pipeline.geometry.points), **arrays})


def values(held: Held, ask: Message) -> Message:
    """The full set of values, checked."""
    return Message({}, {name: np.asarray(v) for name, v in held.values(ask).items()})


def points(held: Held, ask: Message) -> Message:
    """Points for some values; with `rest`, before the stages on them.

    Triangles come along where they are others than those whose name the request gives as
    `connectivity`: a union may have been made anew.
    """
    pipeline, full = held.pipeline(ask), held.values(ask)
    if _is_joined(pipeline):
        shape: Geometry = pipeline(full)
        found = pipeline.source(full) if ask.header.get("rest") else shape.points
    else:
        shape = pipeline.geometry
        found = _source(pipeline, full) if ask.header.get("rest") else pipeline.points(full)
    fields, arrays = _joining(held, ask, pipeline, shape)
    if ask.header.get("measures"):
        own = measures(held, ask)
        fields["beyond"] = own.header["beyond"]
        arrays |= {f"measures.{name}": one for name, one in own.arrays.items()}
    return Message(fields, {"points": _as_asked(ask, found), **arrays})


def handles(held: Held, ask: Message) -> Message:
    """What a hand can move, before and at some values."""
    full = held.values(ask)
    told: list[dict[str, Any]] = []
    arrays: dict[str, np.ndarray] = {}
    for i, hand in enumerate(held.hands.values()):
        shape = (-1, 3, 3) if hand.kind == "bones" else (-1, 3)
        arrays[f"lines.{i}"] = np.asarray(hand.lines, np.int32).reshape(-1, 2)
        arrays[f"rest.{i}"] = hand.rest(full).reshape(shape)
        arrays[f"moved.{i}"] = hand.places(full).reshape(shape)
        arrays[f"frozen.{i}"] = hand.frozen
        told.append(hand.as_dict())
    return Message({"handles": told}, arrays)


def follow(held: Held, ask: Message) -> Message:
    """Values that bring what a hand moves where it wants it, and the points for them."""
    hand, full = held.hand(ask), held.values(ask)
    rest = hand.rest(full)
    count, parts = len(hand.labels), len(rest) // max(len(hand.labels), 1)
    shape = (count, 3, 3) if hand.kind == "bones" else (count, 3)
    moved = array(ask, "moved", shape).reshape(-1, 3)
    touched = None
    if "touched" in ask.arrays:
        touched = np.repeat(array(ask, "touched", (count,)) != 0, parts)
    numbers, distance, at_bounds = fitted(
        hand.reach,
        hand.reach.numbers(full),
        moved,
        touched,
        lambda x: hand.places({**full, **hand.reach.named(x)}),
        lambda x: hand.slopes({**full, **hand.reach.named(x)}),
        hand.is_linear,
    )
    changed = hand.reach.named(numbers)
    shown = points(held, ask._replace(header={**ask.header, "values": {**full, **changed}}))
    miss = {"distance": distance, "at_bounds": at_bounds}
    own = {f"values.{name}": one for name, one in changed.items()}
    return Message({**shown.header, "miss": miss}, {**shown.arrays, **own})


def pushforward(held: Held, ask: Message) -> Message:
    """Motion of the points along a change of the values."""
    directions = numbers(ask.header.get("directions") or {}, "directions")
    motion = held.pipeline(ask).pushforward(held.values(ask), directions)
    return Message({}, {"motion": _as_asked(ask, motion)})


def pullback(held: Held, ask: Message) -> Message:
    """Gradient by the variables, from the derivative by the points."""
    pipeline, full = held.pipeline(ask), held.values(ask)
    cotangent = array(ask, "cotangent", (None, 3))
    gradient = pipeline.pullback(full, cotangent)
    return Message({}, {name: np.asarray(one) for name, one in gradient.items()})


def sensitivity(held: Held, ask: Message) -> Message:
    """Derivative of every point by every number of one variable."""
    pipeline = held.pipeline(ask)
    variable = _variable(pipeline, text(ask, "variable"))
    columns = pipeline.sensitivity(held.values(ask), variable.name)
    return Message({"labels": variable.labels()}, {"sensitivity": _as_asked(ask, columns)})


def colour(held: Held, ask: Message) -> Message:
    """How far each point moves for a unit of one number: along the outward normal, or at all."""
    pipeline, full, how = held.pipeline(ask), held.values(ask), text(ask, "how", "normal")
    variable = _variable(pipeline, text(ask, "variable"))
    number = ask.header.get("number", 0)
    if type(number) is not int or not 0 <= number < variable.size:
        raise ServerError(
            "parameter",
            f"{variable.name!r} has {variable.size} numbers, counted from 0, got {number!r:.20}",
        )
    if how not in ("normal", "size"):
        raise ServerError("parameter", f"'how' is 'normal' or 'size', got {how!r:.20}")
    motion = np.asarray(pipeline.pushforward(full, {variable.name: np.eye(variable.size)[number]}))
    shape = pipeline(full)
    if how == "normal" and isinstance(shape, Surface):
        found = np.einsum("ij,ij->i", motion, point_normals(shape))
    else:
        how, found = "size", np.linalg.norm(motion, axis=1)
    return Message({"how": how}, {"colour": found})


def measures(held: Held, ask: Message) -> Message:
    """Numbers of the measures and what is beyond its bounds; with `derivatives`, those too."""
    measurements, full = held.case.measurements, held.values(ask)
    if not measurements.constraints:
        return Message({"beyond": {}}, {})
    found = measurements(full)
    beyond = {name: miss.tolist() for name, miss in measurements.beyond(found).items()}
    arrays = dict(found)
    if ask.header.get("derivatives"):
        for name, slopes in measurements.jacobian(full).items():
            arrays |= {f"{name}/{variable}": one for variable, one in slopes.items()}
    return Message({"beyond": beyond}, arrays)


def nets(held: Held, ask: Message) -> Message:
    """Control points before and after with the lines that join them, for display."""
    from ..plot.pictures import nets as drawn  # brings Matplotlib

    found = drawn(held.pipeline(ask), held.values(ask))
    arrays = {}
    for i, net in enumerate(found):
        arrays[f"lines.{i}"] = np.asarray(net.lines, np.int32).reshape(-1, 2)
        arrays[f"rest.{i}"] = np.asarray(net.rest, float)
        arrays[f"moved.{i}"] = np.asarray(net.moved, float)
    return Message({"nets": len(found), "hidden": [bool(net.is_hidden) for net in found]}, arrays)


def embed(held: Held, ask: Message) -> Message:
    """Tie the deformation to points of the client's own, under a name."""
    name, on = text(ask, "name"), text(ask, "on", "")
    if not name.isidentifier() or not held.is_free(name):
        raise ServerError("parameter", f"{name!r:.60} is no word, or names something in the case")
    base = on or held.case.pipeline.leading
    if base not in held.case.pipeline.branches:
        raise ServerError("unknown name", f"no geometry is called {base!r:.60}")
    own = array(ask, "points", (None, 3))
    key = (text(ask, "case"), name)
    held.embedded[key] = held.case.pipeline.embed(own, base, name)
    return Message({"name": name, "points": len(own)}, {})


def save(held: Held, ask: Message) -> Message:
    """Write the case file with new values."""
    path = text(ask, "path")
    held.case.save(path, held.values(ask))
    return Message({"path": path}, {})


def check(held: Held, ask: Message) -> Message:
    """Health of the present shape; with `deep`, folds of space and a proof of derivatives."""
    pipeline, full = held.pipeline(ask), held.values(ask)
    report, bad = checked(pipeline, full, bool(ask.header.get("deep")))
    return Message(report, {"bad_faces": bad})


def ping(held: Held, ask: Message) -> Message:
    """Nothing, from the process that holds the case."""
    return Message({}, {})


def forget(held: Held, ask: Message) -> Message:
    """A client has closed the case: what it embedded is dropped."""
    held.forget(text(ask, "case"))
    return Message({}, {})


OPERATIONS: dict[str, Operation] = {
    one.__name__: one
    for one in (
        describe, geometry, values, points, handles, follow, pushforward, pullback, sensitivity,
        colour, measures, nets, embed, save, check, ping, forget,
    )
}  # fmt: skip


def _variable(pipeline: Pipeline, name: str) -> Variable:
    if name not in pipeline.variables:
        there = ", ".join(pipeline.variables)
        raise ServerError("unknown name", f"no variable {name!r:.60}; there is: {there}")
    return pipeline.variables[name]


def _is_joined(pipeline: Pipeline) -> bool:
    """Whether the result is made from other geometries, so that its triangles may change."""
    return len(pipeline.feeding) > 1


def _source(pipeline: Pipeline, full: dict[str, Any]) -> Any:
    if "/" in pipeline.result:  # what rides has its own points at rest
        return pipeline.geometry.points
    return pipeline.source(full)


def _as_asked(ask: Message, found: Any) -> np.ndarray:
    """In single precision where the request says so, as Blender holds its points."""
    kind = ask.header.get("dtype", "<f8")
    if kind not in ("<f8", "<f4"):
        raise ServerError("malformed", f"'dtype' is '<f8' or '<f4', got {kind!r:.20}")
    return np.asarray(found).astype(kind, copy=False)


def _joining(
    held: Held, ask: Message, pipeline: Pipeline, shape: Geometry
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The name of a shape's triangles, whether they were made anew, and they where not known."""
    fields: dict[str, Any] = {"made_anew": False}
    arrays: dict[str, np.ndarray] = {}
    known = ask.header.get("connectivity")
    if known is None and not _is_joined(pipeline):
        return fields, arrays
    fields["connectivity"] = held.connectivity(ask, shape)
    own = getattr(pipeline.geometry, "faces", None)
    if isinstance(shape, Surface) and _is_joined(pipeline):
        fields["made_anew"] = shape.faces is not own
    if known is not None and known != fields["connectivity"]:
        told, arrays = description.of_geometry(shape)
        fields |= told
    return fields, arrays
