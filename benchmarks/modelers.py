"""Time to make wings, bodies and nacelles, beside a copy of as many bytes.

usage: python benchmarks/modelers.py [--markdown] [--sizes 10000 100000 ...]

A wing of four stations with a round tip, a fuselage with super-ellipse sections, a nacelle. Each
row runs in a process of its own. In seconds: `make` is the object, `first` its triangulation with
points, both with what is compiled, `again` the same once more. Other times are medians in
milliseconds: `points` for other parameters, `JVP` and `VJP` of them. `x copy` are multiples of a
copy of the points. For one core: `taskset -c 1` before the command.
"""

import multiprocessing
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import table
from table import median

SIZES = (10_000, 100_000, 1_000_000)

COLUMNS = (
    "shape", "vertices", "parameters", "make", "first", "again", "points", "x copy", "JVP",
    "VJP", "copy",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], SIZES)
    table.show(COLUMNS, rows(given.sizes), given.markdown)


def rows(sizes: list[int]) -> Iterator[table.Row]:
    """Each in a process of its own."""
    context = multiprocessing.get_context("spawn")
    for shape in ("wing", "body", "nacelle"):
        for size in sizes:
            with context.Pool(1) as pool:
                yield pool.apply(measured, (shape, size))


def measured(name: str, size: int) -> table.Row:
    """One row."""
    import jax

    import moldline as ml

    getattr(ml, name.capitalize())  # imports it
    start = time.perf_counter()
    shape = shaped(ml, name, size)
    made = time.perf_counter()
    geometry = shape.geometry
    first = time.perf_counter()
    again = table.best(lambda: shape.geometry)
    making, own = shape.bind(), np.asarray(shape.values)
    rng = np.random.default_rng(0)
    along, back = 0.01 * rng.normal(size=own.shape), rng.normal(size=geometry.points.shape)
    push = jax.jit(lambda x, d: jax.jvp(making, (x,), (d,)))
    pull = jax.jit(lambda x, w: jax.vjp(making, x)[1](w)[0])
    copied = np.empty_like(back)
    times = {
        "points": median(lambda: making(own).block_until_ready()),
        "JVP": median(lambda: jax.block_until_ready(push(own, along))),
        "VJP": median(lambda: pull(own, back).block_until_ready()),
        "copy": median(lambda: np.copyto(copied, back)),
    }
    return {
        "shape": name,
        "vertices": len(geometry.points),
        "parameters": shape.size,
        "make": made - start,
        "first": first - made,
        "again": again,
        "x copy": times["points"] / times["copy"],
        **times,
    }


def shaped(ml: Any, name: str, size: int) -> Any:
    """A shape of about so many vertices."""
    side = int(np.sqrt(size / 2))
    if name == "wing":
        return ml.Wing(
            [10.9, 20.0, 29.4],
            [13.6, 7.3, 5.0, 2.7],
            sweep=[0.66, 0.65, 0.64],
            dihedral=0.1,
            twist=[0.1, 0.02, 0.0, -0.06],
            airfoil="naca 2412",
            section_parameters=True,
            chordwise=side,
            spanwise=int(0.9 * side),
        )
    if name == "body":
        return ml.Body(
            [6.0, 12.0, 40.0, 62.0],
            width=[0, 5.0, 6.0, 6.0, 0],
            height=[0, 4.8, 6.2, 6.2, 0],
            lift=[-0.8, -0.3, 0.0, 0.0, 1.8],
            exponent=[2.0, 2.1, 2.3, 2.2, 2.0],
            loft="cubic",
            along=2 * side,
            around=side // 2 * 2,
        )
    return ml.Nacelle(
        4.5, [1.6, 1.65, 1.55], 1.2, droop=0.05, airfoil="naca 2412", chordwise=side,
        around=side // 2 * 2, section_parameters=True,
    )  # fmt: skip


if __name__ == "__main__":
    main()
