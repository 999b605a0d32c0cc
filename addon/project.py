# SPDX-License-Identifier: GPL-3.0-or-later
"""The case of a scene: its text, its surface, the values of its variables.

The text is the truth and lies in the .blend, as does all that this module needs to find it again;
only connections are kept outside, by what they are connections to.
"""

import contextlib
import functools
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from . import edits, handles, results, session
from .client.protocol import ServerError

COLLECTION = "Moldline"
MOST_OPEN = 2
"""Cases that stay open: going back to the text before by undo then costs nothing."""

_cases: dict[tuple[str, str], tuple[Any, Any]] = {}
_opening: set[tuple[str, str]] = set()
_refused: set[tuple[str, str]] = set()


class MoldlineProject(bpy.types.PropertyGroup):
    """What a scene knows of its case."""

    text: bpy.props.PointerProperty(
        type=bpy.types.Text, name="Case", description="The case file's text"
    )
    folder: bpy.props.StringProperty(
        name="Folder",
        description="Where files named in the case are looked for",
        subtype="DIR_PATH",
    )
    path: bpy.props.StringProperty(
        name="Path", description="The case file; empty until it is saved", subtype="FILE_PATH"
    )
    surface: bpy.props.PointerProperty(
        type=bpy.types.Object, name="Surface", description="Shows the case's result"
    )
    description: bpy.props.StringProperty(description="What the case is made of, as JSON")
    active_variable: bpy.props.IntProperty(name="Variable", min=0)
    active_number: bpy.props.IntProperty(
        name="Number", description="Which number of the variable, from 0", min=0
    )
    active_measure: bpy.props.IntProperty(name="Measure", min=0)
    active_stage: bpy.props.IntProperty(name="Stage", min=0)
    status: bpy.props.StringProperty(description="What was last told")
    is_alert: bpy.props.BoolProperty(description="Whether what was told asks for attention")


def has_case(scene: bpy.types.Scene) -> bool:
    """Whether the scene has a case, open or not."""
    return scene.moldline.text is not None


def text(scene: bpy.types.Scene) -> str:
    """The case's text; empty without a case."""
    return scene.moldline.text.as_string() if has_case(scene) else ""


