"""A designer at the window: import, wing skeleton, drag, undo, save; run by test_window.

    blender --enable-event-simulate --python session.py -- PYTHON SURFACE FOLDER
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import addon_utils
import bpy

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


def shown(hand: Hand) -> Iterator[float]:
    """All of the scene in the view, from above and behind."""
    yield from hand.centre()
    yield from hand.key("HOME")
    yield 0.3


def session(hand: Hand) -> Iterator[float]:
    """All of it."""
    yield from hand.centre()
    yield from hand.key("N")
    yield 1.0
    sidebar = next(r for r in hand.area.regions if r.type == "UI")
    yield from hand.click(sidebar.x + sidebar.width - 12, sidebar.y + sidebar.height - 125)
    yield from hand.picture("empty")
    yield from hand.search("Import Geometry")
    yield from chosen(hand, SURFACE)
    yield from hand.until(lambda: "transport_wing" in bpy.data.objects, 90)
    yield from shown(hand)
    yield from hand.picture("imported")
    yield from hand.search("Wing Skeleton")
    yield 8.0
    yield from hand.picture("skeleton")


prepared()
perform(session, FOLDER)
