"""Time to embed points in a control volume and to deform them, beside a plain lattice.

usage: python benchmarks/embedding.py [--markdown] [--sizes 1300 48000 ...]

A box of 10 x 10 x 10 control points, once straight and once bent, around points spread evenly in
it. `deform/lattice` compares with a lattice of the same counts on the same points, in the same run.
pyGeo's times are those of version 1.17 on one core of such a machine, measured once, straight box.
"""

import time

import numpy as np
import table
from table import median

import moldline as ml
from moldline.deformers.volume_frame import Box

SIZES = (1_300, 6_000, 48_000, 185_000, 1_000_000)
PYGEO = {1_300: 0.48, 6_000: 2.5, 48_000: 19.5, 185_000: 80.0, 1_000_000: 426.0}
"""pyGeo 1.17's embedding [s]."""

COLUMNS = (
    "points", "box", "embed [s]", "steps", "residual", "pyGeo [s]", "pyGeo/embed", "deform",
    "VJP", "deform/lattice", "VJP/lattice",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], SIZES)
    rows = (measured(size, is_bent) for is_bent in (False, True) for size in given.sizes)
    table.show(COLUMNS, rows, given.markdown)


def box(is_bent: bool) -> np.ndarray:
    """Control points (10, 10, 10, 3)."""
    x, y, z = np.meshgrid(*[np.linspace(0, 1, 10)] * 3, indexing="ij")
    if not is_bent:
        return np.stack([x, y, z], axis=-1)
    chord = 3 - 2 * z
    return np.stack([2 * z + chord * x, chord * 0.2 * (y - 0.5) + 0.3 * z**2, 8 * z], axis=-1)


def measured(size: int, is_bent: bool) -> table.Row:
    """One row."""
    import jax

    volume = ml.ControlVolume([Box.of("1", box(is_bent))])
    rng = np.random.default_rng(0)
    points = volume.frame.volumes[0].at(rng.uniform(0, 1, (size, 3)))
    volume.embedded(points[:100])  # compiled
    start = time.perf_counter()
    found = volume.embedded(points)
    embed = time.perf_counter() - start
    lattice = ml.Lattice.around(points, (10, 10, 10), outside="extend")
    controls, vectors = 0.01 * rng.normal(size=volume.size), rng.normal(size=points.shape)
    bindings = volume.bind(points), lattice.bind(points)
    pulls = [jax.vjp(binding, controls)[1] for binding in bindings]
    deform, plain = (median(lambda b=b: b(controls)) for b in bindings)
    pull, plain_pull = (median(lambda p=p: p(vectors)) for p in pulls)
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    return {
        "points": size, "box": "bent" if is_bent else "straight", "embed [s]": embed,
        "steps": float(found.steps.mean()), "residual": f"{found.miss.max() / extent:.0e}",
        "pyGeo [s]": PYGEO.get(size), "pyGeo/embed": PYGEO[size] / embed if size in PYGEO else None,
        "deform": deform, "VJP": pull, "deform/lattice": deform / plain,
        "VJP/lattice": pull / plain_pull,
    }  # fmt: skip


if __name__ == "__main__":
    main()
