"""Updates per second that Blender shows while a hand drags a control point, or a slider, of a wing.

usage: .venv-blender/bin/python benchmarks/blender_live.py [--markdown] [--sizes 48000 185000 ...]

Runs in Blender's Python, in background, with the add-on of this repository; moldline runs in .venv,
or in the environment whose interpreter MOLDLINE_PYTHON names. Each row is a wing of that many
vertices under a lattice of `controls` control points that move freely. All of the way is measured:
`hand` counts how often per second a control point that moved in edit mode was seen by the add-on,
its values found by moldline, and the new points written into Blender's mesh; `slider` does the same
for a value that was turned; `keyed` gives each frame of an animation its shape in double precision.
`late` is the time from a single motion to its points in the mesh [ms], `rest` from there to double
precision and all handles in their places [ms]; medians.
"""

import argparse
import importlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

TOP = Path(__file__).parents[1]
MODULE = "bl_ext.user_default.moldline"
SIZES = (10_000, 48_000, 185_000, 1_000_000)
COLUMNS = ("vertices", "controls", "cores", "load", "hand", "slider", "keyed", "late", "rest")
DRAG = 3.0
"""Seconds."""

CASE = """\
moldline = 1

[geometry.wing]
file = "wing.tri"
units = "m"

[variable.lift]
size = 36
unit = "m"

[[stage]]
name = "box"
deformer = "lattice"
shape = [6, 3, 2]

[[stage.link]]
variable = "lift"
link = "each"
axis = "z"
"""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=list(SIZES))
    parser.add_argument("--markdown", action="store_true", help="a table for the docs")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        switched_on(folder)
        try:
            sys.path.insert(0, str(Path(__file__).parent))
            table = importlib.import_module("table")
            table.show(COLUMNS, rows(given.sizes, folder), given.markdown)
        finally:
            switch_off()


def switched_on(folder: Path) -> None:
    """Build the extension, install it into a throw-away folder and switch it on."""
    os.environ["BLENDER_USER_RESOURCES"] = str(folder / "blender")
    import bpy

    command = [sys.executable, TOP / "tools/build_addon.py", "--output", folder / "dist"]
    subprocess.run(
        [*command, "--staged", folder / "staged"], check=True, capture_output=True, cwd=TOP
    )
    archive = str(next((folder / "dist").glob("*.zip")))
    bpy.ops.extensions.package_install_files(
        filepath=archive, repo="user_default", enable_on_install=True
    )
    preferences = bpy.context.preferences.addons[MODULE].preferences
    preferences.python = os.environ.get("MOLDLINE_PYTHON", str(TOP / ".venv/bin/python"))
    preferences.socket = str(folder / "socket")


def switch_off() -> None:
    """Stop moldline, and let Blender end."""
    import bpy

    sys.modules[f"{MODULE}.session"].stop()
    bpy.ops.preferences.addon_disable(module=MODULE)


def rows(sizes: list[int], folder: Path) -> Iterator[dict[str, Any]]:
    """One for each size."""
    for size in sizes:
        place = folder / str(size)
        place.mkdir()
        yield measured(size, place)
        shutil.rmtree(place)


