"""Time to unite a wing and a fuselage, and to follow them, beside a stream over the same bytes.

usage: python benchmarks/union.py [--markdown] [--sizes 14000 142000 ...]

A wing through a fuselage, the wing with 3/5 of the vertices: 86 k and 56 k of 142000. `union` is
all that binding takes [s]: in it `checks` of both components, the `boolean` with the tracing of its
points, and the search for crossings, and the report. Other times are medians in milliseconds,
compiled: `call` gives all points for moved components, `JVP` and `VJP` are products with the
Jacobian, `holds` searches all crossings anew. `x` are multiples of a stream, a copy that reads and
writes as many bytes as points go in and out. `miss` is how far the derivatives of volume and area
are from differences of unions made anew, relatively. For one core: `taskset -c 1` before the
command.
"""

import multiprocessing
from collections.abc import Iterator
from typing import Any

import numpy as np
import table
from table import best, median

SIZES = (14_000, 142_000, 1_000_000)

COLUMNS = (
    "vertices", "on curve", "union", "checks", "boolean", "stream", "call", "call x", "holds",
    "JVP", "JVP x", "VJP", "VJP x", "volume miss", "area miss",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    given = table.arguments(__doc__.splitlines()[0], SIZES)
    table.show(COLUMNS, rows(given.sizes), given.markdown)


def rows(sizes: list[int]) -> Iterator[table.Row]:
    """Each in a process of its own."""
    context = multiprocessing.get_context("spawn")
    for size in sizes:
        with context.Pool(1) as pool:
            yield pool.apply(measured, (size,))


def measured(size: int) -> table.Row:
    """One row."""
    import jax
    import jax.numpy as jnp

    from moldline.modelers.provenance import joined
    from moldline.modelers.solids import check, solid
    from moldline.modelers.union import Union

    parts = wing(0.6 * size), fuselage(0.4 * size)
    union = Union()
    union.bind(wing(2000), fuselage(2000))  # compiles
    solids = [solid(p, "part", None, 0.0) for p in parts]
    made = union.bind(*parts)
    points = tuple(jnp.asarray(p.points) for p in parts)
    lift = tuple(jnp.asarray(d) for d in motion(parts))
    weights = jnp.asarray(np.random.default_rng(0).normal(size=made.geometry.points.shape))
    call = jax.jit(lambda *p: made(np.zeros(0), *p))
    push = jax.jit(lambda p, d: jax.jvp(call, p, d)[1])
    pull = jax.jit(lambda p, w: jax.vjp(call, *p)[1](w))
    stream = streamed(sum(p.nbytes for p in points) + weights.nbytes)
    times: dict[str, Any] = {
        "call": median(lambda: call(*points).block_until_ready()),
        "JVP": median(lambda: push(points, lift).block_until_ready()),
        "VJP": median(lambda: pull(points, weights)[0].block_until_ready()),
    }
    return {
        "vertices": sum(len(p) for p in points),
        "on curve": made.report.on_edges,
        "union": best(lambda: union.bind(*parts)),
        "checks": best(lambda: [check(s, None, True) for s in solids]),
        "boolean": best(lambda: joined(solids)),
        "stream": stream,
        "holds": median(lambda: made.holds(*points)),
        **times,
        **{f"{name} x": value / stream for name, value in times.items()},
        **misses(parts, made, push(points, lift)),
    }


def misses(parts: Any, made: Any, change: Any) -> table.Row:
    """Derivatives of volume and area along a motion, against differences of new unions."""
    import jax
    import jax.numpy as jnp

    from moldline.modelers.union import Union

    faces, h = made.geometry.faces, 1e-5
    along = motion(parts)
    up, down = (
        Union(crossings="allow")
        .bind(*(p.moved(p.points + s * d) for p, d in zip(parts, along, strict=True)))
        .report
        for s in (h, -h)
    )

    def measures(p: Any) -> Any:
        a, b, c = (p[faces[:, k]] for k in range(3))
        area = jnp.linalg.norm(jnp.cross(b - a, c - a), axis=1).sum() / 2
        return jnp.stack([jnp.sum(a * jnp.cross(b, c)) / 6, area])

    slopes = jax.jvp(measures, (jnp.asarray(made.geometry.points),), (change,))[1]
    names = ("volume", "area")
    differences = [(getattr(up, n) - getattr(down, n)) / (2 * h) for n in names]
    return {
        f"{name} miss": abs(float(slope) / difference - 1)
        for name, slope, difference in zip(names, slopes, differences, strict=True)
    }


def streamed(count: int) -> float:
    """Time to read and write so many bytes in all [ms]."""
    one, other = np.ones(count // 16), np.empty(count // 16)
    return median(lambda: np.copyto(other, one))


def motion(parts: Any) -> list[np.ndarray]:
    """The wing goes up and twists, the fuselage gets thicker [per unit]."""
    w, f = (np.asarray(p.points) for p in parts)
    up = np.stack([0.3 * w[:, 2], 0 * w[:, 0], 1 + 0.2 * w[:, 1] - 0.3 * w[:, 0]], axis=1)
    return [up, f * [0.0, 1.0, 1.0]]


def wing(size: float) -> Any:
    """A swept, tapered wing through rings of points, about so many vertices."""
    around = 2 * int(np.sqrt(size * 0.46))
    span = 6.0 * np.linspace(0, 1, int(size / around))
    angle = 2 * np.pi * np.arange(around) / around
    chord = 2.0 - 0.2 * span
    rings = np.empty((len(span), around, 3))
    rings[..., 0] = 4.5 + 0.47 * span[:, None] + 0.5 * chord[:, None] * np.cos(angle)
    rings[..., 1] = span[:, None]
    thickness = 0.06 * np.sin(angle) * (1.0 + 0.5 * np.cos(angle + np.pi))
    rings[..., 2] = 0.1 + 0.09 * span[:, None] + chord[:, None] * thickness
    return skinned(rings, rings[[0, -1]].mean(axis=1))


def fuselage(size: float) -> Any:
    """A body of revolution, about so many vertices."""
    around = int(np.sqrt(size * 0.46))
    x = 6.0 * (1 - np.cos(np.linspace(0, np.pi, int(size / around) + 2)))[1:-1]
    radius = 0.8 * np.sqrt(4 * x / 12 * (1 - x / 12))
    angle = 2 * np.pi * np.arange(around) / around + 0.013
    rings = np.empty((len(x), around, 3))
    rings[..., 0] = x[:, None]
    rings[..., 1] = radius[:, None] * np.sin(angle)
    rings[..., 2] = radius[:, None] * np.cos(angle)
    return skinned(rings, np.array([[0.0, 0, 0], [12.0, 0, 0]]))


def skinned(rings: np.ndarray, ends: np.ndarray) -> Any:
    """The closed surface through rings of points (s, k, 3), with a point at each end."""
    import moldline as ml

    count, around = rings.shape[:2]
    number = np.arange(count * around).reshape(count, around)
    beside = np.roll(number, -1, axis=1)
    a, b, c, d = (n.ravel() for n in (number[:-1], number[1:], beside[1:], beside[:-1]))
    first, last = np.full(around, count * around), np.full(around, count * around + 1)
    faces = np.concatenate(
        [
            np.stack([a, c, b], axis=1),
            np.stack([a, d, c], axis=1),
            np.stack([first, beside[0], number[0]], axis=1),
            np.stack([last, number[-1], beside[-1]], axis=1),
        ]
    )
    points = np.concatenate([rings.reshape(-1, 3), ends])
    corners = points[faces] - points.mean(axis=0)
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return ml.Surface(points, faces if volume > 0 else faces[:, ::-1])


if __name__ == "__main__":
    main()
