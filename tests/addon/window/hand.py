"""A hand for Blender's window: it moves the mouse, presses keys and takes pictures.

Blender must have been started with --enable-event-simulate. A session is a generator that yields
how many seconds to wait, since Blender handles what it was given between its own events.
"""

import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

SHORT = 0.1
"""Seconds in which a window has drawn what is small."""

NAMES = {
    " ": "SPACE", ".": "PERIOD", "-": "MINUS", "/": "SLASH", "_": "MINUS", ":": "SEMI_COLON",
    "0": "ZERO", "1": "ONE", "2": "TWO", "3": "THREE", "4": "FOUR", "5": "FIVE", "6": "SIX",
    "7": "SEVEN", "8": "EIGHT", "9": "NINE",
}  # fmt: skip
"""Keys of characters that are no letters."""


class Hand:
    """Events for the first window.

    Attributes
    ----------
    folder
        Where pictures go.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self._place = (0, 0)

    @property
    def window(self) -> bpy.types.Window:
        """Of the whole screen."""
        return bpy.context.window_manager.windows[0]

    @property
    def area(self) -> bpy.types.Area:
        """The largest 3D view."""
        views = [a for a in self.window.screen.areas if a.type == "VIEW_3D"]
        return max(views, key=lambda area: area.width * area.height)

    @property
    def region(self) -> bpy.types.Region:
        """What the view is drawn in."""
        return next(r for r in self.area.regions if r.type == "WINDOW")

    def event(self, kind: str, value: str, **more: object) -> None:
        """One event where the mouse is."""
        x, y = self._place
        self.window.event_simulate(type=kind, value=value, x=x, y=y, **more)

    def key(self, kind: str, **modifiers: bool) -> Iterator[float]:
        """Press and release a key: `key("Z", ctrl=True)`."""
        self.event(kind, "PRESS", **modifiers)
        self.event(kind, "RELEASE", **modifiers)
        yield SHORT

    def write(self, text: str) -> Iterator[float]:
        """Type a text."""
        for character in text:
            kind = NAMES.get(character, character.upper())
            self.event(kind, "PRESS", unicode=character)
            self.event(kind, "RELEASE")
            yield 0.02
        yield SHORT

    def move(self, x: float, y: float) -> Iterator[float]:
        """The mouse to a place in the window, from its lower left."""
        self._place = round(x), round(y)
        self.event("MOUSEMOVE", "NOTHING")
        yield 0.02

    def click(self, x: float, y: float, **modifiers: bool) -> Iterator[float]:
        """Press the left button somewhere, and let it go."""
        yield from self.move(x, y)
        self.event("LEFTMOUSE", "PRESS", **modifiers)
        self.event("LEFTMOUSE", "RELEASE", **modifiers)
        yield SHORT

    def glide(self, x: float, y: float, steps: int = 20, pause: float = 0.03) -> Iterator[float]:
        """The mouse from where it is to a place, as a hand would."""
        x0, y0 = self._place
        for i in range(1, steps + 1):
            yield from self.move(x0 + (x - x0) * i / steps, y0 + (y - y0) * i / steps)
            yield pause

    def centre(self) -> Iterator[float]:
        """The mouse to the middle of the view, where its keys are heard."""
        yield from self.move(
            self.region.x + self.region.width / 2, self.region.y + self.region.height / 2
        )

    def place_of(self, point: Vector) -> tuple[float, float]:
        """Where in the window a point of space is drawn."""
        space = self.area.spaces.active
        found = location_3d_to_region_2d(self.region, space.region_3d, point)
        assert found is not None, f"{point} is behind the eye"
        return self.region.x + found.x, self.region.y + found.y

    def search(self, label: str) -> Iterator[float]:
        """Call an operator as a user does who does not know where it is: F3, its name, Enter."""
        yield from self.centre()
        yield from self.key("F3")
        yield 0.5
        yield from self.write(label)
        yield 0.8
        yield from self.key("RET")
        yield 0.5

    def picture(self, name: str) -> Iterator[float]:
        """What the screen shows, into a file."""
        yield 0.5
        subprocess.run(["import", "-window", "root", self.folder / f"{name}.png"], check=True)
        yield SHORT

    def until(self, happens: Callable[[], bool], seconds: float = 60.0) -> Iterator[float]:
        """Wait for something; an error if it does not come."""
        waited = 0.0
        while not happens():
            if waited > seconds:
                raise TimeoutError(f"waited {seconds:g} s in vain for {happens.__name__}")
            waited += 0.2
            yield 0.2


def perform(session: Callable[[Hand], Iterator[float]], folder: Path) -> None:
    """Do all that a session says, then leave Blender: with 0 if nothing went wrong."""
    hand = Hand(folder)
    steps = session(hand)

    def tick() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            leave(0)
        except Exception:
            traceback.print_exc()
            subprocess.run(["import", "-window", "root", folder / "failed.png"], check=False)
            leave(1)
        return None

    bpy.app.timers.register(tick, first_interval=2.0, persistent=True)


def leave(status: int) -> None:
    """End Blender at once, with a status that tells."""
    (Path(sys.argv[-1]) / "status").write_text(str(status))
    bpy.ops.wm.quit_blender()