def measured(size: int, folder: Path) -> dict[str, Any]:
    """One row."""
    import bpy

    project, following, handles = (
        importlib.import_module(f"{MODULE}.{name}") for name in ("project", "following", "handles")
    )
    bpy.ops.wm.read_homefile(use_empty=True)
    scene, count = bpy.context.scene, write_wing(folder / "wing.tri", size)
    project.open_case(scene, CASE, str(folder))
    following.settle(scene)
    if following.is_busy(scene):
        raise SystemExit(scene.moldline.status)
    net, surface = handles.of_stage(scene, 0), project.surface(scene)
    row = {"vertices": count, "controls": len(net.data.vertices), "cores": os.cpu_count()}
    row["load"] = os.getloadavg()[0]

    def turn(height: float) -> None:
        surface["lift"][7] = height
        surface.update_tag()
        bpy.context.view_layer.update()

    row["slider"] = dragged(scene, turn)
    surface["lift"][7] = 0.0
    following.settle(scene)
    for frame in (1, 1001):
        surface["lift"][7] = 1e-3 * frame
        surface.keyframe_insert('["lift"]', index=7, frame=frame)
    row["keyed"] = 1e3 / table_median(lambda i: scene.frame_set(2 + i))
    surface.animation_data_clear()
    bpy.context.view_layer.objects.active = net
    bpy.ops.object.mode_set(mode="EDIT")

    def move(height: float) -> None:
        import bmesh

        edited = bmesh.from_edit_mesh(net.data)
        edited.verts.ensure_lookup_table()
        edited.verts[7].co.z = height
        bmesh.update_edit_mesh(net.data, loop_triangles=False, destructive=False)
        bpy.context.view_layer.update()

    row["hand"] = dragged(scene, move)
    row["late"], row["rest"] = late(scene, move)
    bpy.ops.object.mode_set(mode="OBJECT")
    return row


def dragged(scene: Any, act: Callable[[float], None]) -> float:
    """Shapes per second that arrive in the mesh while something moves without pause."""
    following = importlib.import_module(f"{MODULE}.following")
    shown: list[float] = []
    following.on_shape(lambda _, shape: shown.append(time.perf_counter()))
    for _ in range(20):
        act(0.001)
        following.step(scene)
    shown.clear()
    start = time.perf_counter()
    while (passed := time.perf_counter() - start) < DRAG:
        act(0.1 * np.sin(3.0 * passed) + 0.2)  # the handler sends it
        following.step(scene)  # what the timer does
    found = len(shown) / DRAG
    following.settle(scene)
    return found


def late(scene: Any, act: Callable[[float], None]) -> tuple[float, float]:
    """Times until a single motion shows, and until all rests [ms]; medians."""
    following = importlib.import_module(f"{MODULE}.following")
    shown: list[float] = []
    following.on_shape(lambda _, shape: shown.append(time.perf_counter()))
    first, rest = [], []
    for i in range(11):
        shown.clear()
        start = time.perf_counter()
        act(0.1 + 0.01 * i)
        following.settle(scene)
        first.append(shown[0] - start)
        rest.append(time.perf_counter() - shown[0])
    return 1e3 * float(np.median(first)), 1e3 * float(np.median(rest))


def table_median(call: Callable[[int], object], repeats: int = 11) -> float:
    """Median time of a call [ms]."""
    times = []
    for i in range(repeats):
        start = time.perf_counter()
        call(i)
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))


def write_wing(path: Path, size: int) -> int:
    """A wing of about so many vertices as a Cart3D file; how many there are."""
    around = 2 * int(np.sqrt(size / 4))
    along = size // around
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    y = np.linspace(0.0, 8.0, along)[:, None]
    chord = 2.0 - 0.15 * y
    x = chord * (0.5 * (1.0 - np.cos(angle))) + 0.4 * y
    z = chord * 0.06 * np.sin(angle) * (1.0 + 0.5 * np.cos(angle)) + 0.0 * y
    points = np.stack([x, y + 0.0 * x, z], axis=-1).reshape(-1, 3)
    number = np.arange(along * around).reshape(along, around)
    a, b = number[:-1], np.roll(number[:-1], -1, axis=1)
    c, d = np.roll(number[1:], -1, axis=1), number[1:]
    sides = [np.stack(rows, axis=-1).reshape(-1, 3) for rows in ((a, b, c), (a, c, d))]
    faces = np.concatenate(sides) + 1
    with path.open("w") as stream:
        stream.write(f"{len(points)} {len(faces)}\n")
        np.savetxt(stream, points, "%.17g")
        np.savetxt(stream, faces, "%d")
        np.savetxt(stream, np.ones(len(faces)), "%d")
    return len(points)


if __name__ == "__main__":
    main()
