# SPDX-License-Identifier: GPL-3.0-or-later
"""How something that moves a shape is added: to the scene's case, or as a case of an object."""

from pathlib import Path
from typing import Any, NamedTuple

import bmesh
import bpy
import numpy as np

from . import (
    amending,
    case_files,
    choosing,
    convert,
    files,
    handles,
    project,
    session,
    stages,
    view,
)


class Geometry(NamedTuple):
    """What a new case is about: a file, or what has to be written to one first."""

    name: str
    file: str
    units: str
    given: Any = None


def add(operator: Any, context: Any, kind: str, bounded: bool, options: dict[str, Any]) -> set[str]:
    """Add a stage of a kind: to the scene's case where that is selected, else as a new case."""
    problems: list[str] = []
    stages.to_object_mode(context)
    try:
        if project.has_case(context.scene):
            _to_case(context.scene, context.object, kind, bounded, options, problems)
        else:
            _as_case(context.scene, context.object, kind, bounded, options, problems)
    except session.Problem as problem:
        problems.append(str(problem))
    return amending.finished(operator, problems)


def _to_case(
    scene: bpy.types.Scene,
    obj: bpy.types.Object | None,
    kind: str,
    bounded: bool,
    options: dict[str, Any],
    problems: list[str],
) -> None:
    """One more stage of the scene's case, on what the active handle is on, or on the result."""
    if not belongs(scene, obj):
        shown = project.surface(scene)
        raise session.Problem(
            f"this scene's case is about {shown.name if shown else 'another object'!r}; select "
            f"that, or close the case before you begin one of {obj.name!r}"
        )
    text, folder, title = project.text(scene), scene.moldline.folder, scene.name
    on = (obj.moldline.on if obj is not None else "") or project.description(scene).get(
        "result", ""
    )

    def work(client: Any) -> dict[str, Any]:
        return client.draft(text, folder, kind, bounded=bounded, on=on, **options)

    def drafted(told: dict[str, Any]) -> None:
        found = bpy.data.scenes[title]
        before = handles.renumber(found, lambda n: n + (n >= told["stage"]))

        def failed(problem: str) -> None:
            handles.number(before)
            problems.append(problem)

        project.update_text(found, told["text"], lambda: _added(title, told), failed)

    session.run(work, drafted, lambda p: problems.append(str(p)), what=f"adding a {kind}")


def _as_case(
    scene: bpy.types.Scene,
    obj: bpy.types.Object | None,
    kind: str,
    bounded: bool,
    options: dict[str, Any],
    problems: list[str],
) -> None:
    """A new case of an object, in a folder of its own until it is saved."""
    target, folder = _geometry(obj), case_files.new_folder()
    title, own = scene.name, obj.name if obj is not None else ""

    def work(client: Any) -> dict[str, Any]:
        where = {"geometry": _written(client, folder, target)}
        where |= {"units": target.units} if target.units else {}
        return client.draft("", folder, kind, bounded=bounded, **where, **options)

    def drafted(told: dict[str, Any]) -> None:
        project.open_case(
            bpy.data.scenes[title],
            told["text"],
            folder,
            then=lambda: _added(title, told),
            onto=bpy.data.objects.get(own),
            failed=problems.append,
        )

    session.run(work, drafted, lambda p: problems.append(str(p)), what=f"adding a {kind}")


def belongs(scene: bpy.types.Scene, obj: bpy.types.Object | None) -> bool:
    """Whether an object is a part of the scene's case: its surface, a handle, or nothing at all."""
    return obj is None or obj == scene.moldline.surface or bool(obj.moldline.role)


def selection(obj: bpy.types.Object) -> np.ndarray:
    """Where the selected points of a mesh are, (k, 3), in the space of the case that it has."""
    if obj.mode == "EDIT":
        own = bmesh.from_edit_mesh(obj.data)
        found = np.array([v.co[:] for v in own.verts if v.select]).reshape(-1, 3)
    else:
        found = convert.points(obj.data)[choosing.selected(obj)]
    place = np.array(obj.matrix_world, float)
    if obj == bpy.context.scene.moldline.surface or np.array_equal(place, np.eye(4)):
        return found
    return found @ place[:3, :3].T + place[:3, 3]  # a new case is in the coordinates of the world


def region(obj: bpy.types.Object) -> list[list[float]]:
    """Two corners around the selected points, a little larger."""
    chosen = selection(obj)
    if len(chosen) < 2:
        raise session.Problem("select some points in edit mode first", "parameter")
    low, high = chosen.min(axis=0), chosen.max(axis=0)
    room = 1e-3 * max(float((high - low).max()), 1e-9)
    return [(low - room).tolist(), (high + room).tolist()]


def component(obj: bpy.types.Object) -> str:
    """The component of the active material slot."""
    names = convert.components(obj)
    slot = min(obj.active_material_index, len(names) - 1)
    material = obj.active_material
    told = material.get(convert.NAMES) if material is not None else None
    return told if told in names else names[slot]


def around_what(obj: bpy.types.Object | None, around: str) -> dict[str, Any]:
    """Options that say which part is meant."""
    if around == "ALL":
        return {}
    if obj is None or obj.type != "MESH" or obj.moldline.role:
        raise session.Problem("make the surface the active object first", "parameter")
    if around == "COMPONENT":
        return {"component": component(obj)}
    return {"region": region(obj)}


def _geometry(obj: bpy.types.Object | None) -> Geometry:
    """The geometry that a mesh object is."""
    if obj is None or obj.type != "MESH" or obj.moldline.role:
        raise session.Problem("select a mesh object; it becomes the case's geometry", "geometry")
    known = files.source(obj)
    if known is not None:
        return Geometry(obj.name, known[0], known[1])
    ending = ".vtp"
    if files.SHAPES in obj.data:
        ending = ".xyz"
    elif not len(obj.data.polygons):
        ending = ".dat"
    name = "".join(c if c.isalnum() else "_" for c in obj.name).strip("_") or "geometry"
    return Geometry(name + ending, "", "", files.geometry([obj], ending))


def _written(client: Any, folder: str, target: Geometry) -> str:
    """The geometry's file, written where there is none."""
    if target.file:
        return target.file
    own = target.given
    client.write(
        Path(folder) / target.name,
        own.points,
        own.faces,
        own.tags,
        own.components,
        own.data,
        **own.options,
    )
    return target.name


def _added(title: str, told: dict[str, Any]) -> None:
    """Show what was added, and take hold of it."""
    scene, stage, variables = bpy.data.scenes[title], told["stage"], told["variables"]
    view.sync(scene)
    if variables:
        view.choose(scene, variables[0])
    scene.moldline.active_stage = stage
    obj = handles.of_stage(scene, stage)
    if obj is not None and bpy.context.scene == scene:
        stages.take(bpy.context, obj)
    project.tell(scene, told["why"])
    view.redraw()
