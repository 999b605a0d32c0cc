"""The wetted surface of given components, which follows them as they move."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Array, Vector, is_concrete
from ..errors import GeometryError
from ..mesh import Surface
from .base import AbstractMaking
from .formulas import edge_through_triangle, three_planes
from .provenance import Provenance
from .sources import INSIDE
from .wetted_report import WettedReport
from .wetted_state import WettedState

GONE = (
    "the parts no longer cross where they did: make the pipeline anew at these values with "
    "pipeline.at(values), or bind the union again to the moved parts"
)


class Recipe(NamedTuple):
    """What the points of a wetted surface are made of.

    Attributes
    ----------
    kept
        Of each component, the points that are the wetted surface's first ones, ascending.
    corners
        Of each component, the points that the others are made of; these are numbered through.
    edges
        The two ends of an edge and the three corners of the triangle that it runs through.
    triples
        The nine corners of three triangles of three components.
    walls
        What the corners behind the components' follow, beyond the symmetry plane.
    offset
        By how much they are displaced [m].
    """

    kept: tuple[Int[Array, "_"], ...]
    corners: tuple[Int[Array, "_"], ...]
    edges: Int[Array, "e 5"]
    triples: Int[Array, "t 9"]
    walls: Int[Array, "w"]
    offset: Float[Array, "3"]


class Wetting(AbstractMaking):
    """A union tied to its components: what each of its points is made of.

    Attributes
    ----------
    geometry
        The wetted surface of the components as they were given.
    report
        What was made, in figures and sentences.
    recipe
        What its points are made of.
    state
        What tells whether moved components still cross in the same way.
    """

    geometry: Surface
    report: WettedReport = eqx.field(static=True)
    recipe: Recipe
    state: WettedState = eqx.field(static=True)

    @override
    def __call__(self, parameters: Vector, *points: Array) -> Array:
        """Points of the wetted surface for moved components that cross as they did.

        What is kept follows its point, the others the edge and the triangle, or the three
        triangles, that they lie on. Where these no longer meet this is told.
        """
        places, is_right = followed(self.recipe, points)
        if is_concrete(is_right):
            if not bool(is_right):
                raise GeometryError(GONE)
            return places
        return eqx.error_if(places, ~is_right, GONE)

    @override
    def holds(self, *points: Array) -> bool:
        """Whether exactly the same edges run through the same faces, in the same order."""
        _, is_right = followed(self.recipe, points)
        return bool(is_right) and self.state.holds(points)


def recipe(points: tuple[Array, ...], made: Provenance, offset: np.ndarray) -> Recipe:
    """The same as `made`, with numbers of points in each component instead of through all."""
    first = np.cumsum([0, *(len(p) for p in points)])
    count = int(first[-1])
    nodes = np.concatenate([made.edges.ravel(), made.triples.ravel(), made.walls])
    used = np.unique(nodes[nodes < count])
    place = np.empty(count + len(made.walls), np.int64)
    place[used] = np.arange(len(used))
    place[count:] = len(used) + np.arange(len(made.walls))
    return Recipe(
        _parted(made.kept, first),
        _parted(used, first),
        _numbers(place[made.edges]),
        _numbers(place[made.triples]),
        _numbers(place[made.walls]),
        jnp.asarray(offset),
    )


def _parted(numbers: np.ndarray, first: np.ndarray) -> tuple[Array, ...]:
    """Ascending numbers, of each component its own, counted from its first."""
    parts = np.split(numbers, np.searchsorted(numbers, first[1:-1]))
    return tuple(_numbers(part - at) for part, at in zip(parts, first, strict=False))


def _numbers(array: np.ndarray) -> Array:
    return jnp.asarray(array, np.int32)


@jax.jit
def followed(recipe: Recipe, points: tuple[Array, ...]) -> tuple[Array, Array]:
    """Places of all points, and whether the edges still run through their triangles."""
    kept, corners, edges, triples, walls, offset = recipe
    nodes = jnp.concatenate([p[c] for p, c in zip(points, corners, strict=True)])
    nodes = jnp.concatenate([nodes, nodes[walls] + offset])
    on_edges, shares = edge_through_triangle(nodes[edges])
    on_triples, others = three_planes(nodes[triples])
    every = jnp.concatenate([shares.ravel(), others.ravel()])
    is_right = jnp.all(jax.lax.stop_gradient(every) >= -INSIDE)  # not so where one is no number
    places = [p[k] for p, k in zip(points, kept, strict=True)]
    return jnp.concatenate([*places, on_edges, on_triples]), is_right
