# SPDX-License-Identifier: GPL-3.0-or-later
"""Import and export of every geometry that moldline reads and writes."""

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from . import convert, session, window

READ = (
    ".tri", ".triq", ".trix", ".stl", ".obj", ".ply", ".vtp", ".vtu", ".su2", ".ugrid", ".xyz",
    ".p3d", ".x", ".grd", ".fmt", ".dat",
)  # fmt: skip
"""Endings that Blender offers; moldline tells by the file what it can read."""

WRITE = (
    (".tri", "Cart3D (.tri)"),
    (".triq", "Cart3D with data (.triq)"),
    (".trix", "Cart3D extended (.trix)"),
    (".stl", "STL (.stl)"),
    (".obj", "Wavefront (.obj)"),
    (".ply", "Stanford (.ply)"),
    (".vtp", "VTK (.vtp)"),
    (".glb", "glTF (.glb)"),
    (".xyz", "PLOT3D (.xyz)"),
    (".dat", "Airfoil coordinates (.dat)"),
)

PLOT3D = (".xyz", ".p3d", ".x", ".grd", ".fmt")
"""Endings of blocks of points."""

UNITS = (
    ("-", "As in the file", "Numbers stay as they are"),
    ("m", "Metres", "The file is in metres"),
    ("cm", "Centimetres", "The file is in centimetres"),
    ("mm", "Millimetres", "The file is in millimetres"),
    ("in", "Inches", "The file is in inches"),
    ("ft", "Feet", "The file is in feet"),
)

SOURCE = "moldline_source"
"""Property of an object: the file it was read from, its unit, and what was read, as JSON."""

SHAPES = "moldline_shapes"
"""Property of a mesh: points of each block along i, j, k, as JSON."""


class Geometry(NamedTuple):
    """What objects are to a file: arguments of the client's `write`."""

    points: np.ndarray
    faces: np.ndarray | None
    tags: np.ndarray | None
    components: list[str]
    data: dict[str, np.ndarray]
    options: dict[str, Any]


def import_file(
    path: str | Path,
    units: str = "",
    then: Callable[[bpy.types.Object], None] | None = None,
    failed: Callable[[session.Problem], None] | None = None,
) -> None:
    """Read a geometry into a new object; with `units` of the file, in metres."""

    def made(told: Any) -> None:
        found = _object(Path(path), units, told)
        if then is not None:
            then(found)

    session.run(
        lambda client: client.read(path, units or None),
        made,
        failed,
        what=f"reading {Path(path).name}",
        undo="Import geometry",
    )


def export_file(
    path: str | Path,
    things: Sequence[bpy.types.Object],
    units: str = "",
    then: Callable[[str], None] | None = None,
    failed: Callable[[session.Problem], None] | None = None,
) -> None:
    """Write objects as one geometry, in the format that the ending tells."""
    given = geometry(things, Path(path).suffix.lower())
    session.run(
        lambda client: client.write(
            path,
            given.points,
            given.faces,
            given.tags,
            given.components,
            given.data,
            units=units or None,
            **given.options,
        ),
        then,
        failed,
        what=f"writing {Path(path).name}",
    )


def geometry(things: Sequence[bpy.types.Object], ending: str = ".tri") -> Geometry:
    """Objects as one geometry in world coordinates, modifiers applied, in double precision."""
    if ending == ".dat":
        return _section(things)
    if len(things) == 1 and SHAPES in things[0].data and ending in PLOT3D:
        shapes, mesh = json.loads(things[0].data[SHAPES]), _evaluated(things[0])
        if sum(i * j * k for i, j, k in shapes) == len(mesh.vertices):
            return Geometry(_placed(things[0], mesh), None, None, [], {}, {"shapes": shapes})
    parts = [part for part in map(_part, things) if len(part.faces)]
    if not parts:
        raise session.Problem(
            "nothing to write: select one or more mesh objects that have faces", "geometry"
        )
    names = [name for part in parts for name in part.components]
    points, faces, tags, components = [], [], [], []
    for part in parts:
        faces.append(part.faces + sum(map(len, points)))
        tags.append(part.tags + len(components))
        points.append(part.points)
        components += [
            name if names.count(name) == 1 else f"{part.name}.{name}" for name in part.components
        ]
    common = set.intersection(*(set(part.data) for part in parts))
    data = {name: np.concatenate([part.data[name] for part in parts]) for name in sorted(common)}
    return Geometry(
        np.concatenate(points), np.concatenate(faces), np.concatenate(tags), components, data, {}
    )


