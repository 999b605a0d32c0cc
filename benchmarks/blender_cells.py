"""How Blender's mesh deform comes nearer to our cage as its grid is refined, and what it costs.

usage: python benchmarks/blender_cells.py [--markdown] [--sizes 4 5 6 7]

A bar of 1 x 1/8 x 1/8 with 26 points and random displacements of them, at 3000 places a fifth of
the half-width and more inside it. Sizes are Blender's precisions p, whose grid is a cube of
2**p + 2 cells. `rms` and `largest` are the differences of the points from ours with 192 x 48 x 48
cells, in the largest displacement; `order` is that of rms, by halving the cells; `bind` in seconds;
`stay` counts points that do not move. The last rows are ours with fewer cells.
"""

from collections.abc import Iterator

import numpy as np
import table
from blender_process import Blender, cage_scene
from cage import box

SIZE, MARGIN = (1.0, 0.125, 0.125), 0.0125

BEST = (192, 48, 48)
FEWER = ((24, 6, 6), (48, 12, 12), (96, 24, 24))

COLUMNS = ("who", "bind", "stay", "largest", "rms", "order")


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], (4, 5, 6, 7))
    table.show(COLUMNS, rows(given.sizes), given.markdown)


def rows(precisions: list[int]) -> Iterator[table.Row]:
    """Blender's, then ours."""
    import moldline as ml

    corners, faces = box()
    corners = corners / np.ptp(corners, axis=0) * SIZE
    low, high = corners.min(axis=0) + MARGIN, corners.max(axis=0) - MARGIN
    points = np.random.default_rng(0).uniform(low, high, (3000, 3))
    best = ml.Cage(corners, faces, cells=BEST)
    controls = 0.02 * np.random.default_rng(1).normal(size=best.size)
    known = np.asarray(best.bind(points)(controls))
    before = None

    def compared(who: str, moved: np.ndarray, took: float | None) -> table.Row:
        nonlocal before
        off = np.abs(moved - known) / np.abs(controls).max()
        rms = float(np.sqrt(np.mean(off**2)))
        stay = float(np.sum(np.all(np.abs(moved - points) < 1e-6, axis=1)))
        row: table.Row = {"who": who, "bind": took, "stay": stay}
        row |= {"largest": float(off.max()), "rms": rms}
        if before is not None:
            row["order"] = float(np.log2(before / rms))
        before = rms
        return row

    with Blender(patience=3600.0) as blender:
        for precision in precisions:
            told = blender.open(**cage_scene(points, best, controls, precision))
            moved = blender.deform()["deformed"]
            yield compared(f"Blender, precision {precision}", moved, told["bind"])
    before = None
    for cells in FEWER:
        moved = np.asarray(ml.Cage(corners, faces, cells=cells).bind(points)(controls))
        yield compared(f"ours, {' x '.join(map(str, cells))}", moved, None)


if __name__ == "__main__":
    main()
