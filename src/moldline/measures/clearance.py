"""How near a shape comes to another one."""

from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Array, Faces, Points, Vector
from ..mesh import Geometry
from ..mesh.io import read
from ..numerics.closest import Tree, closest, nearest, tree
from ..numerics.winding import winding
from .base import AbstractMeasure, as_rows
from .features import offset, ordered
from .needs import faces_of


class Pair(NamedTuple):
    """The closest triangles of the two surfaces.

    Attributes
    ----------
    rows, other_rows
        Their corners; those that bear the closest point come first.
    kinds
        How many bear it, of each.
    sign
        1 where the surfaces are apart, -1 where one's point is within the other, 0 where they meet.
    """

    rows: Int[Array, "1 3"]
    other_rows: Int[Array, "1 3"]
    kinds: Int[Array, "2"]
    sign: Float[Array, ""]


class Clearance(AbstractMeasure):
    """Smallest distance of faces from those of a shape that stays where it is [m].

    Exact between faces and between edges. Where the surfaces run through each other it is less by
    the depth of the deepest point that one has within the other, as far as that is closed: not
    above zero. It has no derivative where two pairs of places are as close; where the surfaces meet
    and no point of either is within the other, it is zero and so is its derivative.

    Attributes
    ----------
    other, other_corners
        The shape that stays.
    """

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]
    other: Float[np.ndarray, "p 3"]
    other_corners: Int[np.ndarray, "t 3"]
    boxes: Tree

    def __init__(
        self, faces: Faces, other_points: Float[Array, "p 3"], other_faces: Int[Array, "t 3"]
    ):
        self.reads, self.corners = as_rows(np.asarray(faces))
        self.other = np.asarray(other_points, float)
        self.other_corners = np.asarray(other_faces)
        self.boxes = tree(self.other, self.other_corners)

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        other: Path,
        units: str | None = None,
        component: str | None = None,
        other_component: str | None = None,
    ) -> "Clearance":
        """Of a surface, or of one component, from the surface in a file."""
        faces = faces_of(geometry, component, "a clearance")
        there = read(other, units=units)
        return cls(faces, there.points, faces_of(there, other_component, "a clearance"))

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        kinds = [(1, 3), (1, 3), (2,), ()]
        shapes = [jax.ShapeDtypeStruct(shape, np.int32) for shape in kinds[:3]]
        shapes.append(jax.ShapeDtypeStruct((), np.float64))

        def search(now: Array) -> list[np.ndarray]:
            return self._closest(np.asarray(now))

        still = jax.lax.stop_gradient(places)
        pair = Pair(*jax.pure_callback(search, shapes, still, vmap_method="sequential"))
        one, other = places[pair.rows], jnp.asarray(self.other)[pair.other_rows]
        mine, its = pair.kinds
        ahead = jnp.ones(1)
        from_point = jnp.abs(offset(one[:, 0], other, its[None], ahead))
        from_other = jnp.abs(offset(other[:, 0], one, mine[None], ahead))
        apart = jnp.where(
            mine == 1, from_point, jnp.where(its == 1, from_other, _lines(one, other))
        )
        return jnp.where(pair.sign == 0, 0.0, pair.sign * apart)

    def _closest(self, places: Float[np.ndarray, "r 3"]) -> list[np.ndarray]:
        found = closest(places, self.corners, self.boxes)
        if found.distance > 0:
            return self._pair(found.faces, found.weights, 1.0)
        own = tree(places, self.corners)
        mine = _deepest(places, self.boxes, self.other, self.other_corners)
        its = _deepest(self.other, own, places, self.corners)
        depth, number, face, weights = max(mine, its, key=lambda deep: deep[0])
        if depth <= 0:
            return self._pair(found.faces, found.weights, 0.0)
        if mine[0] >= its[0]:
            row, corner = np.argwhere(self.corners == number)[0]
            return self._pair((int(row), face), np.stack([np.eye(3)[corner], weights]), -1.0)
        row, corner = np.argwhere(self.other_corners == number)[0]
        return self._pair((face, int(row)), np.stack([weights, np.eye(3)[corner]]), -1.0)

    def _pair(
        self, faces: tuple[int, int], weights: Float[np.ndarray, "2 3"], sign: float
    ) -> list[np.ndarray]:
        rows, mine = ordered(self.corners[faces[0]][None], weights[:1])
        other_rows, its = ordered(self.other_corners[faces[1]][None], weights[1:])
        kinds = np.concatenate([mine, its])
        whole = [array.astype(np.int32) for array in (rows, other_rows, kinds)]
        return [*whole, np.asarray(sign)]


def _deepest(
    points: np.ndarray, boxes: Tree, corners: np.ndarray, faces: np.ndarray
) -> tuple[float, int, int, np.ndarray]:
    """How deep the deepest point is within a surface, its number, and the nearest place there."""
    used = corners[faces].reshape(-1, 3)
    is_near = np.all((used.min(axis=0) <= points) & (points <= used.max(axis=0)), axis=1)
    near = np.flatnonzero(is_near)
    near = near[np.abs(winding(points[near], corners, faces)) > 0.75]  # 1/2 is on a face
    if not len(near):
        return 0.0, 0, 0, np.eye(3)[0]
    found = nearest(points[near], boxes)
    deep = int(found.distances.argmax())
    weights = found.weights[deep]
    return float(found.distances[deep]), int(near[deep]), int(found.faces[deep]), weights


def _lines(one: Float[Array, "1 3 3"], other: Float[Array, "1 3 3"]) -> Float[Array, "1"]:
    """Distance of the lines through the first two corners of each."""
    normal = jnp.cross(one[:, 1] - one[:, 0], other[:, 1] - other[:, 0])
    square = jnp.sum(normal**2, axis=1)
    between = jnp.sum(normal * (other[:, 0] - one[:, 0]), axis=1)
    return jnp.abs(between) / jnp.sqrt(jnp.where(square > 0, square, 1.0))
