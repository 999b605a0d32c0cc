"""A file that is open in Blender, and an object of it that is evaluated."""

import contextlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy  # type: ignore[import-not-found,unused-ignore]
import numpy as np

from . import controls, meshes, rna
from .listing import listed
from .wrong import Wrong, there_are

Answer = tuple[dict[str, Any], dict[str, np.ndarray]]


class Session:
    """What messages are done with: `open`, `evaluate` and `list`."""

    def __init__(self) -> None:
        self.version = bpy.app.version_string
        self.places: list[tuple[rna.Place, bool, int]] = []
        self.moved: list[controls.AbstractMoved] = []
        self.points: dict[str, controls.Positions] = {}
        self.body: Any = None
        self.own: list[int] = []

    def do_list(self, told: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Answer:
        """What can be turned in a file."""
        _open(told["file"], is_trusted=False)
        return {"listed": listed()}, {}

    def do_open(self, told: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Answer:
        """Open a file and find all that is to be turned; what it is, and what it is at present."""
        _open(told["file"], told["scripts"])
        self.body = _body(told["object"])
        given: dict[str, Any] = {}
        self.places = []
        for name, path in told["paths"].items():
            place = rna.place(path)
            numbers = place.read()
            if place.driver:
                raise Wrong(
                    "parameter",
                    f"{path} is set by a driver, {place.driver!r}; turn what the driver reads",
                )
            self.places.append((place, place.is_list, len(numbers)))
            given[name] = {
                "values": numbers,
                "limits": place.limits,
                "kind": place.kind,
                "labels": [name] if not place.is_list else
                          [f"{name}[{k}]" for k in range(len(numbers))],
            }  # fmt: skip
        self.points = {}
        self.moved = [
            controls.moved(name, table, self.points) for name, table in told["controls"].items()
        ]
        for one in self.moved:
            given[one.name] = {
                "values": [0.0] * len(one.labels),
                "limits": [float("-inf"), float("inf")],
                "kind": one.kind,
                "labels": [f"{one.name}[{label}]" for label in one.labels],
            }
        if "points" in arrays:
            self._take(arrays["points"], arrays["faces"])
        matrix = np.array(self.body.matrix_world, float)
        return {"given": given, "count": self._count}, {"matrix": matrix}

    @property
    def _count(self) -> int:
        return len(self.body.data.vertices) if self.body.type == "MESH" else 0

    def _take(self, points: np.ndarray, faces: np.ndarray) -> None:
        """Have the object's mesh be the geometry that is given."""
        mesh = self.body.data
        if self.body.type != "MESH":
            raise Wrong(
                "geometry",
                f"the object {self.body.name!r} is of type {self.body.type} and takes no geometry; "
                "only a mesh does",
            )
        if mesh.name_full in self.points:
            raise Wrong(
                "parameter",
                f"the vertices of {self.body.name!r} are given by a geometry; they are no controls",
            )
        if len(points) != len(mesh.vertices):
            if not len(faces):
                raise Wrong(
                    "geometry",
                    f"{len(points)} points without faces cannot take the place of the "
                    f"{len(mesh.vertices)} vertices of {self.body.name!r}",
                )
            meshes.replace(mesh, points, faces)

    def do_evaluate(self, told: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Answer:
        """Where the points are for all numbers, and for other points of the mesh."""
        self._set(arrays["numbers"])
        if "points" in arrays:
            meshes.place(self.body.data, arrays["points"])
        self.body.update_tag()
        graph = bpy.context.evaluated_depsgraph_get()
        made = self.body.evaluated_get(graph)
        with _mesh(made) as mesh:
            found = {"points": meshes.positions(mesh)}
            matrix = np.array(made.matrix_world, float)
            form = meshes.connectivity(mesh)
            if told.get("faces"):
                found["faces"], found["materials"] = meshes.triangles(mesh)
        is_same = self.body.type == "MESH" and form == meshes.connectivity(self.body.data)
        answer = {"form": form, "is_same": is_same, "problems": self._problems(made)}
        if told.get("faces"):
            slots = [slot.material for slot in made.material_slots]
            answer["materials"] = [one.name if one else "" for one in slots]
        return answer, found | {"matrix": matrix}

    def _set(self, numbers: np.ndarray) -> None:
        start = 0
        for place, is_list, count in self.places:
            own = numbers[start : start + count].tolist()
            place.write(own, is_list)
            _check_taken(place, own)
            place.block.update_tag()
            start += count
        for points in self.points.values():
            points.begin()
        for moved in self.moved:
            moved.write(numbers[start : start + len(moved.labels)])
            start += len(moved.labels)
        for points in self.points.values():
            points.finish()

    def _problems(self, made: Any) -> list[str]:
        """What modifiers say is wrong with themselves."""
        found = []
        for modifier in made.modifiers:
            if modifier.type == "MESH_DEFORM" and not modifier.is_bound:
                found.append(f"the modifier {modifier.name!r} is not bound to its cage")
        return found


def _check_taken(place: rna.Place, wanted: list[float]) -> None:
    """Blender keeps some properties within limits and says nothing."""
    taken = np.array(place.read(), np.float32)
    given = np.array(wanted, np.float32)
    if not np.allclose(taken, given, rtol=1e-6, atol=1e-30):
        raise Wrong(
            "parameter", f"{place.path} was set to {wanted} and is {taken.tolist()}: out of limits"
        )


def _open(file: str, is_trusted: bool) -> None:
    if not Path(file).is_file():
        raise Wrong("file", f"{file}: there is no such file")
    try:
        bpy.ops.wm.open_mainfile(filepath=file, load_ui=False, use_scripts=is_trusted)
    except RuntimeError as problem:
        raise Wrong("file", f"{file}: Blender cannot open it: {str(problem).strip()}") from None


def _body(name: str) -> Any:
    """The object, made visible: what is hidden is not evaluated."""
    body = bpy.data.objects.get(name)
    if body is None:
        raise Wrong(
            "parameter",
            f"the file has no object {name!r}; {there_are([o.name for o in bpy.data.objects])}",
        )
    body.hide_viewport = False
    if body.name not in bpy.context.view_layer.objects:
        bpy.context.scene.collection.objects.link(body)
    body.hide_set(False)
    bpy.context.view_layer.update()
    return body


@contextlib.contextmanager
def _mesh(made: Any) -> Any:
    """The mesh of an evaluated object; curves and the like are made into one."""
    if made.type == "MESH":
        yield made.data
        return
    try:
        mesh = made.to_mesh()
    except RuntimeError:
        mesh = None
    if mesh is None:
        raise Wrong("geometry", f"the object {made.name!r} is of type {made.type}: no surface")
    try:
        yield mesh
    finally:
        made.to_mesh_clear()
