"""Time to deform a surface by pilots over a hidden lattice, beside the plain lattice.

usage: python benchmarks/pilots.py [--markdown] [--sizes 10000 185000 ...]

A closed surface of triangles, 20 pilots moving along z over a hidden lattice of 12 x 5 x 4 control
points; `volume` rows also keep the volume, which is curved, so that there is something to solve.
Each row runs in a process of its own. `build` is in seconds; other times are medians in
milliseconds. `solve` is what finds the hidden controls; `x` are multiples of the plain lattice in
the same row. For one core: `taskset -c 1` before the command.
"""

import multiprocessing
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import table
from table import median

SIZES = (10_000, 185_000, 1_000_000, 10_000_000)
CURVED = 1_000_000
"""Largest surface whose volume is kept."""

COLUMNS = (
    "vertices", "conditions", "build", "lattice", "deform", "x", "solve", "steps", "VJP lattice",
    "VJP", "VJP x", "miss",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], SIZES)
    table.show(COLUMNS, rows(given.sizes), given.markdown)


def rows(sizes: list[int]) -> Iterator[table.Row]:
    """Each in a process of its own."""
    context = multiprocessing.get_context("spawn")
    for keeps_volume in (False, True):
        for size in sizes:
            if keeps_volume and size > CURVED:
                continue
            with context.Pool(1) as pool:
                yield pool.apply(measured, (size, keeps_volume))


def measured(size: int, keeps_volume: bool) -> table.Row:
    """One row."""
    import jax

    import moldline as ml

    surface = shell(size)
    lattice = ml.Lattice.around(surface, (12, 5, 4), margin=0.05)
    spots = np.random.default_rng(0).choice(len(surface.points), 20, replace=False)
    held = {f"p{n}": ml.measures.Position(ml.Spot.vertex(n), "z") for n in spots}
    kept = {"volume": ml.measures.Volume(surface.faces)} if keeps_volume else {}
    start = time.perf_counter()
    pilots = ml.Pilots(surface, held, kept, lattice)
    build = time.perf_counter() - start
    rng = np.random.default_rng(1)
    change, vectors = 0.02 * rng.normal(size=pilots.size), rng.normal(size=surface.points.shape)
    controls = np.asarray(pilots.pose(change))
    plain, bound = lattice.bind(surface.points), pilots.bind(surface.points)
    solver = jax.jit(lambda x: pilots.pose(x))
    report = pilots.report(change)
    times: dict[str, Any] = {}
    for name, binding, at in (("", bound, change), (" lattice", plain, controls)):
        pull = jax.jit(lambda x, w, b=binding: jax.vjp(b, x)[1](w)[0])
        times["deform" + name] = median(lambda b=binding, x=at: b(x).block_until_ready())
        times["VJP" + name] = median(lambda p=pull, x=at: p(x, vectors).block_until_ready())
    return {
        "vertices": len(surface.points),
        "conditions": "20 + volume" if keeps_volume else "20",
        "build": build,
        "lattice": times["deform lattice"],
        "deform": times["deform"],
        "x": times["deform"] / times["deform lattice"],
        "solve": median(lambda: solver(change).block_until_ready()),
        "steps": report.iterations,
        "VJP lattice": times["VJP lattice"],
        "VJP": times["VJP"],
        "VJP x": times["VJP"] / times["VJP lattice"],
        "miss": max(float(np.abs(miss).max()) for miss in report.misses.values()),
    }


def shell(size: int) -> Any:
    """A closed wing-like ellipsoid of about so many vertices: a grid of rings, poles joined."""
    import moldline as ml

    around = max(8, int(np.sqrt(2 * size)))
    rings = max(4, size // around)
    angle = 2 * np.pi * np.arange(around) / around
    along = np.pi * np.arange(1, rings + 1) / (rings + 1)
    x = np.sin(along)[:, None] * np.cos(angle)
    y = np.broadcast_to(-np.cos(along)[:, None], x.shape)
    z = 0.12 * np.sin(along)[:, None] * np.sin(angle)
    body = np.stack([x, 3 * y, z], axis=-1).reshape(-1, 3)
    points = np.concatenate([body, [[0.0, -3.0, 0.0], [0.0, 3.0, 0.0]]])
    n, next_ = np.arange(around), (np.arange(around) + 1) % around
    first = around * np.arange(rings - 1)[:, None]
    a, b, c, d = first + n, first + next_, first + around + n, first + around + next_
    low, high, last = len(body), len(body) + 1, around * (rings - 1)
    faces = [
        np.stack([a, c, b], axis=-1).reshape(-1, 3),
        np.stack([b, c, d], axis=-1).reshape(-1, 3),
        np.stack([np.full(around, low), n, next_], axis=-1),
        np.stack([np.full(around, high), last + next_, last + n], axis=-1),
    ]
    return ml.Surface(points, np.concatenate(faces))


if __name__ == "__main__":
    main()