def source(thing: bpy.types.Object) -> tuple[str, str] | None:
    """The file that an object was read from and its unit, if the object is still what was read."""
    if SOURCE not in thing:
        return None
    told = json.loads(thing[SOURCE])
    is_here = np.allclose(np.array(thing.matrix_world), np.eye(4), rtol=0, atol=0)
    if not is_here or _is_reshaped(thing) or not Path(told["path"]).is_file():
        return None
    is_same_file = Path(told["path"]).stat().st_mtime_ns == told["changed"]
    if not is_same_file or told["mark"] != _mark(thing.data):
        return None
    return told["path"], told["units"]


class _Part(NamedTuple):
    name: str
    points: np.ndarray
    faces: np.ndarray
    tags: np.ndarray
    components: list[str]
    data: dict[str, np.ndarray]


def _part(thing: bpy.types.Object) -> _Part:
    """One object, with its modifiers and shape keys."""
    mesh = _evaluated(thing)
    faces, tags = convert.triangles(mesh)
    if np.linalg.det(np.array(thing.matrix_world, float)[:3, :3]) < 0:
        faces = faces[:, ::-1]  # a mirrored surface is still seen from outside
    components = convert.components(mesh)
    if components == [mesh.name]:
        components = [thing.name]
    return _Part(thing.name, _placed(thing, mesh), faces, tags, components, convert.data(mesh))


def _is_reshaped(thing: bpy.types.Object) -> bool:
    """Whether Blender shows something else than the mesh itself."""
    return bool(thing.modifiers) or thing.data.shape_keys is not None


def _evaluated(thing: bpy.types.Object) -> bpy.types.Mesh:
    """What Blender shows of an object."""
    if thing.mode == "EDIT":
        thing.update_from_editmode()
    if not _is_reshaped(thing):
        return thing.data
    return thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def _placed(thing: bpy.types.Object, mesh: bpy.types.Mesh | None = None) -> np.ndarray:
    """Points in world coordinates, to the bit where the object is not moved."""
    points = convert.points(mesh or thing.data)
    place = np.array(thing.matrix_world, float)
    if (place == np.eye(4)).all():
        return points
    return points @ place[:3, :3].T + place[:3, 3]


def _section(things: Sequence[bpy.types.Object]) -> Geometry:
    """One object without faces as a section: its points in the order of its edges."""
    mesh = _evaluated(things[0]) if len(things) == 1 else None
    if mesh is None or len(mesh.polygons):
        raise session.Problem(
            "airfoil coordinates are of one object with edges and no faces; select it alone",
            "geometry",
        )
    points = _placed(things[0], mesh)
    order, is_closed = _chained(convert.lines(mesh), len(points))
    return Geometry(points[order], None, None, [things[0].name], {}, {"is_closed": is_closed})


def _chained(lines: np.ndarray, count: int) -> tuple[np.ndarray, bool]:
    """Points one after the other along their edges, and whether the last is joined to the first."""
    beside: list[list[int]] = [[] for _ in range(count)]
    for a, b in lines.tolist():
        beside[a].append(b)
        beside[b].append(a)
    ends = [i for i, near in enumerate(beside) if len(near) == 1]
    is_closed = not ends
    order, before = [ends[0] if ends else 0], -1
    while len(order) < count:
        onward = [i for i in beside[order[-1]] if i != before]
        if not onward or len(beside[order[-1]]) > 2:
            break
        before = order[-1]
        order.append(onward[0])
    if len(order) != count or len(set(order)) != count or len(ends) not in (0, 2):
        raise session.Problem("the edges of a section are one line through all points", "geometry")
    return np.array(order), is_closed


def _object(path: Path, units: str, told: Any) -> bpy.types.Object:
    """An object of what was read; it is selected and active."""
    header, arrays = told
    data = {k.removeprefix("data."): v for k, v in arrays.items() if k.startswith("data.")}
    found = convert.new_object(
        path.stem,
        arrays["points"],
        arrays.get("faces"),
        arrays.get("lines"),
        arrays.get("tags"),
        header["components"],
        data,
    )
    if "shapes" in header:
        found.data[SHAPES] = json.dumps(header["shapes"])
    changed = path.stat().st_mtime_ns if path.is_file() else 0
    about = {"path": str(path.absolute()), "units": units, "changed": changed}
    found[SOURCE] = json.dumps({**about, "mark": _mark(found.data), "kind": header["kind"]})
    for other in bpy.context.view_layer.objects:
        other.select_set(False)
    found.select_set(True)
    bpy.context.view_layer.objects.active = found
    left_out = found.data.get(convert.LEFT_OUT, 0)
    if left_out:
        window.tell(
            f"{path.name}: {left_out} faces have a repeated corner; Blender does not show them"
        )
    return found


