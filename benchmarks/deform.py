"""Time of a lattice deformation and its derivatives, beside a copy of the same bytes.

usage: python benchmarks/deform.py [--markdown] [--sizes 1300 48000 ...]

Each row runs in a process of its own. Times are medians in milliseconds; `x` are multiples of the
copy (`numpy.copyto` of the coordinates into an array that is there already) of the same row.
Blender's lattice modifier is timed in the same run where `make blender` has made its environment.
"""

import multiprocessing
import resource
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import table
from blender_process import PYTHON, Blender, lattice_scene
from table import median

SIZES = (1_300, 6_000, 48_000, 127_000, 185_000, 1_000_000, 10_000_000)
BLENDER_MOST = 1_000_000
"""Blender's own copies of a larger mesh do not fit beside ours on a small machine."""
PAPER = {1_300: 2.0, 6_000: 9.0, 48_000: 73.0, 127_000: 191.0, 185_000: 289.0}
"""The paper's Table 1, 27-point lattice on a Core 2 Duo laptop [ms]; the 10x10x10 is not in it."""

COLUMNS = (
    "vertices", "lattice", "embed", "copy", "deform", "x", "JVP", "VJP", "VJP/deform",
    "follow", "follow/deform", "follow VJP", "bytes/vertex", "Blender", "Blender/deform",
    "its cores", "paper",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], SIZES)
    table.show(COLUMNS, rows(given.sizes), given.markdown)


def rows(sizes: list[int]) -> Iterator[table.Row]:
    """Each in a process of its own."""
    context = multiprocessing.get_context("spawn")
    for count in (3, 10):
        for size in sizes:
            with context.Pool(1) as pool:
                yield pool.apply(measured, (size, count))


def measured(size: int, count: int) -> table.Row:
    """One row."""
    import jax

    import moldline as ml

    _warm(count)
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    points = surface_points(size)
    lattice = ml.Lattice.around(points, (count,) * 3)
    rng = np.random.default_rng(0)
    controls = 0.01 * rng.normal(size=lattice.size)
    vectors = rng.normal(size=points.shape)
    target = np.empty_like(points)
    start = time.perf_counter()
    binding = lattice.bind(points)
    embed = 1e3 * (time.perf_counter() - start)
    copy = median(lambda: np.copyto(target, points))
    deform = median(lambda: binding(controls))
    push = jax.linearize(binding, controls)[1]
    pull = jax.vjp(binding, controls)[1]
    row: dict[str, Any] = {
        "vertices": len(points), "lattice": f"{count}x{count}x{count}", "embed": embed,
        "copy": copy, "deform": deform, "x": deform / copy,
        "JVP": median(lambda: push(controls)), "VJP": median(lambda: pull(vectors)),
    }  # fmt: skip
    row["VJP/deform"] = row["VJP"] / deform
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - base
    row["bytes/vertex"] = 1024 * peak / len(points)
    follow = median(lambda: lattice.follow(points, controls))
    follow_pull = jax.vjp(lattice.follow, points, controls)[1]
    row |= {"follow": follow, "follow/deform": follow / deform}
    row["follow VJP"] = median(lambda: follow_pull(vectors), 7)
    blender = blender_time(points, count) if size <= BLENDER_MOST else None
    if blender is not None:
        row |= {"Blender": blender[0], "Blender/deform": blender[0] / deform}
        row["its cores"] = blender[1]
    if count == 3 and size in PAPER:
        row["paper"] = PAPER[size]
    return row


def surface_points(size: int) -> np.ndarray:
    """Vertices of a closed smooth surface in the order in which a mesh has them."""
    rows = int(np.sqrt(size / 2))
    u, v = np.meshgrid(
        np.linspace(0, 2 * np.pi, 2 * rows, endpoint=False), np.linspace(0.01, np.pi - 0.01, rows)
    )
    xyz = np.cos(u) * np.sin(v), 3 * np.sin(u) * np.sin(v), 0.3 * np.cos(v)
    return np.stack(xyz, axis=-1).reshape(-1, 3)


def blender_time(points: np.ndarray, count: int) -> tuple[float, float] | None:
    """Median time of Blender's lattice modifier [ms] and the cores it took; None without it."""
    if not PYTHON.exists():
        return None
    import moldline as ml

    low, high = points.min(axis=0), points.max(axis=0)
    lattice = ml.Lattice.box(low, high, (count,) * 3, ends="blender", outside="extend")
    controls = 0.01 * np.random.default_rng(0).normal(size=lattice.size)
    try:
        with Blender() as blender:
            blender.open(**lattice_scene(points, lattice, controls))
            found = blender.deform(repeats=30)
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return None
    wall = float(np.median(found["seconds"]))
    return 1e3 * wall, float(np.median(found["processor_seconds"])) / wall


def _warm(count: int) -> None:
    """Compile everything on a few points, so that memory and time are the run's own."""
    import jax

    import moldline as ml

    points = surface_points(400)
    lattice = ml.Lattice.around(points, (count,) * 3)
    binding, controls = lattice.bind(points), np.zeros(lattice.size)
    jax.linearize(binding, controls)[1](controls)
    jax.vjp(binding, controls)[1](points)
    jax.vjp(lattice.follow, points, controls)[1](points)


if __name__ == "__main__":
    main()
