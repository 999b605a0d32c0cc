"""Time to read and write binary files, beside `cp` of the same file in the same run.

usage: python benchmarks/files.py [--markdown] [--sizes 1000000 10000000]

`x` are multiples of `cp`; files lie in memory's cache, as after a first read. `stream` is
`moldline deform --stream` with a lattice of 10 x 10 x 10, file to file, its start-up included.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import table
from deform import surface_points
from table import best

import moldline as ml

SIZES = (1_000_000, 10_000_000)
STL_MOST = 1_000_000
"""Welding the corners of more takes minutes."""

COLUMNS = ("points", "file", "MB", "cp [s]", "read [s]", "x", "write [s]", "x ", "stream [s]")

FILES: dict[str, dict[str, Any]] = {
    "a.i.tri": {"binary": "little"},
    "big.i.tri": {"binary": "big", "records": True},
    "a.xyz": {"binary": "little"},
    "a.ply": {},
    "a.stl": {"binary": True},
    "a.lb8.ugrid": {},
}

CASE = """\
moldline = 1
[geometry.a]
file = "{file}"
[variable.lift]
size = 10
value = 0.01
[[stage]]
deformer = "lattice"
shape = [10, 10, 10]
[[stage.link]]
variable = "lift"
link = "camber"
along = "x"
axis = "z"
"""


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], SIZES)
    rows = (
        measured(size, *file)
        for size in given.sizes
        for file in FILES.items()
        if size <= STL_MOST or not file[0].endswith("stl")
    )
    table.show(COLUMNS, rows, given.markdown)


def measured(size: int, name: str, options: dict[str, Any]) -> table.Row:
    """One row."""
    geometry = made(size, name)
    with tempfile.TemporaryDirectory() as folder:
        path, copy = Path(folder) / name, Path(folder) / f"copy.{name}"
        write = best(lambda: ml.write(path, geometry, **options))
        del geometry
        cp = best(lambda: subprocess.run(["cp", path, copy], check=True))
        read = best(lambda: ml.read(path))
        row: table.Row = {
            "points": size, "file": name, "MB": path.stat().st_size / 1e6, "cp [s]": cp,
            "read [s]": read, "x": read / cp, "write [s]": write, "x ": write / cp,
        }  # fmt: skip
        if not name.endswith(("ply", "ugrid")):
            case = Path(folder) / "case.toml"
            case.write_text(CASE.format(file=name))
            command = [sys.executable, "-m", "moldline", "deform", case, "--stream", "-o", copy]
            start = time.perf_counter()
            subprocess.run(command, check=True, capture_output=True)
            row["stream [s]"] = time.perf_counter() - start
        return row


def made(size: int, name: str) -> ml.Geometry:
    """A geometry that the file can hold."""
    points = surface_points(size)
    rows = int(np.sqrt(size / 2))
    grid = ml.Grid(points, ((2 * rows, rows, 1),))
    if name.endswith("xyz"):
        return grid
    surface = ml.Surface(points, grid.faces)
    if not name.endswith("ugrid"):
        return surface
    from moldline.mesh.volume import Cells

    faces = np.asarray(surface.faces)
    cells = Cells(np.full(len(faces), 5), np.arange(0, 3 * len(faces) + 1, 3), faces.ravel())
    tetra = Cells(np.array([10]), np.array([0, 4]), np.arange(4))
    return ml.VolumeMesh(points, tetra, {"1": cells})


if __name__ == "__main__":
    main()
