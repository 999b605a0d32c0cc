# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done with stages that are there: take hold of, remove, put back, mirror; the surface."""

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty, IntProperty

from . import amending, choosing, convert, edits, handles, project, results, session, view


class MOLDLINE_OT_select_handle(bpy.types.Operator):
    """Take hold of a stage: its control points, bones or pilots become the active object"""

    bl_idname = "moldline.select_handle"
    bl_label = "Select Handle"
    bl_options = {"REGISTER", "UNDO"}

    stage: IntProperty(name="Stage", description="Number of the stage, from 0", default=0)

    @classmethod
    def poll(cls, context):
        """Needs a case."""
        return project.has_case(context.scene)

    def execute(self, context):
        """Make it active; one that was deleted is made again."""
        scene, number = context.scene, self.stage
        if handles.of_stage(scene, number) is None:
            found = _remade(self, scene)
            if found is not None:
                return found
        obj = handles.of_stage(scene, number)
        if obj is None:
            self.report({"INFO"}, "nothing of this stage can be moved by hand; use its variables")
            return {"CANCELLED"}
        take(context, obj)
        scene.moldline.active_stage = number
        return {"FINISHED"}


class MOLDLINE_OT_show_handles(bpy.types.Operator):
    """Show all handles of the case again, also those that were hidden or deleted"""

    bl_idname = "moldline.show_handles"
    bl_label = "Show Handles"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Needs a case."""
        return project.has_case(context.scene)

    def execute(self, context):
        """Show them."""
        found = _remade(self, context.scene)
        for obj in handles.all_of(context.scene):
            if obj.name in context.view_layer.objects:
                obj.hide_set(False)
                obj.hide_viewport = False
        return found or {"FINISHED"}


class MOLDLINE_OT_remove_stage(bpy.types.Operator):
    """Remove a stage, and variables that nothing else uses"""

    bl_idname = "moldline.remove_stage"
    bl_label = "Remove Stage"
    bl_options = {"REGISTER", "UNDO"}

    stage: IntProperty(name="Stage", description="Number of the stage, from 0", default=0)

    @classmethod
    def poll(cls, context):
        """Needs a case."""
        return project.has_case(context.scene)

    def execute(self, context):
        """Remove it."""
        scene, number, problems = context.scene, self.stage, []
        to_object_mode(context)
        text, folder, name = project.text(scene), scene.moldline.folder, scene.name
        case = edits.tables(text)
        if not 0 <= number < len(case.get("stage", [])):
            self.report({"ERROR"}, f"the case has no stage {number}")
            return {"CANCELLED"}
        wanted = removal(case, number)

        def amended(told: dict[str, Any]) -> None:
            found = bpy.data.scenes[name]
            before = handles.renumber(found, lambda n: -1 if n == number else n - (n > number))

            def failed(problem: str) -> None:
                handles.number(before)
                problems.append(problem)

            project.update_text(found, told["text"], lambda: view.sync(found), failed)

        session.run(
            lambda client: client.amend(text, folder, wanted),
            amended,
            lambda problem: problems.append(str(problem)),
            what="removing a stage",
        )
        return amending.finished(self, problems)


class MOLDLINE_OT_reset_handle(bpy.types.Operator):
    """Put the active handle back to the values that its variables have in the case"""

    bl_idname = "moldline.reset_handle"
    bl_label = "Reset Handle"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Needs an active handle."""
        return choosing.active_stage(context) >= 0

    def execute(self, context):
        """Write the values, and place the object."""
        scene, case = context.scene, edits.tables(project.text(context.scene))
        stage = choosing.active_stage(context)
        names = {link["variable"] for link in case["stage"][stage].get("link", [])}
        tables = edits.variables(case)
        project.set_values(scene, {name: edits.values_of(tables[name]) for name in names})
        handles.restore(context.object)
        return {"FINISHED"}


class MOLDLINE_OT_mirror_handle(bpy.types.Operator):
    """Move the control points on one side of a plane as those on the other side are moved"""

    bl_idname = "moldline.mirror_handle"
    bl_label = "Mirror Handle"
    bl_options = {"REGISTER", "UNDO"}

    across: EnumProperty(
        name="Across",
        items=[(a, f"{a.upper()} = 0", "The plane between both sides") for a in "yxz"],
        default="y",
    )
    side: EnumProperty(
        name="From",
        items=[
            ("+", "Positive Side", "It is copied to the negative one"),
            ("-", "Negative Side", "It is copied to the positive one"),
        ],
    )

    @classmethod
    def poll(cls, context):
        """Needs control points."""
        is_net = choosing.active_stage(context) >= 0 and context.object.type == "MESH"
        return is_net and project.is_open(context.scene)

    def execute(self, context):
        """Move them; the shape follows."""
        scene, obj = context.scene, context.object
        stage = obj.moldline.stage
        try:
            found = {h.stage: h for h in project.case(scene).handles(project.values(scene))}
        except Exception as error:
            return amending.finished(self, [str(session.met(error))])
        moved, rest = handles.read(obj), np.asarray(found[stage].rest)
        if moved is None:
            self.report({"ERROR"}, "the handle has other points than its stage; use Show Handles")
            return {"CANCELLED"}
        axis, sign = "xyz".index(self.across), 1.0 if self.side == "+" else -1.0
        count = handles.push(obj, mirrored(rest, moved, axis, sign))
        self.report({"INFO"}, f"{count} control points moved")
        return {"FINISHED"}