def surface(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The object that shows the result, if it is in the scene."""
    found = scene.moldline.surface
    return found if found is not None and found.name in scene.objects else None


def description(scene: bpy.types.Scene) -> dict[str, Any]:
    """What the case is made of, as the server told; known without one, {} without a case."""
    return _parsed(scene.moldline.description)


def variables(scene: bpy.types.Scene) -> dict[str, dict[str, Any]]:
    """Size, value, lower, upper, typical, unit and labels of each variable."""
    return description(scene).get("variables", {})


def values(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """The numbers of each variable, in its own unit, as they stand in the scene."""
    shown = scene.moldline.surface
    found = {}
    for name, told in variables(scene).items():
        own = shown.get(name) if shown is not None else None
        try:
            number = np.atleast_1d(np.array(told["value"] if own is None else own, float))
        except (TypeError, ValueError):  # a person may give a property any type
            number = np.zeros(0)
        found[name] = number if number.shape == (told["size"],) else np.array(told["value"], float)
    return found


def turned(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """Those of the values that count beside the text: not where that says others than it did."""
    said, known = edits.variables(edits.tables(text(scene))), variables(scene)
    found = values(scene)
    return {n: v for n, v in found.items() if edits.is_same(said.get(n), known[n]["value"])}


def set_values(scene: bpy.types.Scene, given: Mapping[str, Any]) -> None:
    """Write numbers of variables; those that are not named stay."""
    shown = scene.moldline.surface
    if shown is None:
        return
    for name, told in variables(scene).items():
        if name in given:
            _write(shown, name, np.broadcast_to(np.asarray(given[name], float), told["size"]))
    shown.update_tag()


def is_open(scene: bpy.types.Scene) -> bool:
    """Whether the scene's case is open on a server that runs."""
    return opened(scene) is not None


def waits(scene: bpy.types.Scene) -> bool:
    """Whether the case is not open, could be, and nobody has tried to."""
    is_known = _key(scene) in _opening or _key(scene) in _refused
    return has_case(scene) and not is_known and session.state() == "ready" and not is_open(scene)


def opened(scene: bpy.types.Scene) -> Any:
    """The scene's case on the server, or None where it is not open."""
    return _found(scene) if has_case(scene) else None


def case(scene: bpy.types.Scene) -> Any:
    """The scene's case on the server; a `Problem` says why there is none."""
    found = _found(scene)
    if found is not None:
        return found
    if not has_case(scene):
        raise session.Problem("this scene has no case; open one or add a parameterisation")
    session.client()
    raise session.Problem("the case is being opened" if _key(scene) in _opening else (
        "the case is not open; press Reopen"
    ))  # fmt: skip


def open_case(
    scene: bpy.types.Scene,
    text: str,
    folder: str,
    path: str = "",
    then: Callable[[], None] | None = None,
    onto: bpy.types.Object | None = None,
    failed: Callable[[str], None] | None = None,
) -> None:
    """Open a case in a scene, whose earlier one is closed; what is wrong is told in the status.

    `onto` is an object that shows the geometry already, else one is made.
    """
    own = "" if onto is None else onto.name

    def opened(scene: bpy.types.Scene, found: tuple) -> None:
        close_case(scene)
        here = scene.moldline
        here.text = bpy.data.texts.new(Path(path).name if path else "case.toml")
        here.text.write(text)
        here.folder, here.path, here.surface = folder, path, bpy.data.objects.get(own)
        if here.surface is not None:
            results.adopt(here.surface)
        _build(scene, *found)

    _open(scene, text, folder, opened, then, failed, keeps=False)


def update_text(
    scene: bpy.types.Scene,
    text: str,
    then: Callable[[], None] | None = None,
    failed: Callable[[str], None] | None = None,
    place: tuple[str, str] | None = None,
    keeps: bool = True,
    undo: str = "Change the case",
) -> None:
    """Give the scene's case another text; values of variables that stay are kept, if `keeps`.

    `place` is another folder and path of the case; `undo` names the step, empty for none. Where
    the text cannot be opened, the old one stays and the status says why.
    """
    folder, path = place or (scene.moldline.folder, scene.moldline.path)

    def opened(scene: bpy.types.Scene, found: tuple) -> None:
        here = scene.moldline
        if any(o != scene and o.moldline.text == here.text for o in bpy.data.scenes):
            here.text = bpy.data.texts.new(here.text.name)  # a copied scene keeps its own
        here.text.clear()
        here.text.write(text)
        here.folder, here.path = folder, path
        if path:
            here.text.name = Path(path).name
        _build(scene, *found)

    _open(scene, text, folder, opened, then, failed, keeps, undo)


def reopen(scene: bpy.types.Scene, then: Callable[[], None] | None = None) -> None:
    """Open the scene's case again from its text: after a file was loaded, or a server was lost."""
    if has_case(scene):
        _open(scene, text(scene), scene.moldline.folder, _build_found, then, None, undo="")


def close_case(scene: bpy.types.Scene) -> None:
    """Take the case out of the scene; the surface stays as it is."""
    here = scene.moldline
    handles.remove_all(scene)
    if here.surface is not None:
        for name in variables(scene):
            if name in here.surface:
                del here.surface[name]
    for name in ("text", "folder", "path", "surface", "description", "status", "is_alert"):
        here.property_unset(name)


def leave(case: Any) -> None:
    """Close a case on the server, so that its process may serve another."""
    with contextlib.suppress(ServerError, OSError):
        case.close()


def forget() -> None:
    """Forget connections and what failed: cases are opened again from their texts."""
    for known in (_cases, _opening, _refused):
        known.clear()


def tell(scene: bpy.types.Scene, sentence: str, is_alert: bool = False) -> None:
    """Say something in the panel."""
    here = scene.moldline
    if (here.status, here.is_alert) != (sentence, is_alert):
        here.status, here.is_alert = sentence, is_alert
        _redraw()


def _key(scene: bpy.types.Scene) -> tuple[str, str]:
    return scene.moldline.folder, text(scene)


def _found(scene: bpy.types.Scene) -> Any:
    """The open case, if the server that it is open on is the one that runs."""
    client, found = _cases.get(_key(scene), (None, None))
    try:
        return found if found is not None and client is session.client() else None
    except session.Problem:
        return None


def _open(
    scene: bpy.types.Scene,
    text: str,
    folder: str,
    opened: Callable[[bpy.types.Scene, tuple], None],
    then: Callable[[], None] | None,
    failed: Callable[[str], None] | None,
    keeps: bool = True,
    undo: str = "Change the case",
) -> None:
    name, key = scene.name, (folder, text)
    kept = turned(scene) if keeps else {}
    _opening.add(key)
    _refused.discard(key)

    def done(found: tuple) -> None:
        _opening.discard(key)
        _cases.pop(key, None)
        _cases[key] = found[:2]
        while len(_cases) > MOST_OPEN:
            leave(_cases.pop(next(iter(_cases)))[1])
        scene = bpy.data.scenes.get(name)
        if scene is None:
            return
        opened(scene, found[1:])
        shown = scene.moldline.surface
        is_edited = shown is not None and bool(shown.get(results.EDITED, False))
        tell(scene, results.BY_HAND if is_edited else "", is_alert=is_edited)
        if then is not None:
            then()

    def refused(problem: Any) -> None:
        _opening.discard(key)
        _refused.add(key)
        scene = bpy.data.scenes.get(name)
        if scene is not None:
            tell(scene, str(problem), is_alert=True)
        if failed is not None:
            failed(str(problem))

    session.run(
        lambda client: _loaded(client, text, folder, kept),
        done,
        refused,
        "opening the case",
        undo=undo,
    )


def _loaded(client: Any, text: str, folder: str, kept: Mapping[str, np.ndarray]) -> tuple:
    """In a thread beside Blender: a case, values that it takes, its shape and handles for them."""
    try:
        found = client.open(text=text, folder=folder)
    except ServerError as error:
        if error.code != "disconnected":
            raise
        found = client.open(text=text, folder=folder)  # it went away unseen: start it again
    if unfit := edits.unfit(found.variables):
        raise session.Problem(unfit, "parameter")
    sizes = {n: v["size"] for n, v in found.variables.items()}
    own = {n: v for n, v in kept.items() if sizes.get(n) == len(v)}
    try:
        shape = found.shape(own)
    except Exception:  # values that the new text refuses give way to its own
        own, shape = {}, found.shape()
    return client, found, own, shape, found.handles(own)


def _build_found(scene: bpy.types.Scene, found: tuple) -> None:
    """After a reopening: the text is the one that was opened, unless an undo came between."""
    if _found(scene) is found[0]:
        case, own, shape, nets = found
        _build(scene, case, {**own, **turned(scene)}, shape, nets)  # turned meanwhile: they count


def _build(scene: bpy.types.Scene, case: Any, own: Mapping, shape: Any, nets: list) -> None:
    """Make all that shows the case fit it."""
    here = scene.moldline
    before = set(variables(scene))
    here.description = json.dumps(case.description)
    title = Path(here.path).stem or str(case.description["result"]) or "Surface"
    shown = here.surface = results.show(scene, here.surface, case, shape, title)
    for name in before - set(case.variables):
        if name in shown:
            del shown[name]
    for name, told in case.variables.items():
        _write(shown, name, np.asarray(own.get(name, told["value"]), float))
        _declare(shown, name, told)
    handles.rebuild(scene, shown, nets)
    here.active_variable = min(here.active_variable, max(len(case.variables) - 1, 0))


def _write(shown: bpy.types.Object, name: str, numbers: np.ndarray) -> None:
    own = shown.get(name)
    if own is not None and np.shape(own) == numbers.shape and own.typecode == "d":
        if not np.array_equal(np.array(own), numbers):
            own[:] = numbers.tolist()  # in place: bounds for the sliders are kept
    else:
        shown[name] = numbers.tolist()


def _declare(shown: bpy.types.Object, name: str, told: Mapping[str, Any]) -> None:
    """Bounds and unit of a variable, for sliders and their tooltips."""
    lower = [x for x in told["lower"] if x is not None]
    upper = [x for x in told["upper"] if x is not None]
    reach = 10 * told["typical"]
    soft = {
        "soft_min": min(lower) if lower else min(told["value"]) - reach,
        "soft_max": max(upper) if upper else max(told["value"]) + reach,
    }
    hard = {"min": min(lower)} if len(lower) == told["size"] else {}
    hard |= {"max": max(upper)} if len(upper) == told["size"] else {}
    unit = f" [{told['unit']}]" if told["unit"] else ""
    about = f"{name}{unit}: {told['size']} number{'s' * (told['size'] > 1)}"
    step = {"step": max(told["typical"] * 10, 0.1), "precision": 4}
    shown.id_properties_ui(name).update(description=about, **soft, **hard, **step)


@functools.lru_cache(maxsize=16)
def _parsed(told: str) -> dict[str, Any]:
    return json.loads(told) if told else {}


def _redraw() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "PROPERTIES"):
                area.tag_redraw()


def register() -> None:
    """Give scenes a case."""
    bpy.utils.register_class(MoldlineProject)
    bpy.types.Scene.moldline = bpy.props.PointerProperty(type=MoldlineProject)


def unregister() -> None:
    """Take it away; connections are forgotten."""
    forget()
    del bpy.types.Scene.moldline
    bpy.utils.unregister_class(MoldlineProject)
