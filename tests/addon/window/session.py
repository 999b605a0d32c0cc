"""A designer at the window: import, wing skeleton, drag, undo, save; run by test_window.

blender --enable-event-simulate --python session.py -- PYTHON SURFACE FOLDER
"""

import sys
from collections.abc import Iterator
from math import radians
from pathlib import Path

import addon_utils
import bpy
import numpy as np
from mathutils import Euler, Vector

sys.path.insert(0, str(Path(__file__).parent))

from hand import Hand, perform

MODULE = "bl_ext.user_default.moldline"
PYTHON, SURFACE, FOLDER = (Path(given) for given in sys.argv[-3:])


def prepared() -> None:
    """No splash, the scene empty, moldline's interpreter named."""
    preferences = bpy.context.preferences
    preferences.view.show_splash = False
    preferences.view.filebrowser_display_type = "SCREEN"
    preferences.view.smooth_view = 0
    if MODULE not in preferences.addons:
        addon_utils.enable(MODULE, default_set=True)
    own = preferences.addons[MODULE].preferences
    own.python, own.socket = str(PYTHON), str(FOLDER / "moldline.sock")
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)


def chosen(hand: Hand, path: Path) -> Iterator[float]:
    """Choose a file in the browser that fills the screen, and confirm."""
    area = next(a for a in hand.window.screen.areas if a.type == "FILE_BROWSER")
    given = area.spaces.active.params
    given.directory, given.filename = str(path.parent).encode(), path.name
    yield 0.5
    yield from hand.move(area.x + area.width / 2, area.y + area.height / 2)
    yield from hand.key("RET")
    yield 0.5


def seen_from(hand: Hand, tilt: float, turn: float, place: tuple, distance: float) -> None:
    """Where the view is taken from: angles in degrees, what is in its middle, how far away."""
    view = hand.area.spaces.active.region_3d
    view.view_perspective = "PERSP"
    view.view_rotation = Euler((radians(tilt), 0, radians(turn))).to_quaternion()
    view.view_location, view.view_distance = place, distance


def surface() -> np.ndarray:
    """The points that the window shows."""
    mesh = bpy.data.objects["transport_wing"].data
    found = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", found.reshape(-1))
    return found


def rests() -> bool:
    """Whether the shape is what handles and values say."""
    return not sys.modules[f"{MODULE}.following"].is_busy(bpy.context.scene)


def tip() -> Vector:
    """The middle of the outermost bone."""
    thing = bpy.data.objects["wing skeleton"]
    bone = thing.pose.bones[-1]
    return thing.matrix_world @ ((bone.head + bone.tail) / 2)


def imported(hand: Hand) -> Iterator[float]:
    """A geometry through the file browser."""
    yield from hand.centre()
    yield from hand.key("N")
    yield 1.0
    sidebar = next(r for r in hand.area.regions if r.type == "UI")
    yield from hand.click(sidebar.x + sidebar.width - 12, sidebar.y + sidebar.height - 125)
    yield from hand.picture("empty")
    yield from hand.search("Import Geometry")
    yield from chosen(hand, SURFACE)
    yield from hand.until(lambda: "transport_wing" in bpy.data.objects, 90)
    seen_from(hand, 55, -60, (33, 9, 0), 47)
    yield from hand.picture("imported")


def posed(hand: Hand) -> Iterator[float]:
    """A wing skeleton; its tip is dragged up and turned, undone and done again."""
    yield from hand.search("Add Wing Skeleton")
    yield from hand.until(lambda: "wing skeleton" in bpy.data.objects, 120)
    yield from hand.until(rests)
    yield from hand.picture("skeleton")
    yield from hand.centre()
    yield from hand.key("TAB", ctrl=True)
    yield 0.5
    rest = surface()
    yield from hand.click(*hand.place_of(tip()))
    yield from dragged(hand, "G", 0, 90)
    lifted = surface()
    assert np.abs(lifted - rest)[:, 2].max() > 1, "the surface did not follow the hand"
    yield from hand.picture("dragged")
    yield from hand.centre()
    yield from hand.key("Z", ctrl=True)
    yield 0.3
    yield from hand.until(rests)
    assert np.array_equal(surface(), rest), "undo does not bring the surface back"
    yield from hand.key("Z", ctrl=True, shift=True)
    yield 0.3
    yield from hand.until(rests)
    assert np.array_equal(surface(), lifted), "redo does not bring the shape back"
    yield from hand.picture("redone")


def dragged(hand: Hand, key: str, dx: float, dy: float) -> Iterator[float]:
    """A tool of Blender's with the mouse: begin, glide, confirm; the shape must follow."""
    shapes: list[None] = []
    following = sys.modules[f"{MODULE}.following"]
    following.on_shape(note := lambda *_: shapes.append(None))
    x, y = hand.place_of(tip())
    yield from hand.move(x, y)
    yield from hand.key(key)
    yield from hand.glide(x + dx, y + dy, 60, 0.01)
    yield from hand.key("RET")
    sys.modules[f"{MODULE}.pursuit"].listeners.remove(note)
    assert len(shapes) > 10, f"the shape followed {len(shapes)} times only in a drag of 60 steps"
    yield from hand.until(rests)


def saved(hand: Hand) -> Iterator[float]:
    """The case into a file, and what the window shows beside it."""
    yield from hand.search("Save Case As")
    yield from chosen(hand, FOLDER / "case.toml")
    yield from hand.until(lambda: (FOLDER / "case.toml").exists())
    np.save(FOLDER / "shown.npy", surface())


def coloured(hand: Hand) -> Iterator[float]:
    """The sensitivity to the first number of twist, as colours."""
    yield from hand.search("Show Sensitivity")
    yield 3.0
    yield from hand.picture("sensitivity")
    yield from hand.search("Hide Sensitivity")
    yield from hand.search("Check Health")
    yield 3.0
    yield from hand.picture("health")


def session(hand: Hand) -> Iterator[float]:
    """All of it."""
    for part in (imported, posed, saved, coloured):
        yield from part(hand)


if __name__ == "__main__":
    prepared()
    perform(session, FOLDER)
