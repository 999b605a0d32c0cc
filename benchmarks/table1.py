"""Table 1 of the paper (AIAA 2012-0965), ours and Blender's in one run.

usage: python benchmarks/table1.py [--markdown] [--sizes 1300 48000 ...]

A closed smooth surface in a lattice of 3x3x3 points, and in a cage of 26. Times are medians by the
clock in milliseconds of 30 evaluations, from changed controls to all points; ours and Blender's
take turns, five evaluations each and one before them that is not counted. `lattice, its rule` is
ours with `ends="blender"`, which gives Blender's points; the plain one is clamped. `embedding`, and
Blender's bind at its default precision, are medians of three, with solving for the coordinates.
`cores` are processor time over time; `apart` is how far the points are from Blender's, in the
largest move of a control. Blender is asked where `make blender` has made its environment; it
computes in single precision, ours in double but for weights in the rows that say so. For one core:
`taskset -c 0` before the command.
"""

import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import table
from blender_process import Blender, cage_scene, lacking, lattice_scene
from cage import PAPER as PAPER_CAGE
from cage import PRECISION, box, points_inside
from deform import PAPER as PAPER_LATTICE

SIZES = (1_300, 6_000, 48_000, 127_000, 185_000, 1_000_000)

ROUNDS, EACH, BINDS = 6, 5, 3
"""Turns, evaluations in each, and embeddings."""

COLUMNS = (
    "what", "vertices", "ours", "cores", "Blender", "its cores", "Blender/ours", "apart", "paper",
    "paper/ours",
)  # fmt: skip


class Took(NamedTuple):
    """Medians of a number of evaluations, and the last points."""

    wall: float
    cores: float
    points: np.ndarray


Timed = Callable[[int], dict[str, Any]]
"""Runs something so often: its seconds by the clock and of the processor, and the last points."""


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], SIZES)
    reason = lacking()
    if reason:
        print(f"without Blender: {reason}", file=sys.stderr)
    blender = None if reason else Blender()
    try:
        table.show(COLUMNS, _rows(given.sizes, blender), given.markdown)
    finally:
        if blender is not None:
            blender.close()


def _rows(sizes: list[int], blender: Blender | None) -> Iterator[table.Row]:
    """What is done first, for all sizes, then the next."""
    for measure in (lattices, cages):
        found = [row for size in sizes for row in measure(size, blender)]
        for what in dict.fromkeys(str(row["what"]) for row in found):
            yield from (row for row in found if row["what"] == what)


def lattices(size: int, blender: Blender | None) -> list[table.Row]:
    """Rows of the lattice, clamped and with Blender's rule."""
    import moldline as ml

    points = points_inside(size)
    clamped = ml.Lattice.around(points, (3, 3, 3))
    same = ml.Lattice.around(points, (3, 3, 3), ends="blender")
    controls = 0.01 * np.random.default_rng(0).normal(size=clamped.size)
    ways = {"lattice": ours(clamped, points, controls)}
    ways["lattice, its rule"] = ours(same, points, controls)
    if blender is not None:
        blender.open(**lattice_scene(points, same, controls))
        ways["Blender"] = blender.deform
    took = interleaved(ways)
    paper = PAPER_LATTICE.get(size)
    apart = [None, _apart(took, "lattice, its rule", controls)]  # another rule is not compared
    return [
        {"what": what, "vertices": len(points), "apart": off} | _beside(took, what, paper)
        for what, off in zip(list(ways)[:2], apart, strict=True)
    ]


def cages(size: int, blender: Blender | None) -> list[table.Row]:
    """Rows of the cage with double and single weights, and of embedding in it."""
    import moldline as ml

    points = points_inside(size)
    kinds = {"cage": "double", "cage, single": "single"}
    nets = {what: ml.Cage(*box(), precision=kind) for what, kind in kinds.items()}
    controls = 0.01 * np.random.default_rng(0).normal(size=nets["cage"].size)

    def embed(repeats: int) -> dict[str, Any]:
        return _each(lambda _: ml.Cage(*box()).bind(points), repeats) | {"deformed": points}

    def bind(repeats: int) -> dict[str, Any]:
        assert blender is not None
        scene = cage_scene(points, nets["cage"], controls, PRECISION)
        told = [blender.open(**scene) for _ in range(repeats)]
        walls, processor = ([one[key] for one in told] for key in ("bind", "bind_processor"))
        return {"seconds": walls, "processor_seconds": processor, "deformed": points}

    binds = {"embedding": embed} | ({} if blender is None else {"Blender": bind})
    embedded = interleaved(binds, BINDS, 1)
    ways = {what: ours(net, points, controls) for what, net in nets.items()}
    if blender is not None:
        ways["Blender"] = blender.deform
    took = interleaved(ways)
    once, paper = PAPER_CAGE.get(size, (None, None))
    rows: list[table.Row] = [
        {"what": what, "vertices": len(points), "apart": _apart(took, what, controls)}
        | _beside(took, what, paper)
        for what in nets
    ]
    told = _beside(embedded, "embedding", None if once is None else 1e3 * once)
    return [*rows, {"what": "embedding", "vertices": len(points)} | told]


def ours(net: Any, points: np.ndarray, controls: np.ndarray) -> Timed:
    """A net of ours on points, the controls a little different in each evaluation."""
    import jax

    binding = net.bind(points)

    def run(repeats: int) -> dict[str, Any]:
        given = [controls + 1e-3 * left for left in range(repeats, -1, -1)]
        found = _each(lambda i: jax.block_until_ready(binding(given[i])), repeats + 1)
        return {key: found[key][1:] for key in ("seconds", "processor_seconds")} | {
            "deformed": np.asarray(binding(controls))
        }

    return run


def interleaved(ways: dict[str, Timed], rounds: int = ROUNDS, each: int = EACH) -> dict[str, Took]:
    """Medians of each way, where all take turns."""
    told = [{name: run(each) for name, run in ways.items()} for _ in range(rounds)]
    took = {}
    for name in ways:
        walls, processor = (
            np.concatenate([one[name][key] for one in told])
            for key in ("seconds", "processor_seconds")
        )
        cores = float(np.sum(processor) / np.sum(walls))
        took[name] = Took(1e3 * float(np.median(walls)), cores, told[-1][name]["deformed"])
    return took


def _each(call: Callable[[int], object], repeats: int) -> dict[str, Any]:
    """Seconds of each of a number of calls, by the clock and of the processor."""
    times = []
    for i in range(repeats):
        clock, processor = time.perf_counter(), time.process_time()
        call(i)
        times.append((time.perf_counter() - clock, time.process_time() - processor))
    walls, processors = zip(*times, strict=True)
    return {"seconds": walls, "processor_seconds": processors}


def _beside(took: dict[str, Took], what: str, paper: float | None) -> table.Row:
    """Ours beside Blender's and the paper's."""
    own, theirs = took[what], took.get("Blender")
    row: table.Row = {"ours": own.wall, "cores": own.cores}
    if theirs is not None:
        row |= {"Blender": theirs.wall, "its cores": theirs.cores}
        row["Blender/ours"] = theirs.wall / own.wall
    if paper is not None:
        row |= {"paper": paper, "paper/ours": paper / own.wall}
    return row


def _apart(took: dict[str, Took], what: str, controls: np.ndarray) -> float | None:
    if "Blender" not in took:
        return None
    off = np.abs(took[what].points - took["Blender"].points).max()
    return float(off / np.abs(controls).max())


if __name__ == "__main__":
    main()
