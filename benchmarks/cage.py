"""Time to embed points in a cage and to deform them, beside reading the weights once.

usage: python benchmarks/cage.py [--markdown] [--sizes 1300 48000 ...]

A box of 1 x 0.6 x 0.1 with 26 points around a closed smooth surface. Each row runs in a process of
its own. `solve` and `embed` are seconds, the cage's coordinates once and then the points' weights;
other times are medians in milliseconds, and `x` are multiples of `stream`, the sum of all weights
(`numpy.sum`) in the same row. `single` is the same with weights in single precision, `single x` in
multiples of their own stream; `differs` is how far it moves a point elsewhere, in the largest
displacement of a vertex. Blender's Mesh Deform, at its default precision, is timed in the same run
where `make blender` has made its environment. For one core: `taskset -c 1` before the command.
"""

import multiprocessing
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import table
from blender_process import PYTHON, Blender, cage_scene
from deform import BLENDER_MOST, SIZES, surface_points
from table import median

PAPER = {
    1_300: (1.20, 1.7), 6_000: (1.24, 2.0), 48_000: (2.17, 2.4), 127_000: (6.20, 3.0),
    185_000: (6.55, 2.9),
}  # fmt: skip
"""The paper's Table 1, 26-point cage on a Core 2 Duo laptop: embedding [s], deformation [ms]."""

PRECISION = 5
"""Blender's default: a cubic grid of 34 cells."""

COLUMNS = (
    "vertices", "coordinates", "solve", "embed", "stream", "deform", "x", "JVP", "VJP", "VJP x",
    "single", "single x", "single JVP", "single VJP", "differs", "Blender bind", "Blender",
    "Blender/deform", "Blender/single", "its cores", "off by", "paper embed", "paper",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], SIZES)
    table.show(COLUMNS, rows(given.sizes), given.markdown)


def rows(sizes: list[int]) -> Iterator[table.Row]:
    """Each in a process of its own."""
    context = multiprocessing.get_context("spawn")
    for coordinates in ("harmonic", "mean value"):
        for size in sizes:
            with context.Pool(1) as pool:
                yield pool.apply(measured, (size, coordinates))


def measured(size: int, coordinates: str) -> table.Row:
    """One row."""
    import jax

    import moldline as ml

    warm = ml.Cage(*box(), coordinates=coordinates)
    _derivatives(warm.bind(points_inside(400)), points_inside(400))
    points = points_inside(size)
    cage = ml.Cage(*box(), coordinates=coordinates)
    start = time.perf_counter()
    cage.solved  # noqa: B018  (solved for when first asked)
    solve = time.perf_counter() - start
    binding = cage.bind(points)
    embed = time.perf_counter() - start - solve
    rng = np.random.default_rng(0)
    controls, vectors = 0.01 * rng.normal(size=cage.size), rng.normal(size=points.shape)
    push, pull = jax.linearize(binding, controls)[1], jax.vjp(binding, controls)[1]
    stream = median(binding.embedding.blocks.sum)
    row: dict[str, Any] = {
        "vertices": len(points), "coordinates": coordinates, "solve": solve, "embed": embed,
        "stream": stream, "deform": median(lambda: binding(controls)),
        "JVP": median(lambda: push(controls)), "VJP": median(lambda: pull(vectors)),
    }  # fmt: skip
    row |= {"x": row["deform"] / stream, "VJP x": row["VJP"] / stream}
    moved = np.asarray(binding(controls))
    del binding, push, pull
    row |= _single(points, coordinates, controls, moved)
    if coordinates == "harmonic":
        if size <= BLENDER_MOST:
            theirs = blender(points, cage, controls, PRECISION)
            row |= _compared(theirs, controls, moved, row)
        if size in PAPER:
            row["paper embed"], row["paper"] = PAPER[size]
    return row


def _single(points: np.ndarray, coordinates: str, controls: np.ndarray, known: Any) -> table.Row:
    """The same with weights in single precision, and the largest difference it makes."""
    import jax

    import moldline as ml

    binding = ml.Cage(*box(), coordinates=coordinates, precision="single").bind(points)
    push, pull = jax.linearize(binding, controls)[1], jax.vjp(binding, controls)[1]
    deform = median(lambda: binding(controls))
    off = np.linalg.norm(np.asarray(binding(controls)) - known, axis=1).max()
    return {
        "single": deform, "single x": deform / median(binding.embedding.blocks.sum),
        "single JVP": median(lambda: push(controls)),
        "single VJP": median(lambda: pull(known)),
        "differs": float(off / np.linalg.norm(controls.reshape(-1, 3), axis=1).max()),
    }  # fmt: skip


def box() -> tuple[np.ndarray, np.ndarray]:
    """26 points and 48 triangles."""
    corners = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points = corners[np.abs(corners).max(axis=1) == 1]
    faces = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            plane = np.flatnonzero(points[:, axis] == side)
            rest = points[plane][:, [(axis + 1) % 3, (axis + 2) % 3]]
            grid = plane[np.lexsort(rest.T)].reshape(3, 3)[:: int(side)]
            a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
            quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
            faces += [quads[:, :3], quads[:, [0, 2, 3]]]
    return points * [0.5, 0.3, 0.05], np.concatenate(faces)


def points_inside(size: int) -> np.ndarray:
    """A smooth closed surface, at least a tenth of the half-widths away from the box."""
    return surface_points(size) * [0.45, 0.09, 0.15]


def blender(points: np.ndarray, cage: Any, controls: np.ndarray, precision: int) -> Any:
    """What Blender makes of the same and how long it takes; None where it is not there."""
    if not PYTHON.exists():
        return None
    try:
        with Blender() as process:
            told = process.open(**cage_scene(points, cage, controls, precision))
            return process.deform(repeats=30) | {"bind": told["bind"]}
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return None


def _compared(found: Any, controls: np.ndarray, ours: np.ndarray, row: Any) -> table.Row:
    """Blender's times, and how far its points are from ours, in the largest motion."""
    if found is None:
        return {}
    wall = float(np.median(found["seconds"]))
    return {
        "Blender bind": float(found["bind"]), "Blender": 1e3 * wall,
        "Blender/deform": 1e3 * wall / row["deform"],
        "Blender/single": 1e3 * wall / row["single"],
        "its cores": float(np.median(found["processor_seconds"])) / wall,
        "off by": float(np.abs(found["deformed"] - ours).max() / np.abs(controls).max()),
    }  # fmt: skip


def _derivatives(binding: Any, vectors: np.ndarray) -> None:
    """Compile what is timed later."""
    import jax

    controls = np.zeros(binding.net.size)
    jax.linearize(binding, controls)[1](controls)
    jax.vjp(binding, controls)[1](vectors)


if __name__ == "__main__":
    main()
