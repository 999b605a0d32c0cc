# SPDX-License-Identifier: GPL-3.0-or-later
"""Case files: open, save, go back to what was saved.

What is saved runs unchanged with the command line. Until then the case is in the .blend alone, and
files that it needs are in a folder of the add-on's own.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from . import edits, following, project, results, session, stages
from .amending import finished

ENDING = ".toml"


def new_folder() -> str:
    """A folder for the files of a case that is not saved yet."""
    place = bpy.utils.extension_path_user(__package__, path="cases", create=True)
    return tempfile.mkdtemp(prefix="case-", dir=place)


def open_file(
    scene: bpy.types.Scene,
    path: str | Path,
    then: Callable[[], None] | None = None,
    failed: Callable[[str], None] | None = None,
) -> None:
    """Open a case file in a scene; its surface is taken hold of."""
    place, name = Path(path).absolute(), scene.name

    def opened() -> None:
        found = project.surface(bpy.data.scenes[name])
        if found is not None and bpy.context.scene.name == name:
            stages.take(bpy.context, found)
        if then is not None:
            then()

    try:
        text = place.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise session.Problem(f"{place}: cannot be read as a case file: {error}", "file") from None
    project.open_case(scene, text, str(place.parent), str(place), opened, failed=failed)


def save(
    scene: bpy.types.Scene,
    path: str | Path,
    gathers: bool = True,
    failed: Callable[[Exception], None] | None = None,
) -> None:
    """Write the case with its values as they are; the scene then has the file that was written.

    With `gathers` files that were made beside an unsaved case go along.
    """
    place, name = Path(path).absolute(), scene.name
    text, folder = project.text(scene), scene.moldline.folder
    wanted = changes(text, project.turned(scene))

    def work(client: Any) -> str:
        own = client.amend(text, folder, wanted)["text"] if wanted else text
        return client.relocate(own, folder, place, gather=gathers)["text"]

    def written(new: str) -> None:
        found = bpy.data.scenes[name]
        same = (project.text(found), found.moldline.folder) == (new, str(place.parent))
        if same:
            found.moldline.path = str(place)
        else:
            project.update_text(found, new, place=(str(place.parent), str(place)))
        project.tell(found, f"saved: {place}")

    session.run(work, written, failed, what=f"saving {place.name}")


def changes(text: str, values: dict[str, np.ndarray]) -> edits.Edits:
    """Edits of a case's text for its variables' values as they are; none for those that are so."""
    found: edits.Edits = []
    for name, table in edits.variables(edits.tables(text)).items():
        own = values.get(name)
        if own is not None and not np.array_equal(own, edits.values_of(table)):
            to = own.tolist() if len(own) > 1 or isinstance(table.get("value"), list) else own[0]
            found.append({"set": ["variable", name, "value"], "to": to})
    return found


class MOLDLINE_OT_open_case(bpy.types.Operator, ImportHelper):
    """Open a case file: its result is shown, its control points can be moved"""

    bl_idname = "moldline.open_case"
    bl_label = "Open Case"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ENDING
    filter_glob: StringProperty(default=f"*{ENDING}", options={"HIDDEN"})

    def execute(self, context):
        """Open it."""
        problems: list[str] = []
        try:
            open_file(context.scene, self.filepath, failed=problems.append)
        except session.Problem as problem:
            problems.append(str(problem))
        return finished(self, problems)


class MOLDLINE_OT_save_case_as(bpy.types.Operator, ExportHelper):
    """Write the case with its present values to a file that `moldline` runs as it is"""

    bl_idname = "moldline.save_case_as"
    bl_label = "Save Case As"

    filename_ext = ENDING
    filter_glob: StringProperty(default=f"*{ENDING}", options={"HIDDEN"})
    gathers: BoolProperty(
        name="Copy Files",
        description="Copy files of the case's folder along; others are named by their path",
        default=True,
    )

    @classmethod
    def poll(cls, context):
        """Needs a case."""
        return project.has_case(context.scene)

    def execute(self, context):
        """Write it."""
        return _saved(self, context, self.filepath, self.gathers)


class MOLDLINE_OT_save_case(bpy.types.Operator):
    """Write the case with its present values to its file"""

    bl_idname = "moldline.save_case"
    bl_label = "Save Case"

    @classmethod
    def poll(cls, context):
        """Needs a case."""
        return project.has_case(context.scene)

    def invoke(self, context, _event):
        """Ask for a file where it has none."""
        if not context.scene.moldline.path:
            return bpy.ops.moldline.save_case_as("INVOKE_DEFAULT")
        return self.execute(context)

    def execute(self, context):
        """Write it."""
        path = context.scene.moldline.path
        if not path:
            self.report({"ERROR"}, "the case has no file yet; use Save Case As")
            return {"CANCELLED"}
        return _saved(self, context, path, gathers=True)


class MOLDLINE_OT_revert_case(bpy.types.Operator):
    """Go back to the case file as it is on disk: its text and its values"""

    bl_idname = "moldline.revert_case"
    bl_label = "Revert Case"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Needs a case that has a file."""
        return project.has_case(context.scene) and bool(context.scene.moldline.path)

    def execute(self, context):
        """Read it again."""
        scene, path = context.scene, Path(context.scene.moldline.path)
        problems: list[str] = []
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            self.report({"ERROR"}, f"{path}: cannot be read again: {error}")
            return {"CANCELLED"}
        place = (str(path.parent), str(path))
        if scene.moldline.surface is not None:
            scene.moldline.surface.pop(results.EDITED, None)
        project.update_text(scene, text, failed=problems.append, place=place, keeps=False)
        return finished(self, problems)


class MOLDLINE_OT_reopen_case(bpy.types.Operator):
    """Open the case again from its text, as after the file was opened; moldline is started"""

    bl_idname = "moldline.reopen_case"
    bl_label = "Reopen Case"

    @classmethod
    def poll(cls, context):
        """Needs a case that is not open."""
        return project.has_case(context.scene) and not project.is_open(context.scene)

    def execute(self, context):
        """Open it."""
        project.reopen(context.scene)
        return {"FINISHED"}


class MOLDLINE_OT_close_case(bpy.types.Operator):
    """Take the case and its handles out of the scene; the surface stays as it is"""

    bl_idname = "moldline.close_case"
    bl_label = "Close Case"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Needs a case."""
        return project.has_case(context.scene)

    def execute(self, context):
        """Close it."""
        project.close_case(context.scene)
        return {"FINISHED"}


class MOLDLINE_FH_case(bpy.types.FileHandler):
    """Case files that are dropped into a window."""

    bl_idname = "MOLDLINE_FH_case"
    bl_label = "Moldline case"
    bl_import_operator = "moldline.open_case"
    bl_file_extensions = ENDING

    @classmethod
    def poll_drop(cls, context):
        """Where they may be dropped."""
        return context.area is not None and context.area.type in {"VIEW_3D", "OUTLINER"}


def _saved(operator: Any, context: Any, path: str, gathers: bool) -> set[str]:
    if bpy.app.background:
        following.settle(context.scene)
    problems: list[str] = []
    place = bpy.path.abspath(path)
    place = place if place.endswith(ENDING) else place + ENDING
    save(context.scene, place, gathers, lambda problem: problems.append(str(problem)))
    return finished(operator, problems)


CLASSES = (
    MOLDLINE_OT_open_case,
    MOLDLINE_OT_save_case_as,
    MOLDLINE_OT_save_case,
    MOLDLINE_OT_revert_case,
    MOLDLINE_OT_reopen_case,
    MOLDLINE_OT_close_case,
    MOLDLINE_FH_case,
)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
