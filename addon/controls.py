# SPDX-License-Identifier: GPL-3.0-or-later
"""What is put around a shape to move it: lattices, cages, skeletons, pilot points."""

from collections.abc import Callable
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, IntVectorProperty

from . import amending, edits, project, session, stages
from .adding import add, around_what, selection

AROUND = (
    ("ALL", "Object", "Around the whole object"),
    ("COMPONENT", "Component", "Around the component of the active material slot"),
    ("REGION", "Selected Points", "Around the points that are selected; what is outside stays"),
)


WHOLES = AROUND[:2]


class _Fields:
    """Names of the fields that several of the operators have."""

    AROUND = EnumProperty(name="Around", description="What is enclosed", items=AROUND)
    PART = EnumProperty(name="Around", description="What is enclosed", items=WHOLES)
    BOUNDED = BoolProperty(
        name="Bounds",
        description="Give the new variables bounds; without, a hand moves freely",
        default=False,
    )


def _operator(
    name: str,
    label: str,
    kind: str,
    about: str,
    fields: dict[str, Any],
    options: Callable[[Any], dict[str, Any]],
) -> type:
    """An operator that adds a stage of a kind, with fields of its own."""

    def execute(self: Any, context: Any) -> set[str]:
        try:
            given = options(self)
            around = getattr(self, "around", "ALL")
            given |= around_what(context.object, around)
        except session.Problem as problem:
            return amending.finished(self, [str(problem)])
        return add(self, context, kind, self.bounded, given)

    def poll(cls: Any, context: Any) -> bool:
        obj = context.object
        return project.has_case(context.scene) or (obj is not None and obj.type == "MESH")

    common = {
        "__doc__": about,
        "__annotations__": {**fields, "bounded": _Fields.BOUNDED},
        "bl_idname": f"moldline.{name}",
        "bl_label": label,
        "bl_options": {"REGISTER", "UNDO"},
        "execute": execute,
        "poll": classmethod(poll),
    }
    return type(f"MOLDLINE_OT_{name}", (bpy.types.Operator,), common)


def _counts(default: tuple[int, int, int], about: str) -> Any:
    return IntVectorProperty(name="Control Points", description=about, default=default, min=0)


def _shape(self: Any) -> dict[str, Any]:
    counts = list(self.shape)
    return {"shape": counts} if any(counts) else {}


def _number(name: str, default: int, least: int, about: str) -> Any:
    return IntProperty(name=name, description=about, default=default, min=least)


OFFSET = FloatProperty(
    name="Offset",
    description="Distance from the surface, in parts of its size",
    default=0.05,
    min=0.0,
    soft_max=0.5,
)
RING_OFFSET = FloatProperty(
    name="Offset",
    description="Distance from the surface, in parts of a section",
    default=0.1,
    min=0.0,
    soft_max=0.5,
)

ADDING = (
    _operator(
        "add_lattice",
        "Add Lattice",
        "lattice",
        "Put a box of control points around the object, a component or the selected points",
        {
            "shape": _counts((0, 0, 0), "Along x, y and z; 0 is by the object's proportions"),
            "around": _Fields.AROUND,
        },
        _shape,
    ),
    _operator(
        "add_wing_lattice",
        "Add Wing Lattice",
        "wing-lattice",
        "Put a swept, tapered box along a wing: stations stay stations",
        {
            "shape": _counts((7, 5, 2), "Along chord, span and height"),
            "around": _Fields.PART,
        },
        _shape,
    ),
    _operator(
        "add_cage",
        "Add Cage",
        "cage",
        "Put a closed net near the surface; what its points do stays near them",
        {
            "faces": _number("Triangles", 200, 20, "About how many triangles the cage has"),
            "offset": OFFSET,
            "around": _Fields.PART,
        },
        lambda self: {"faces": self.faces, "offset": self.offset},
    ),
    _operator(
        "add_wing_cage",
        "Add Wing Cage",
        "wing-cage",
        "Put rings of control points around the sections of a wing",
        {
            "stations": _number("Stations", 5, 2, "Rings along the span"),
            "chordwise": _number("Along the Chord", 4, 2, "Control points on each side"),
            "offset": RING_OFFSET,
            "around": _Fields.PART,
        },
        lambda self: {
            "stations": self.stations,
            "chordwise": self.chordwise,
            "offset": self.offset,
        },
    ),
    _operator(
        "add_body_cage",
        "Add Body Cage",
        "body-cage",
        "Put rings of control points around the sections of a body, from its nose on",
        {
            "stations": _number("Stations", 7, 2, "Rings along the body"),
            "points": _number("Around", 8, 3, "Control points of each ring"),
            "offset": RING_OFFSET,
            "around": _Fields.PART,
        },
        lambda self: {"stations": self.stations, "around": self.points, "offset": self.offset},
    ),
    _operator(
        "add_wing_skeleton",
        "Add Wing Skeleton",
        "wing-skeleton",
        "Put bones at stations of a wing: span, chord, sweep, dihedral and twist",
        {"stations": _number("Stations", 4, 2, "Along the span"), "around": _Fields.PART},
        lambda self: {"stations": self.stations},
    ),
    _operator(
        "add_body_skeleton",
        "Add Body Skeleton",
        "body-skeleton",
        "Put bones at stations of a body: lengths, radii, heights, droop and upsweep",
        {"stations": _number("Stations", 6, 3, "Along the body"), "around": _Fields.PART},
        lambda self: {"stations": self.stations},
    ),
)


class MOLDLINE_OT_add_pilot_points(bpy.types.Operator):
    """Let the selected points go where they are told; the rest follows by the least motion"""

    bl_idname = "moldline.add_pilot_points"
    bl_label = "Add Pilot Points"
    bl_options = {"REGISTER", "UNDO"}

    along: EnumProperty(
        name="Held Along",
        items=[
            ("xyz", "X, Y and Z", "Prescribed in all directions"),
            ("z", "Z", "Prescribed in height"),
            ("y", "Y", "Prescribed across"),
            ("x", "X", "Prescribed along"),
            ("xz", "X and Z", "Prescribed in the plane of symmetry"),
        ],
        default="xyz",
    )
    bounded: _Fields.BOUNDED

    @classmethod
    def poll(cls, context):
        """Needs a mesh."""
        obj = context.object
        return obj is not None and obj.type == "MESH" and not obj.moldline.role

    def execute(self, context):
        """Add them."""
        spots = selection(context.object)
        if not 0 < len(spots) <= MOST_PILOTS:
            self.report(
                {"ERROR"},
                f"select from 1 to {MOST_PILOTS} points in edit mode, got {len(spots)}; each "
                "becomes a pilot",
            )
            return {"CANCELLED"}
        used = _pilots(edits.tables(project.text(context.scene)))
        names = [f"p{len(used) + i + 1}" for i in range(len(spots))]
        options: dict[str, Any] = {"spots": spots.tolist(), "names": names}
        options |= {} if self.along == "xyz" else {"along": self.along}
        return add(self, context, "pilots", self.bounded, options)


MOST_PILOTS = 100


def _pilots(case: dict[str, Any]) -> list[str]:
    return [name for stage in case.get("stage", []) for name in stage.get("pilot", {})]


CLASSES = (*ADDING, MOLDLINE_OT_add_pilot_points)

_make_known, _take_away = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Let Blender know."""
    _make_known()
    stages.register()


def unregister() -> None:
    """Take it back."""
    stages.unregister()
    _take_away()
