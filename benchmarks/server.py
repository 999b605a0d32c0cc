"""Time of a request to a running moldline, beside a process that is started for each.

usage: python benchmarks/server.py [--markdown] [--sizes 48000 185000 ...]

Each row is a surface of that many vertices under a lattice. Times are medians in milliseconds,
measured by a client in another process than the server's. `deform` is `moldline deform` from the
shell, the file it writes included; `open` a case's first request, `ping` one that does nothing;
`sent` and `shared` are new values in and points out through the socket and through shared memory,
`float` the latter in single precision; `per second` counts drags that end at the screen's side:
values are pushed faster than they can be served, the latest wins; `by hand` the same where a
control point is pulled and the values are solved for.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import table
from deform import surface_points
from table import median

import moldline as ml
from moldline.server.client import Client
from moldline.server.remote import RemoteCase

SIZES = (10_000, 48_000, 185_000, 1_000_000)
COLUMNS = (
    "vertices", "cores", "load", "deform", "open", "ping", "in process", "sent", "shared",
    "float", "pullback", "per second", "by hand",
)  # fmt: skip
DRAG = 3.0
"""Seconds."""

CASE = """\
moldline = 1

[geometry.body]
file = "body.tri"
units = "m"

[variable.lift]
size = 27
bounds = [-1.0, 1.0]
unit = "m"

[[stage]]
name = "box"
deformer = "lattice"
shape = [3, 3, 3]

[[stage.link]]
variable = "lift"
link = "each"
axis = "z"
"""


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], SIZES)
    table.show(COLUMNS, rows(given.sizes), given.markdown)


def rows(sizes: list[int]) -> Iterator[table.Row]:
    """Each with a server of its own."""
    for size in sizes:
        with tempfile.TemporaryDirectory() as place:
            yield measured(size, Path(place))


def measured(size: int, folder: Path) -> table.Row:
    """One row."""
    points = surface_points(size)
    ml.write(folder / "body.tri", ml.Surface(points, faces(size)))
    (folder / "case.toml").write_text(CASE)
    row: dict[str, Any] = {"vertices": len(points), "cores": os.cpu_count()}
    row["load"] = os.getloadavg()[0]
    command = [sys.executable, "-m", "moldline", "deform", "case.toml", "-o", "new.tri"]
    row["deform"] = 1e3 * table.best(
        lambda: subprocess.run(command, cwd=folder, check=True, capture_output=True), 2
    )
    with Client.start(folder / "socket", quit_after=1) as client:
        time.sleep(8)  # the server has a process ready by then
        start = time.perf_counter()
        case = client.open(folder / "case.toml")
        case.points(some(0.0))
        row["open"] = 1e3 * (time.perf_counter() - start)
        row["ping"] = median(client.ping, 101)
        row["shared"] = median(lambda: case.points(some(0.1)))
        row["float"] = median(lambda: case.points(some(0.1), dtype="<f4"))
        weights = np.ones_like(points)
        row["pullback"] = median(lambda: case.pullback(some(0.1), weights))
        row["per second"] = dragged(case)
        row["by hand"] = pulled(case)
    with Client.connect(folder / "socket", shared=False) as client:
        case = client.open(folder / "case.toml")
        row["sent"] = median(lambda: case.points(some(0.1)))
    pipeline = ml.load(folder / "case.toml").pipeline
    row["in process"] = median(lambda: np.asarray(pipeline.points(some(0.1))))
    return row


def dragged(case: RemoteCase) -> float:
    """Shapes per second that come back while a control is dragged."""
    live, shapes = case.live(dtype="<f4"), 0
    start = time.perf_counter()
    while (passed := time.perf_counter() - start) < DRAG:
        live.push(some(0.1 * np.sin(passed)))
        shapes += live.poll(0.001) is not None
    live.push(some(0.0))
    live.finish()
    return shapes / DRAG


def pulled(case: RemoteCase) -> float:
    """The same while a hand drags the control point in the middle."""
    (handle,) = case.handles()
    live, shapes, moved = case.live(dtype="<f4"), 0, handle.moved.copy()
    start = time.perf_counter()
    while (passed := time.perf_counter() - start) < DRAG:
        moved[13, 2] = handle.moved[13, 2] + 0.1 * np.sin(passed)
        live.pull(handle.stage, moved)
        shapes += live.poll(0.001) is not None
    live.pull(handle.stage, handle.moved)
    live.finish()
    return shapes / DRAG


def some(height: float) -> dict[str, Any]:
    """One control of the lattice lifted."""
    return {"lift": np.eye(27)[13] * height}


def faces(size: int) -> np.ndarray:
    """Triangles of `surface_points`, closed around, open at its ends."""
    lines = int(np.sqrt(size / 2))
    across = 2 * lines
    number = np.arange(lines * across).reshape(lines, across)
    a, b = number[:-1], np.roll(number[:-1], -1, axis=1)
    c, d = np.roll(number[1:], -1, axis=1), number[1:]
    return np.concatenate([np.stack(x, axis=-1).reshape(-1, 3) for x in ((a, d, b), (b, d, c))])


if __name__ == "__main__":
    main()
