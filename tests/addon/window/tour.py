"""The tutorial's way through the add-on, with its pictures.

blender --enable-event-simulate --python tour.py -- PYTHON SURFACE FOLDER
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))

import session as first
from hand import Hand, perform


def idle() -> bool:
    """Whether nothing is under way."""
    return first.rests() and not sys.modules[f"{first.MODULE}.session"].busy()


def call(hand: Hand, operator: str, how: str = "EXEC_DEFAULT", **given: object) -> Iterator[float]:
    """An operator of the panel, as its button calls it."""
    with bpy.context.temp_override(window=hand.window, area=hand.area, region=hand.region):
        getattr(bpy.ops.moldline, operator)(how, **given)
    yield 0.5
    yield from hand.until(idle)
    yield 0.5


def scrolled(hand: Hand, clicks: int) -> Iterator[float]:
    """The sidebar, up or down."""
    sidebar = next(r for r in hand.area.regions if r.type == "UI")
    yield from hand.move(sidebar.x + 100, sidebar.y + 300)
    for _ in range(abs(clicks)):
        hand.event("WHEELDOWNMOUSE" if clicks > 0 else "WHEELUPMOUSE", "PRESS")
        yield 0.1
    yield 0.3


def skeleton(hand: Hand) -> Iterator[float]:
    """Four bones; the tip is lifted and turned."""
    yield from call(hand, "add_wing_skeleton", stations=4)
    yield from hand.picture("tour_skeleton")
    yield from hand.centre()
    yield from hand.key("TAB", ctrl=True)
    yield 0.5
    yield from hand.click(*hand.place_of(first.tip()))
    yield from first.dragged(hand, "G", 5, 40)
    yield from first.dragged(hand, "S", 18, 0)
    yield from hand.picture("tour_posed")
    yield from hand.centre()
    yield from hand.key("TAB", ctrl=True)
    yield 0.5


def lattice(hand: Hand) -> Iterator[float]:
    """A lattice behind it; control points are lifted by hand, and become a variable."""
    yield from call(hand, "add_wing_lattice", shape=(7, 5, 2))
    yield from hand.centre()
    yield from hand.key("TAB")
    yield 0.5
    net = bpy.context.object
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.mesh.select_mode(type="VERT")
    for i in (2, 3, 4):
        x, y = hand.place_of(net.matrix_world @ net.data.vertices[(i * 5 + 2) * 2 + 1].co)
        yield from hand.click(x, y, shift=i > 2)
    first.tip = lambda: net.matrix_world @ net.data.vertices[(3 * 5 + 2) * 2 + 1].co
    yield from hand.centre()
    yield from hand.key("G")
    yield from hand.key("Z")
    x, y = hand.region.x + hand.region.width / 2, hand.region.y + hand.region.height / 2
    yield from hand.glide(x, y + 25, 20)
    yield from hand.key("RET")
    yield from hand.until(idle)
    yield from hand.picture("tour_lattice")
    with bpy.context.temp_override(window=hand.window, area=hand.area, region=hand.region):
        bpy.ops.moldline.add_variable("INVOKE_DEFAULT", by="SELECTION", name="bump")
    yield 1.0
    yield from hand.picture("tour_variable")
    yield from hand.key("RET")
    yield 0.5
    yield from hand.until(idle)
    yield from hand.centre()
    yield from hand.key("TAB")
    yield 0.5
    yield from scrolled(hand, 8)
    yield from hand.picture("tour_sliders")


def measures(hand: Hand) -> Iterator[float]:
    """What must be kept is measured while the shape moves."""
    yield from call(hand, "add_measure", kind="volume", keep="LEAST", slack=0.0)
    yield from call(hand, "add_measure", kind="thickness", at="15", chord="0.3")
    surface = bpy.data.objects["transport_wing"]
    twist = list(surface["chord"])
    surface["chord"] = [c * 0.9 for c in twist]
    surface.update_tag()
    yield 0.5
    yield from hand.until(idle)
    yield 0.5
    yield from scrolled(hand, 8)
    yield from hand.picture("tour_measures")


def look(hand: Hand) -> Iterator[float]:
    """How the shape answers to a variable, and whether the mesh is sound."""
    yield from call(hand, "show_sensitivity")
    yield 2.0
    yield from call(hand, "check_health")
    yield 2.0
    yield from hand.centre()
    yield from hand.picture("tour_sensitivity")


def saved(hand: Hand) -> Iterator[float]:
    """The case."""
    yield from call(hand, "save_case_as", filepath=str(first.FOLDER / "wing.toml"))


def tour(hand: Hand) -> Iterator[float]:
    """All of it, in a large view."""
    yield from hand.centre()
    yield from hand.key("SPACE", ctrl=True)
    yield 0.5
    for part in (first.imported, skeleton, lattice, measures, look, saved):
        yield from part(hand)


if __name__ == "__main__":
    first.prepared()
    perform(tour, first.FOLDER)
