"""Error and time of embedding in a cage, ours by cells and Blender's by precision.

usage: python benchmarks/cage_errors.py [--markdown] [--sizes 48000]

The cage and points of `cage.py`. Errors are those of the points' motion for random displacements of
the cage's vertices, in the largest of these, against our own with 72 x 72 x 72 cells (aim: embed no
slower than Blender binds at the precision whose errors are as small or smaller). Each time is the
shortest of three. Blender is asked where `make blender` has made its environment.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import table
from cage import blender, box, points_inside

CELLS: tuple[int | None, ...] = (None, 20, 40)
"""Along each axis; by the cage where None."""

BEST = 72
PRECISIONS = (5, 6, 7)
"""Of Blender's grid; 8 takes more than 15 GB and eight minutes."""
REPEATS = 3

COLUMNS = ("vertices", "who", "largest", "rms", "embed [s]")


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], (48_000,))
    table.show(COLUMNS, rows(given.sizes), given.markdown)


def rows(sizes: list[int]) -> Iterator[table.Row]:
    """Ours, then Blender's."""
    import moldline as ml

    ml.Cage(*box()).bind(points_inside(400))  # compiles
    for size in sizes:
        points = points_inside(size)
        best = ml.Cage(*box(), cells=BEST)
        controls = 0.01 * np.random.default_rng(0).normal(size=best.size)
        known = np.asarray(best.bind(points)(controls))

        def row(who: str, moved: Any, seconds: float) -> table.Row:
            off = np.linalg.norm(moved - known, axis=1) / np.abs(controls).max()  # noqa: B023
            errors = {"largest": float(off.max()), "rms": float(np.sqrt(np.mean(off**2)))}
            return {"vertices": len(points), "who": who, "embed [s]": seconds} | errors  # noqa: B023

        for cells in CELLS:

            def embed() -> Any:
                return ml.Cage(*box(), cells=cells).bind(points)  # noqa: B023

            seconds = table.best(embed, REPEATS)
            who = "default cells" if cells is None else f"{cells} x {cells} x {cells} cells"
            yield row(who, np.asarray(embed()(controls)), seconds)
        for precision in PRECISIONS:
            found = [blender(points, best, controls, precision) for _ in range(REPEATS)]
            if found[0] is not None:
                seconds = min(float(one["bind"]) for one in found)
                yield row(f"Blender, precision {precision}", found[0]["deformed"], seconds)


if __name__ == "__main__":
    main()
