"""How Blender's mesh deform comes nearer to our cage as its grid is refined, and what it costs.

usage: python benchmarks/blender_cells.py [--markdown] [--sizes 4 5 6 7 8]

Bars of 1 x 1/8 x 1/8 and 1 x 1/16 x 1/16 with 26 points and random displacements of them, at 3000
places a fifth of the half-width and more inside. Sizes are Blender's precisions p, whose grid is a
cube of 2**p + 2 cells; the thicker bar goes to 7, for at 8 it takes many minutes to bind, the
thinner one from 6, below which Blender's cells are too large for it. `rms` and `largest` are the
differences of the points from ours with the finest of the cells that are listed, in the largest
displacement; `order` is that of rms, by halving the cells; `bind` in seconds; `stay` counts points
that do not move. The last rows of each are ours with fewer cells.
"""

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
import table
from blender_process import Blender, cage_scene
from cage import box

BARS = {"1/8": (4, 5, 6, 7), "1/16": (6, 7, 8)}
"""Thickness, and Blender's precisions that suit it."""

CELLS = ((24, 6, 6), (48, 12, 12), (96, 24, 24), (192, 48, 48))

COLUMNS = ("bar", "who", "bind", "stay", "largest", "rms", "order")


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], range(4, 9))
    rows = (row for bar in BARS for row in compared(bar, given.sizes))
    table.show(COLUMNS, rows, given.markdown)


def compared(bar: str, precisions: list[int]) -> Iterator[table.Row]:
    """Blender's, then ours."""
    import moldline as ml

    corners, faces = box()
    thickness = float(Fraction(bar))
    corners = corners / np.ptp(corners, axis=0) * [1.0, thickness, thickness]
    inside = [0.5, 0.4 * thickness, 0.4 * thickness] - np.array([0.1 * thickness, 0, 0])
    points = np.random.default_rng(0).uniform(-inside, inside, (3000, 3))
    best = ml.Cage(corners, faces, cells=CELLS[-1])
    controls = 0.02 * np.random.default_rng(1).normal(size=best.size)
    known = np.asarray(best.bind(points)(controls))
    before = np.nan

    def row(who: str, moved: np.ndarray, took: float | None) -> table.Row:
        nonlocal before
        off = np.abs(moved - known) / np.abs(controls).max()
        rms = float(np.sqrt(np.mean(off**2)))
        order = None if np.isnan(before) else float(np.log2(before / rms))
        stay = float(np.sum(np.all(np.abs(moved - points) < 1e-6, axis=1)))
        before = rms
        errors: table.Row = {"largest": float(off.max()), "rms": rms, "order": order}
        return {"bar": bar, "who": who, "bind": took, "stay": stay} | errors

    with Blender(patience=3600.0) as blender:
        for precision in sorted(set(precisions) & set(BARS[bar])):
            told = blender.open(**cage_scene(points, best, controls, precision))
            moved = blender.deform()["deformed"]
            yield row(f"Blender, precision {precision}", moved, told["bind"])
    before = np.nan
    for cells in CELLS[:-1]:
        moved = np.asarray(ml.Cage(corners, faces, cells=cells).bind(points)(controls))
        yield row(f"ours, {' x '.join(map(str, cells))}", moved, None)


if __name__ == "__main__":
    main()
