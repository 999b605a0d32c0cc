"""What is done without a case: geometries read and written, and the text of cases."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ..case import drafting, editing
from ..errors import GeometryError
from ..mesh import Cloud, Geometry, Grid, Section, Surface, VolumeMesh, io
from ..mesh.boundary import boundary
from .held import array, text
from .protocol import Message, ServerError

Work: TypeAlias = Callable[[Message], Message]


def formats(ask: Message) -> Message:
    """Endings of files and names of their formats, of those read and those written."""
    own = {
        kind: [
            {"ending": ending, "name": module.NAME}
            for module in io.FORMATS
            if hasattr(module, kind) and (kind == "read" or module.HOLDS is not VolumeMesh)
            for ending in module.SUFFIXES
        ]
        for kind in ("read", "write")
    }
    return Message(own, {})


def read(ask: Message) -> Message:
    """A geometry from a file: its points, what joins them, and the data of its points."""
    path = _place(ask, "path")
    found = io.read(path, units=_optional(ask, "units"))
    fields, arrays = _joined(found)
    own = {"kind": type(found).__name__.lower(), "path": str(path)}
    return Message({**own, **fields}, arrays)


def write(ask: Message) -> Message:
    """Write a surface, a section or patches, in the format that the file's name tells."""
    path = _place(ask, "path")
    io.write(path, _given(ask), units=_optional(ask, "units"), format=_optional(ask, "format"))
    return Message({"path": str(path)}, {})


def draft(ask: Message) -> Message:
    """A case's text with one more stage of some kind."""
    options = ask.header.get("options") or {}
    if not isinstance(options, dict):
        raise ServerError("malformed", f"'options' are by name, got {json.dumps(options):.60}")
    found = drafting.drafted(
        text(ask, "text"),
        _place(ask, "folder"),
        text(ask, "kind"),
        geometry=_optional(ask, "geometry"),
        units=_optional(ask, "units"),
        on=text(ask, "on", ""),
        is_bounded=bool(ask.header.get("bounded", True)),
        options=options,
    )
    return Message(found._asdict(), {})


def amend(ask: Message) -> Message:
    """A case's text with some edits."""
    edits = ask.header.get("edits")
    if not isinstance(edits, list):
        raise ServerError("malformed", f"'edits' is a list, got {json.dumps(edits):.60}")
    return Message({"text": editing.amended(text(ask, "text"), edits)}, {})


def relocate(ask: Message) -> Message:
    """Write a case's text to a file elsewhere, with the names of its files made right."""
    path, folder = _place(ask, "path"), _place(ask, "folder")
    found = drafting.relocated(text(ask, "text"), folder, path, bool(ask.header.get("gather")))
    return Message({"text": found, "path": str(path)}, {})


WORKSHOP: dict[str, Work] = {
    one.__name__: one for one in (formats, read, write, draft, amend, relocate)
}


def _place(ask: Message, name: str) -> Path:
    """A full path of a request's header."""
    given = text(ask, name)
    if "\0" in given or not Path(given).is_absolute():
        raise ServerError("parameter", f"{given!r:.80}: give a full path, from the root")
    return Path(given)


def _optional(ask: Message, name: str) -> str | None:
    return None if ask.header.get(name) is None else text(ask, name)


def _joined(found: Geometry) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Names of a geometry's parts, and its arrays; of a volume mesh, those of its boundary."""
    if isinstance(found, VolumeMesh):
        return _joined(boundary(found)[0])
    fields: dict[str, Any] = {"components": list(getattr(found, "components", ()))}
    arrays = {"points": np.asarray(found.points, float)}
    if isinstance(found, Surface):
        arrays |= {"faces": np.asarray(found.faces), "tags": np.asarray(found.tags)}
        for name, one in found.point_data.items():
            arrays[f"data.{name}"] = np.asarray(one, float)
    elif isinstance(found, Grid):
        sizes = [2 * (i - 1) * (j - 1) if k == 1 else 0 for i, j, k in found.shapes]
        fields["components"] = [f"block {n + 1}" for n in range(len(sizes))]
        fields["shapes"] = [list(shape) for shape in found.shapes]
        arrays |= {"faces": np.asarray(found.faces, np.int32)}
        arrays["tags"] = np.repeat(np.arange(len(sizes), dtype=np.int32), sizes)
    elif isinstance(found, Section):
        fields |= {"components": [found.name], "is_closed": found.is_closed}
        arrays["lines"] = np.asarray(found.segments, np.int32)
    return fields, arrays


def _given(ask: Message) -> Geometry:
    """The geometry that came with a request."""
    points = array(ask, "points", (None, 3))
    components = _names(ask)
    data = {k.removeprefix("data."): v for k, v in ask.arrays.items() if k.startswith("data.")}
    if "faces" in ask.arrays:
        faces = _numbers(ask, "faces", 2)
        tags = _numbers(ask, "tags", 1) if "tags" in ask.arrays else None
        if faces.shape[1] == 4:
            faces = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
            tags = None if tags is None else np.concatenate([tags, tags])
        if faces.shape[1] != 3:
            raise GeometryError(f"faces have 3 or 4 corners, got the shape {faces.shape}")
        return Surface(points, faces, tags, components or None, point_data=data)
    if shapes := ask.header.get("shapes"):
        return Grid(points, _shapes(shapes))
    if io.named_by(text(ask, "path")).HOLDS is Section:
        name = components[0] if components else "section"
        return Section(points, name, bool(ask.header.get("is_closed")))
    return Cloud(points)


def _names(ask: Message) -> tuple[str, ...]:
    given = ask.header.get("components") or []
    if not isinstance(given, list) or not all(isinstance(one, str) for one in given):
        raise ServerError("malformed", f"'components' are names, got {json.dumps(given):.60}")
    return tuple(given)


def _numbers(ask: Message, name: str, axes: int) -> np.ndarray:
    found = ask.arrays[name]
    if found.ndim != axes or not np.issubdtype(found.dtype, np.integer):
        raise ServerError(
            "parameter",
            f"{name!r} holds whole numbers along {axes} axes, got {found.dtype} {found.shape}",
        )
    return found


def _shapes(given: Any) -> tuple[tuple[int, int, int], ...]:
    try:
        rows = np.asarray(given)
    except ValueError:
        rows = np.zeros(0)
    if rows.ndim != 2 or rows.shape[1] != 3 or rows.dtype.kind not in "iu" or rows.min() < 1:
        raise ServerError("parameter", f"'shapes' are three counts per block, got {given!r:.60}")
    return tuple((i, j, k) for i, j, k in rows.tolist())
