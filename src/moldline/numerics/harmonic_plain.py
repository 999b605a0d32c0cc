"""Look-up of harmonic weights in plain JAX: the definition that the compiled loops are equal to."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array
from . import harmonic_loops as loops

ROOM = 3_000_000
"""Numbers that a batch of points may hold at a time."""


SLIVERS = 64
"""Points in slivers that are looked at together."""

State = tuple[Any, Any, Any]


class Tables(NamedTuple):
    """The solution on its grid; places are in cells.

    `site` numbers the nodes and is -1 where there is none, `sites` are their places, the first
    `inside` of them being the nodes themselves, the others on the cage; `values` are their
    weights. `corners` and `faces` are the cage.
    """

    origin: Any
    spacing: Any
    site: Any
    sites: Any
    inside: Any
    values: Any
    corners: Any
    faces: Any


@jax.jit
def looked_up(
    tables: Tables, points: Float[Array, "n 3"], of: Float[Array, "m c"] | None = None
) -> Float[Array, "n c"]:
    """Weights of the cage's corners at points, in batches that bound the memory.

    With `of`, what belongs to each corner, the sums of these by the weights instead, in less time.
    """
    if of is not None:
        tables = tables._replace(values=tables.values @ of)
    count, columns = len(points), tables.values.shape[1]
    if count == 0:
        return jnp.zeros((0, columns))
    size = max(27 * columns, 27 * len(tables.faces))
    batch = max(1, min(count, ROOM // size))
    batches = -(-count // batch)
    places = (points - tables.origin) / tables.spacing
    filled = jnp.pad(places, ((0, batches * batch - count), (0, 0)), mode="edge")
    # what a derivative needs of a batch is computed again, not kept
    run = jax.checkpoint(lambda u: _batch(tables, u, of))
    found = jax.lax.map(run, filled.reshape(batches, batch, 3))
    return found.reshape(-1, columns)[:count]


def _batch(tables: Tables, u: Float[Array, "b 3"], of: Array | None) -> Float[Array, "b c"]:
    """Weights at some places, in cells."""
    rows, prior, known = _around(tables, u)
    off = tables.sites[rows] - u[:, None, :]
    still = jax.lax.stop_gradient((prior, jnp.where(known[:, None, None], off, 0.0)))
    tilt, miss = _tilted(*still)
    met = known & (miss <= loops.ENOUGH)
    # where it did not converge, numbers that harm no derivative
    off = jnp.where(met[:, None, None], off, 0.0)
    prior = jnp.where(met[:, None], prior, 1 / 27)
    tilt = jnp.where(met[:, None], tilt, 0.0)
    mean, spread = _moments(prior, off, tilt)[1:]
    spread = jax.lax.stop_gradient(jnp.where(met[:, None, None], spread, jnp.eye(3)))
    # one more step, of which the derivative is that of the solution
    share = _moments(prior, off, tilt - _solved(spread, mean))[0]
    weights = jnp.einsum("bk,bkm->bm", share, tables.values[rows])

    def mended() -> Array:
        found = _between(tables, u)
        return jnp.where(met[:, None], weights, found if of is None else found @ of)

    return jax.lax.cond(jnp.all(met), lambda: weights, mended)


def _around(tables: Tables, u: Array) -> tuple[Array, Array, Array]:
    """The 27 sites around each place, their spline weights, and whether all of them exist."""
    shape = np.array(tables.site.shape)
    middle = jnp.floor(jax.lax.stop_gradient(u) + 0.5)
    first = jnp.clip(middle.astype(int) - 1, 0, shape - 3)
    t = u - middle
    basis = jnp.stack([0.5 * (0.5 - t) ** 2, 0.75 - t * t, 0.5 * (0.5 + t) ** 2], axis=-1)
    prior = jnp.einsum("bi,bj,bk->bijk", *jnp.moveaxis(basis, 1, 0)).reshape(-1, 27)
    steps = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), axis=-1).reshape(27, 3)
    rows = tables.site[tuple(jnp.moveaxis(first[:, None, :] + steps, -1, 0))]
    on_grid = jnp.all((u >= 1.0) & (u <= shape - 2.0), axis=1)
    return jnp.maximum(rows, 0), prior, on_grid & jnp.all(rows >= 0, axis=1)


def _moments(prior: Array, off: Array, tilt: Array) -> tuple[Array, Array, Array]:
    """Shares prior exp(tilt . off) / sum, the mean of `off` by them, and its covariance."""
    power = jnp.einsum("bkd,bd->bk", off, tilt)
    acts = prior > 0
    top = jnp.max(jnp.where(acts, power, -jnp.inf), axis=1, keepdims=True)
    raw = prior * jnp.exp(jnp.where(acts, power - jax.lax.stop_gradient(top), 0.0))
    share = raw / jnp.sum(raw, axis=1, keepdims=True)
    mean = jnp.einsum("bk,bkd->bd", share, off)
    second = jnp.einsum("bk,bkd,bke->bde", share, off, off)
    return share, mean, second - mean[:, :, None] * mean[:, None, :]


def _tilted(prior: Array, off: Array) -> tuple[Array, Array]:
    """The tilt that makes the mean of `off` zero, by damped Newton steps, and what is left."""

    def miss(mean: Array) -> Array:
        return jnp.max(jnp.abs(mean), axis=1)

    def go_on(state: State) -> jax.Array:
        step, _, left = state
        return (step < loops.STEPS) & jnp.any(left > loops.BALANCED)

    def improve(state: State) -> State:
        count, tilt, left = state
        _, mean, spread = _moments(prior, off, tilt)
        left = miss(mean)
        step = _solved(spread, mean)
        length = loops.SPREAD * jnp.linalg.norm(step, axis=1)
        decrement = jnp.sum(step * mean, axis=1)
        damped = jnp.where(decrement > loops.QUADRATIC, jnp.log1p(length) / length, 1.0)
        moved = tilt - damped[:, None] * step
        return count + 1, jnp.where(left[:, None] > loops.BALANCED, moved, tilt), left

    begin = (jnp.asarray(0), jnp.zeros_like(off[:, 0, :]), jnp.full(len(off), jnp.inf))
    _, tilt, left = jax.lax.while_loop(go_on, improve, begin)
    return tilt, left


def _solved(h: Float[Array, "b 3 3"], g: Float[Array, "b 3"]) -> Float[Array, "b 3"]:
    """Solve h x = g for symmetric positive matrices, as the compiled form does."""

    def root(value: Array) -> Array:
        return jnp.sqrt(jnp.maximum(value, loops.PIVOT))

    a = root(h[:, 0, 0])
    b, c = h[:, 0, 1] / a, h[:, 0, 2] / a
    d = root(h[:, 1, 1] - b * b)
    e = (h[:, 1, 2] - b * c) / d
    f = root(h[:, 2, 2] - c * c - e * e)
    u = g[:, 0] / a
    v = (g[:, 1] - b * u) / d
    z = (g[:, 2] - c * u - e * v) / f / f
    y = (v - e * z) / d
    return jnp.stack([(u - b * y - c * z) / a, y, z], axis=1)


def _between(tables: Tables, u: Float[Array, "b 3"]) -> Float[Array, "b m"]:
    """Weights from where the lines through a place along the axes meet the cage."""
    corners = jnp.asarray(tables.corners)[tables.faces]
    share, gap = _crossed(corners[None, None], jax.lax.stop_gradient(u)[:, None, None])
    meets, above = jnp.min(share, axis=-1) >= -loops.ENOUGH, gap > 0
    sides = jnp.stack([meets & ~above, meets & above], axis=2)
    away = jnp.where(sides, jnp.abs(gap)[:, :, None], jnp.inf)
    face, nearest = jnp.argmin(away, axis=3), jnp.min(away, axis=3)
    found = jnp.isfinite(nearest)
    counts = found & (found[..., ::-1] | (nearest <= loops.ENOUGH))
    share, gap = _crossed(corners[face], u[:, None, None])
    near = jnp.maximum(jnp.where(found, jnp.abs(gap), 1.0), 1e-14)
    scale = jnp.asarray(tables.spacing)[:, None] ** 2
    part = jnp.where(counts, 1 / (scale * near * near.sum(axis=2, keepdims=True)), 0.0)
    share = jnp.where(counts[..., None], share - jax.lax.stop_gradient(jnp.minimum(share, 0)), 0.0)
    values = (part[..., None] * share).reshape(len(u), -1)
    rows = jnp.arange(len(u))[:, None]
    empty = jnp.zeros((len(u), len(tables.corners)))
    columns = jnp.asarray(tables.faces)[face].reshape(len(u), -1)
    return empty.at[rows, columns].add(values) / part.sum(axis=(1, 2))[:, None]


def sliver_slopes(
    tables: Tables, points: Float[np.ndarray, "n 3"], of: Float[np.ndarray, "m c"]
) -> Float[np.ndarray, "n c 3"]:
    """Derivatives by the place where only the cage itself encloses a point."""
    places = (points - tables.origin) / tables.spacing
    found = [
        _sliver_slopes(tables, places[k : k + SLIVERS]) for k in range(0, len(places), SLIVERS)
    ]
    return np.einsum("dnm,mc->ncd", np.concatenate(found, axis=1), of) / tables.spacing


@jax.jit
def _sliver_slopes(tables: Tables, u: Float[Array, "b 3"]) -> Float[Array, "3 b m"]:
    def along(axis: Float[Array, "3"]) -> Array:
        return jax.jvp(lambda u: _between(tables, u), (u,), (jnp.broadcast_to(axis, u.shape),))[1]

    return jax.vmap(along)(jnp.eye(3))


def _crossed(corners: Array, u: Array) -> tuple[Array, Array]:
    """Where lines along x, y and z, the second axis of the arrays, meet triangles' planes.

    Barycentric weights of the corners, minus infinity where they do not, and how far above.
    """
    edges = corners - jnp.roll(corners, -1, axis=-2)
    size = jnp.sum(edges**2, axis=(-2, -1))[..., None]
    r = corners - u[..., None, :]
    a, b, c = (jnp.sum(r * np.roll(np.eye(3), k, axis=1)[:, None, None], axis=-1) for k in range(3))
    e = jnp.roll(b, -1, -1) * jnp.roll(c, -2, -1) - jnp.roll(c, -1, -1) * jnp.roll(b, -2, -1)
    total = e.sum(axis=-1, keepdims=True)
    is_met = jnp.abs(total) > loops.EDGE_ON * size
    share = jnp.where(is_met, e / jnp.where(is_met, total, 1.0), 0.0)
    return jnp.where(is_met, share, -jnp.inf), jnp.sum(share * a, axis=-1)
