# SPDX-License-Identifier: GPL-3.0-or-later
"""What a new variable moves: control points that are selected, rows of a lattice, a name."""

import re
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import bmesh
import numpy as np
from mathutils import Vector

from . import edits, project, view

NAMED = {
    "wing_skeleton": ("span", "chord", "sweep", "dihedral", "twist"),
    "body_skeleton": ("nose", "cabin", "tail", "radius", "height", "droop", "upsweep"),
    "hinge": ("angle",),
}
"""Parameters of the deformers that measure something."""

BONES = {"rotation": 3, "translation": 3, "stretch": 1, "scale": 3}
"""Parameters of each bone of a skeleton, and how many numbers they have."""

ANGLES = ("rotation", "angle")
"""Of those, the angles."""

DRAFTS = {"wing_skeleton": "wing-skeleton", "body_skeleton": "body-skeleton"}
"""Kinds of drafts that say what such a skeleton measures."""


class Found(NamedTuple):
    """A link's keys, how many numbers it takes, and the variable's table where that is known."""

    link: dict[str, Any]
    size: int
    table: dict[str, Any] | None = None


class Made(NamedTuple):
    """What makes a link in a thread beside Blender, from what was read of its data before."""

    make: Callable[[Any, Any], Found]
    needs_case: bool = False

    def __call__(self, client: Any, case: Any) -> Found:
        """The link, with the client and the open case at hand."""
        return self.make(client, case)

    @classmethod
    def of(cls, context: Any, asked: Any) -> "Made":
        """From the operator's fields and what is selected."""
        if asked.by == "SELECTION":
            return _by_selection(context, asked)
        if asked.by == "STATIONS":
            return _by_stations(context, asked)
        return _by_name(context, asked)


def active_stage(context: Any) -> int:
    """Number of the stage whose handle is the active object, or -1."""
    told = getattr(context.object, "moldline", None)
    return told.stage if told is not None and told.role else -1


def stage_table(context: Any) -> dict[str, Any]:
    """The table of the active handle's stage; empty where there is none."""
    stages = view.case_of(context.scene).get("stage", [])
    number = active_stage(context)
    return stages[number] if 0 <= number < len(stages) else {}


def parameters(context: Any) -> list[str]:
    """Names of what the active skeleton or hinge measures; of bones, those of each."""
    kind = stage_table(context).get("deformer", "")
    if kind in NAMED:
        return list(NAMED[kind])
    if kind in ("skeleton", "direct_skeleton") and context.object.type == "ARMATURE":
        return [f"{bone.name}.{what}" for bone in context.object.data.bones for what in BONES]
    return []


def is_measured(context: Any) -> bool:
    """Whether the active handle's numbers have values of their own."""
    return stage_table(context).get("deformer") in DRAFTS


def selected(obj: Any) -> list[int]:
    """Numbers of the selected vertices, in the order of the mesh."""
    if obj.mode == "EDIT":
        return [vertex.index for vertex in bmesh.from_edit_mesh(obj.data).verts if vertex.select]
    chosen = np.empty(len(obj.data.vertices), bool)
    obj.data.vertices.foreach_get("select", chosen)
    return np.flatnonzero(chosen).tolist()


def places(obj: Any, numbers: Sequence[int]) -> list[Vector]:
    """Where vertices are in space."""
    if obj.mode == "EDIT":
        vertices: Any = bmesh.from_edit_mesh(obj.data).verts
        vertices.ensure_lookup_table()
    else:
        vertices = obj.data.vertices
    return [obj.matrix_world @ vertices[n].co for n in numbers]


def spacing(obj: Any) -> float:
    """Mean length of a net's lines [m]; a motion as long is a large one."""
    if obj.type != "MESH":
        return 1.0
    ends = [places(obj, edge.vertices) for edge in obj.data.edges[:200]]
    lengths = [(a - b).length for a, b in ends]
    return float(f"{np.mean(lengths):.2g}") if lengths else 1.0


def normal_near(surface: Any, spots: Sequence[Vector]) -> list[float]:
    """Mean outward normal of a surface at its points next to some places."""
    total = Vector((0.0, 0.0, 0.0))
    into = surface.matrix_world.inverted_safe()
    turn = surface.matrix_world.to_3x3().inverted_safe().transposed()
    for spot in spots:
        is_found, _, normal, _ = surface.closest_point_on_mesh(into @ spot)
        if is_found:
            total += (turn @ normal).normalized()
    if total.length < 0.1 * len(spots):
        raise edits.Wrong(
            "the normals next to the selected control points cancel out; choose an axis, or points "
            "on one side of the surface"
        )
    return [edits.tidy(x) for x in total.normalized()]


def copied(
    numbers: Sequence[int], rest: np.ndarray, across: str, skips_plane: bool = False
) -> list[int]:
    """Of chosen control points, those whose motion is copied across the plane, and those on it.

    Those on it are left out where they could only move off it.
    """
    coordinate = rest[:, "xyz".index(across)]
    tolerance = 1e-9 * float(np.ptp(rest, axis=0).sum())
    least = tolerance if skips_plane else -tolerance
    kept = [n for n in numbers if coordinate[n] >= least]
    if not kept:
        raise edits.Wrong(
            f"mirrored about {across} = 0, control points at {across} > 0 move and those at "
            f"{across} < 0 follow; none of those selected is at {across} > 0"
        )
    return kept