def _mark(mesh: bpy.types.Mesh) -> str:
    """Short for points, triangles and components: it differs when any of them does."""
    sums = hashlib.blake2b(digest_size=16)
    faces, tags = convert.triangles(mesh)
    for array in (convert.points(mesh), faces, tags):
        sums.update(np.ascontiguousarray(array).data)
    sums.update(json.dumps(convert.components(mesh)).encode())
    return sums.hexdigest()


class MOLDLINE_OT_import_geometry(bpy.types.Operator, ImportHelper):
    """Import surfaces, sections and meshes with their components, in double precision"""

    bl_idname = "moldline.import_geometry"
    bl_label = "Import Geometry"
    bl_options = {"REGISTER", "UNDO"}

    filter_glob: StringProperty(default=";".join(f"*{one}" for one in READ), options={"HIDDEN"})
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    units: EnumProperty(
        name="Unit of the file",
        description="Lengths become metres; moldline computes in metres",
        items=UNITS,
        default="-",
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask for files, or for the unit where files were dropped."""
        if self.directory and self.files:
            return context.window_manager.invoke_props_dialog(self)
        return ImportHelper.invoke(self, context, event)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Read them one after the other."""
        names = [one.name for one in self.files if one.name]
        paths = [Path(self.directory) / name for name in names] or [Path(self.filepath)]
        units = "" if self.units == "-" else self.units
        return _reported(self, lambda: [import_file(path, units) for path in paths])


class MOLDLINE_OT_export_geometry(bpy.types.Operator, ExportHelper):
    """Export mesh objects as one geometry, with components and all digits that the format takes"""

    bl_idname = "moldline.export_geometry"
    bl_label = "Export Geometry"

    filter_glob: StringProperty(
        default=";".join(f"*{ending}" for ending, _ in WRITE), options={"HIDDEN"}
    )
    ending: EnumProperty(
        name="Format", items=[(ending, name, "") for ending, name in WRITE], default=".tri"
    )
    units: EnumProperty(
        name="Unit of the file",
        description="What is written, where the objects are in metres",
        items=UNITS,
        default="-",
    )
    only_selected: BoolProperty(
        name="Selected Only",
        description="Otherwise all visible mesh objects are written; of a handle, its surface",
        default=True,
    )

    @property
    def filename_ext(self) -> str:
        """The ending that the file browser adds."""
        return self.ending

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Write."""
        chosen = context.selected_objects if self.only_selected else context.visible_objects
        things = [one for one in chosen if one.type == "MESH" and not one.moldline.role]
        shown = context.scene.moldline.surface
        if not things and shown is not None:  # a handle of the case is selected
            things = [shown]
        known = {ending for ending, _ in WRITE} | set(READ)
        path = Path(self.filepath)
        path = path if path.suffix.lower() in known else path.with_name(path.name + self.ending)
        units = "" if self.units == "-" else self.units
        return _reported(self, lambda: export_file(path, things, units))


class MOLDLINE_FH_geometry(bpy.types.FileHandler):
    """Files that are dropped into a window."""

    bl_idname = "MOLDLINE_FH_geometry"
    bl_label = "Moldline geometry"
    bl_import_operator = "moldline.import_geometry"
    bl_file_extensions = ";".join(READ)

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Where they may be dropped."""
        return context.area is not None and context.area.type in {"VIEW_3D", "OUTLINER"}


def _reported(operator: bpy.types.Operator, act: Callable[[], Any]) -> set[str]:
    try:
        act()
    except session.Problem as problem:
        operator.report({"ERROR"}, str(problem))
        return {"CANCELLED"}
    return {"FINISHED"}


def _import_entry(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator("moldline.import_geometry", text="Moldline geometry")


def _export_entry(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator("moldline.export_geometry", text="Moldline geometry")


CLASSES = (MOLDLINE_OT_import_geometry, MOLDLINE_OT_export_geometry, MOLDLINE_FH_geometry)

_make_known, _take_away = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Let Blender know."""
    _make_known()
    bpy.types.TOPBAR_MT_file_import.append(_import_entry)
    bpy.types.TOPBAR_MT_file_export.append(_export_entry)


def unregister() -> None:
    """Take it back."""
    bpy.types.TOPBAR_MT_file_import.remove(_import_entry)
    bpy.types.TOPBAR_MT_file_export.remove(_export_entry)
    _take_away()
