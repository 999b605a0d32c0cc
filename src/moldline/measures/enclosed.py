"""What must fit within a shape: a tank, a spar, a box."""

import itertools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Faces, Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry
from ..numerics.closest import nearest, tree
from .base import AbstractMeasure, as_rows
from .features import offset, ordered
from .needs import faces_of
from .picks import Point

Corners = Sequence[Sequence[float]] | Float[np.ndarray, "c 3"]


class Enclosed(AbstractMeasure):
    """Depth of points, fixed in space, below a surface whose faces look outwards [m].

    Distance from the nearest face, negative for a point outside: all not negative, and what the
    points stand for fits. It has no derivative where two faces are as near.

    Attributes
    ----------
    points
        What must fit.

    Notes
    -----
    Inside and outside are told by the normals of the faces that meet in the nearest point, weighted
    by their angles, so the surface may be open elsewhere: Baerentzen and Aanaes, Signed distance
    computation using the angle weighted pseudonormal, IEEE TVCG 11, 2005.
    """

    reads: np.ndarray
    corners: Int[np.ndarray, "m 3"]
    points: Float[np.ndarray, "k 3"]

    def __init__(self, faces: Faces, points: Corners):
        self.reads, self.corners = as_rows(np.asarray(faces))
        self.points = np.asarray(points, float)
        if self.points.ndim != 2 or self.points.shape[1] != 3 or not len(self.points):
            raise ParameterError(f"points that must fit are three coordinates each, got {points}")

    @classmethod
    def box(cls, faces: Faces, corners: Corners, samples: int = 9) -> "Enclosed":
        """A box, by two opposite corners, or by eight, in the order of x, then y, then z.

        With eight, as a swept tank between two spars has, corners follow each other as the counts
        000, 001, 010 .. 111 do. Its sides are sampled by so many points each way, for a side may
        stick out where its corners do not.
        """
        return cls(faces, box_points(corners, samples))

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        points: list[Point] | None = None,
        box: list[Point] | None = None,
        samples: int = 9,
        component: str | None = None,
    ) -> "Enclosed":
        """Points or a box, by two opposite corners or eight, within a surface or a component."""
        faces = faces_of(geometry, component, "what is enclosed")
        if (points is None) == (box is None):
            raise ParameterError("what is enclosed is said by points, or by a box")
        if points is not None:
            return cls(faces, points)
        return cls.box(faces, box or [], samples)

    @property
    @override
    def size(self) -> int:
        return len(self.points)

    @override
    def of(self, places: Points) -> Vector:
        count = len(self.points)
        rows, kinds, side = jax.pure_callback(
            lambda now: self._found(np.asarray(now)),
            (
                jax.ShapeDtypeStruct((count, 3), np.int32),
                jax.ShapeDtypeStruct((count,), np.int32),
                jax.ShapeDtypeStruct((count,), np.float64),
            ),
            jax.lax.stop_gradient(places),
            vmap_method="sequential",
        )
        return offset(jnp.asarray(self.points), places[rows], kinds, side)

    def _found(self, places: Float[np.ndarray, "r 3"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Corners of the nearest faces, how many of them bear the nearest point, and its side."""
        found = nearest(self.points, tree(places, self.corners))
        rows, kinds = ordered(self.corners[found.faces], found.weights)
        sides = np.ones(len(rows))
        for number in np.flatnonzero(kinds < 3).tolist():
            bearing = places[rows[number, : kinds[number]]]
            foot = found.weights[number] @ places[self.corners[found.faces[number]]]
            outward = pseudonormal(places, self.corners, bearing)
            sides[number] = 1.0 if outward @ (foot - self.points[number]) >= 0 else -1.0
        return rows.astype(np.int32), kinds.astype(np.int32), sides


def pseudonormal(
    places: Float[np.ndarray, "n 3"],
    corners: Int[np.ndarray, "m 3"],
    bearing: Float[np.ndarray, "b 3"],
) -> Float[np.ndarray, "3"]:
    """Normal of the faces that meet in a place or along an edge, weighted by their angles there.

    Points in one place count as one, for surfaces are not always welded.
    """
    close = 1e-9 * float(np.ptp(places, axis=0).max())
    meets = np.ones(len(corners), bool)
    for place in bearing:
        is_here = np.linalg.norm(places - place, axis=1) <= close
        meets &= is_here[corners].any(axis=1)
    faces = places[corners[meets]]
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals / np.where(lengths > 0, lengths, 1.0)[:, None]
    if len(bearing) > 1:
        return normals.sum(axis=0)
    gaps = np.linalg.norm(faces - bearing[0], axis=2)
    own = np.argmin(gaps, axis=1)
    one, other = (faces[np.arange(len(faces)), (own + k) % 3] - bearing[0] for k in (1, 2))
    angles = np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), np.sum(one * other, axis=1))
    return angles @ normals


def box_points(corners: Corners, samples: int) -> Float[np.ndarray, "p 3"]:
    """Points on the sides of a box, a line of `samples` along each edge."""
    ends = np.asarray(corners, float)
    if ends.shape == (2, 3):
        ends = np.array(list(itertools.product(*ends.T)))
    if ends.shape != (8, 3):
        raise ParameterError(f"a box has two opposite corners, or eight, got {ends.shape[0]}")
    if samples < 2:
        raise ParameterError(f"a box needs two samples along an edge or more, got {samples}")
    share = np.linspace(0.0, 1.0, samples)
    grid = np.stack(np.meshgrid(share, share, share, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = grid[((grid == 0) | (grid == 1)).any(axis=1)]
    weights = [np.stack([1 - grid[:, i], grid[:, i]], axis=1) for i in range(3)]
    mixed = np.einsum("pi,pj,pk->pijk", *weights).reshape(-1, 8)
    return mixed @ ends