class MOLDLINE_OT_restore_surface(bpy.types.Operator):
    """Bring the case's surface back into the scene, as the case has it"""

    bl_idname = "moldline.restore_surface"
    bl_label = "Restore Surface"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Needs a case."""
        return project.has_case(context.scene)

    def execute(self, context):
        """Make it again where it is lost or was edited."""
        to_object_mode(context)
        shown = project.surface(context.scene)
        if shown is not None:
            shown.hide_set(False)
            shown.pop(results.EDITED, None)
        _put_back(context.scene)
        project.reopen(context.scene)
        return {"FINISHED"}


class MOLDLINE_OT_use_surface(bpy.types.Operator):
    """Make the surface as it was edited the case's geometry; it is written beside the case"""

    bl_idname = "moldline.use_surface"
    bl_label = "Use Edited Surface"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Needs a surface that was edited."""
        shown = project.surface(context.scene)
        return shown is not None and bool(shown.get(results.EDITED, False))

    def execute(self, context):
        """Write it; the variables go back to the case's values, since the shape is in it."""
        scene, problems = context.scene, []
        to_object_mode(context)
        shown, case = project.surface(scene), edits.tables(project.text(scene))
        names = list(case.get("geometry", {}))
        if len(names) != 1 or any("modeler" in stage for stage in case.get("stage", [])):
            self.report(
                {"ERROR"},
                "the surface of this case is made from several geometries; edit those instead",
            )
            return {"CANCELLED"}
        name, folder = names[0], scene.moldline.folder
        faces, tags = convert.triangles(shown.data)
        points, components = convert.points(shown.data), convert.components(shown)
        units = case["geometry"][name].get("units")
        path = unused(Path(folder), f"{name}_edited")
        text, title = project.text(scene), scene.name
        wanted = [{"set": ["geometry", name, "file"], "to": path.name}]
        for one, table in edits.variables(case).items():
            if not is_absolute(case, one) and any(edits.values_of(table)):
                wanted.append({"set": ["variable", one, "value"], "to": 0.0})

        def work(client: Any) -> str:
            client.write(path, points, faces, tags, components, units=units)
            return client.amend(text, folder, wanted)["text"]

        def written(new: str) -> None:
            shown = bpy.data.scenes[title].moldline.surface
            shown.pop(results.EDITED, None)
            _put_back(bpy.data.scenes[title])
            project.update_text(bpy.data.scenes[title], new, keeps=False, failed=failed)

        def failed(problem: str) -> None:
            bpy.data.scenes[title].moldline.surface[results.EDITED] = True
            problems.append(problem)

        session.run(work, written, lambda p: problems.append(str(p)), what="writing the surface")
        return amending.finished(self, problems)


def take(context: Any, obj: bpy.types.Object) -> None:
    """Make an object the only one that is selected, and active."""
    to_object_mode(context)
    if obj.name not in context.view_layer.objects:
        return
    obj.hide_set(False)
    for other in context.view_layer.objects:
        other.select_set(other == obj)
    context.view_layer.objects.active = obj


def to_object_mode(context: Any) -> None:
    """Leave edit mode, pose mode and the like."""
    if context.object is not None and context.object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def unused(folder: Path, stem: str, ending: str = ".vtp") -> Path:
    """A path in a folder where nothing is."""
    path, number = folder / f"{stem}{ending}", 1
    while path.exists():
        number += 1
        path = folder / f"{stem}_{number}{ending}"
    return path


def removal(case: dict[str, Any], number: int) -> edits.Edits:
    """Edits that remove a stage and the variables that it alone uses."""
    stages = case.get("stage", [])
    own = {link["variable"] for link in stages[number].get("link", [])}
    others = {
        link["variable"]
        for i, stage in enumerate(stages)
        for link in stage.get("link", [])
        if i != number
    }
    gone: edits.Edits = [{"remove": ["stage", number]}]
    return gone + [{"remove": ["variable", name]} for name in sorted(own - others)]


def is_absolute(case: dict[str, Any], variable: str) -> bool:
    """Whether a variable says what something measures, not a change."""
    return any(link.get("absolute") for _, _, link in edits.links_of(case, variable))


def mirrored(rest: np.ndarray, moved: np.ndarray, axis: int, sign: float) -> np.ndarray:
    """Places where points on the other side move as those on this side do, mirrored."""
    flip = np.ones(3)
    flip[axis] = -1.0
    size = float(np.ptp(rest, axis=0).max()) or 1.0
    found = moved.copy()
    for i in np.flatnonzero(sign * rest[:, axis] < -1e-6 * size):
        distance = np.linalg.norm(rest - rest[i] * flip, axis=1)
        partner = int(np.argmin(distance))
        if distance[partner] < 1e-4 * size:
            found[i] = rest[i] + (moved[partner] - rest[partner]) * flip
    return found


def _put_back(scene: bpy.types.Scene) -> None:
    """Handles where moldline had them: applying a surface's place has moved them against it."""
    for obj in handles.all_of(scene):
        handles.restore(obj)


def _remade(operator: Any, scene: bpy.types.Scene) -> set[str] | None:
    """Make missing handles again; what the operator gives back if that is not possible."""
    shown = scene.moldline.surface
    try:
        handles.rebuild(scene, shown, project.case(scene).handles(project.values(scene)))
    except Exception as error:
        return amending.finished(operator, [str(session.met(error))])
    return None


CLASSES = (
    MOLDLINE_OT_select_handle,
    MOLDLINE_OT_show_handles,
    MOLDLINE_OT_remove_stage,
    MOLDLINE_OT_reset_handle,
    MOLDLINE_OT_mirror_handle,
    MOLDLINE_OT_restore_surface,
    MOLDLINE_OT_use_surface,
)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