def handle_of(case: Any, stage: int) -> Any:
    """The handle of a stage, with its control points and which of them are frozen."""
    for handle in case.handles():
        if handle.stage == stage:
            return handle
    raise edits.Wrong(f"stage {stage} of the case has no control points that a hand can move")


def _by_selection(context: Any, asked: Any) -> Made:
    obj, stage = context.object, active_stage(context)
    if obj.type != "MESH" or stage_table(context).get("deformer") not in edits.NETS:
        raise edits.Wrong(
            "control points are chosen on a lattice, a wing lattice or a cage; for a skeleton take "
            "one of its named parameters"
        )
    numbers = selected(obj)
    if not numbers:
        raise edits.Wrong(
            "no control point is selected; select some of the handle's in edit mode (Tab)"
        )
    mirror = {} if asked.mirrored == "NONE" else {"mirrored": asked.mirrored}
    is_each, axis, normal = asked.moves == "EACH", asked.axis, None
    if axis == "NORMAL":
        surface = project.surface(context.scene)
        if surface is None:
            raise edits.Wrong("the surface is not in the scene; use Restore Surface")
        normal = normal_near(surface, places(obj, numbers))

    def make(client: Any, case: Any) -> Found:
        handle = handle_of(case, stage)
        free = [n for n in numbers if not handle.frozen[n]]
        if not free:
            raise edits.Wrong(
                "all selected control points are frozen (`freeze` of the stage); they never move"
            )
        if mirror:
            skips = is_each and axis == asked_mirror
            free = copied(free, np.asarray(handle.rest).reshape(-1, 3), asked_mirror, skips)
        rows = [[int(word) for word in re.findall(r"\d+", handle.labels[n])] for n in free]
        if normal is not None:
            lists = [[row] for row in rows] if is_each else [rows]
            link = {"link": "groups", "direction": normal, "index": lists}
        else:
            link = {"link": "each" if is_each else "group", "axis": axis, "index": rows}
        return Found(link | mirror, len(rows) if is_each else 1)

    asked_mirror = asked.mirrored
    return Made(make, needs_case=True)


def _by_stations(context: Any, asked: Any) -> Made:
    table, stage = stage_table(context), active_stage(context)
    if table.get("deformer") != "lattice":
        raise edits.Wrong(
            f"{asked.kind} by stations needs a lattice, this is a "
            f"{table.get('deformer', 'handle').replace('_', ' ')}; select its points instead"
        )
    kind, along, axis = asked.kind, asked.along, asked.axis
    link = {"link": kind, "along": along}
    if kind != "radius":
        if axis == "NORMAL":
            raise edits.Wrong(f"{kind} by stations moves along x, y or z of the lattice")
        if axis == along:
            raise edits.Wrong(
                f"stations along {along} cannot move along {along} too; choose another direction"
            )
        link["axis"] = axis
    if asked.mirrored != "NONE":
        link["mirrored"] = asked.mirrored

    def make(client: Any, case: Any) -> Found:
        frozen = handle_of(case, stage).frozen
        return Found(link, edits.stations(table["shape"], along, list(map(bool, frozen))))

    return Made(make, needs_case=True)


def _by_name(context: Any, asked: Any) -> Made:
    table, stage = dict(stage_table(context)), active_stage(context)
    known, wanted = parameters(context), asked.parameter.strip()
    if wanted not in known:
        raise edits.Wrong(
            f"no parameter {wanted!r} of a {table.get('deformer', 'handle').replace('_', ' ')}; "
            f"there is: {', '.join(known[:12]) or 'none'}"
        )
    link: dict[str, Any] = {"link": "named", "parameter": wanted}
    if table["deformer"] not in DRAFTS:
        size = BONES.get(wanted.rpartition(".")[2], 1)
        return Made(lambda client, case: Found(link, size))
    if asked.absolute:
        link["absolute"] = True
    told = context.scene.moldline
    text, folder, case = told.text.as_string(), told.folder, view.case_of(context.scene)

    def make(client: Any, opened: Any) -> Found:
        measured = _measured(client, text, folder, case, stage)[wanted]
        if not asked_absolute:
            measured = edits.as_change(measured)
        return Found(link, edits.size_of(measured), measured)

    asked_absolute = asked.absolute
    return Made(make)


def _measured(
    client: Any, text: str, folder: str, case: dict[str, Any], number: int
) -> dict[str, dict[str, Any]]:
    """Variables' tables for all that a skeleton measures, as a draft of it alone has them.

    What the stage itself and those behind it do is not in it, as it is not in the stage's rest.
    """
    stages = case["stage"]
    gone = [{"remove": ["stage", i]} for i in reversed(range(number, len(stages)))]
    before = client.amend(text, folder, gone)["text"]
    own = {
        key: value
        for key, value in stages[number].items()
        if key not in ("deformer", "name", "on", "carried", "link")
    }
    kind, on = DRAFTS[stages[number]["deformer"]], stages[number].get("on", "")
    told = client.draft(before, folder, kind, on=on, **own)
    drafted = edits.tables(told["text"])
    return {
        link["parameter"]: edits.variables(drafted)[link["variable"]]
        for link in drafted["stage"][told["stage"]]["link"]
    }
