"""Regions that stay, move as a rigid body, or mirror each other."""

from collections.abc import Sequence
from typing import Literal, TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry, Section
from .base import AbstractMeasure, as_rows
from .directions import Along, Way, directions
from .needs import room
from .picks import Place, Region
from .picks import region as picked_region
from .picks import spots as picked
from .spot import Spot, padded
from .straightness import far_apart

Numbers: TypeAlias = Sequence[int] | Int[np.ndarray, "_"]


class Fixed(AbstractMeasure):
    """Motion of points and spots from their rest [m], whole or along some directions; zero stays.

    Attributes
    ----------
    rows, weights
        Points of each place that stays, counted among those read, and their weights.
    rest
        The places.
    along
        Directions, one number of each place for each.
    """

    reads: np.ndarray
    rows: Int[np.ndarray, "s w"]
    weights: Float[np.ndarray, "s w"]
    rest: Float[np.ndarray, "s 3"]
    along: Float[np.ndarray, "k 3"]

    def __init__(
        self,
        points: Array,
        numbers: Numbers = (),
        spots: Sequence[Spot] = (),
        along: Along | None = None,
    ):
        vertices = [Spot.vertex(n) for n in np.unique(np.asarray(numbers, int)).tolist()]
        if not vertices and not spots:
            raise ParameterError("what is fixed needs one point or spot at least")
        rows, self.weights = padded([*vertices, *spots])
        self.reads, self.rows = as_rows(rows)
        self.along = directions(along)
        self.rest = np.einsum("sw,swi->si", self.weights, np.asarray(points)[rows])

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        spots: list[Place] | None = None,
        region: Region | None = None,
        along: Way | None = None,
    ) -> "Fixed":
        """Spots, the vertices of a region, or both; along x and y of a section."""
        found = picked(geometry, spots, region, "what is fixed")
        return cls(geometry.points, (), found, room(geometry) if along is None else along)

    @property
    @override
    def size(self) -> int:
        return len(self.rest) * len(self.along)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        motion = jnp.einsum("sw,swi->si", self.weights, places[self.rows]) - self.rest
        return (motion @ self.along.T).reshape(-1)


class Rigid(AbstractMeasure):
    """How far points move otherwise than as a rigid body [m]: an engine's mount.

    The body's motion is that of three of the points, chosen far apart; the numbers are the
    changes of the sides of their triangle, and where the other points are in its axes, less where
    they were.

    Attributes
    ----------
    base
        Which of the points read are the three.
    others
        Those that are not.
    dimension
        Coordinates of each other point that count: 2 in a section's plane.
    """

    reads: np.ndarray
    base: Int[np.ndarray, "3"]
    others: Int[np.ndarray, "o"]
    rest: Float[np.ndarray, "k"]
    dimension: int

    def __init__(self, points: Array, numbers: Numbers, is_flat: bool = False):
        self.reads = np.unique(np.asarray(numbers, int))
        places = np.asarray(points)[self.reads]
        self.base = far_apart(places, "a rigid group")
        self.others = np.setdiff1d(np.arange(len(self.reads)), self.base)
        self.dimension = 2 if is_flat else 3
        self.rest = np.zeros(3 + self.dimension * len(self.others))
        self.rest = np.asarray(self.of(jnp.asarray(places)))

    @classmethod
    @override
    def build(cls, geometry: Geometry, *, region: Region) -> "Rigid":
        """The vertices of a region."""
        numbers = picked_region(geometry, region)
        return cls(geometry.points, numbers, isinstance(geometry, Section))

    @property
    @override
    def size(self) -> int:
        return len(self.rest)

    @override
    def of(self, places: Points) -> Vector:
        first, second, third = places[self.base]
        x = second - first
        z = jnp.cross(x, third - first)
        x, z = x / jnp.linalg.norm(x), z / jnp.linalg.norm(z)
        axes = jnp.stack([x, jnp.cross(z, x), z])
        own = (places - first) @ axes.T
        triangle = jnp.stack([own[self.base[1], 0], own[self.base[2], 0], own[self.base[2], 1]])
        others = own[self.others][:, : self.dimension]
        return jnp.concatenate([triangle, others.reshape(-1)]) - self.rest


class Symmetry(AbstractMeasure):
    """How far points are from the mirror image of their partners [m].

    Three numbers a pair, in a section's plane two; one for a point on the plane, which is its own
    partner: how far it is off, twice.

    Attributes
    ----------
    pairs
        Two points, counted among those read.
    alone
        Points on the plane.
    axis
        Number of the coordinate that is 0 on the plane.
    dimension
        Coordinates that count.
    """

    reads: np.ndarray
    pairs: Int[np.ndarray, "p 2"]
    alone: Int[np.ndarray, "a"]
    axis: int
    dimension: int

    def __init__(
        self,
        points: Array,
        across: str = "y",
        tolerance: float = 1e-6,
        numbers: Numbers | None = None,
        is_flat: bool = False,
    ):
        if across not in ("x", "y", "z"):
            raise ParameterError(f"a mirror is across x, y or z, got {across!r}")
        self.axis, self.dimension = "xyz".index(across), 2 if is_flat else 3
        own = np.arange(len(points)) if numbers is None else np.unique(np.asarray(numbers, int))
        pairs = own[_partners(np.asarray(points)[own], self.axis, tolerance)]
        self.reads, rows = as_rows(pairs)
        is_alone = rows[:, 0] == rows[:, 1]
        self.pairs, self.alone = rows[~is_alone], rows[is_alone, 0]

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        across: Literal["x", "y", "z"] = "y",
        tolerance: float = 1e-6,
        region: Region | None = None,
    ) -> "Symmetry":
        """All points, or the vertices of a region, which holds partners too.

        `tolerance` says how far partners are from mirror images at rest, in the geometry's size.
        """
        numbers = picked_region(geometry, region) if region else None
        flat = isinstance(geometry, Section)
        return cls(geometry.points, across, tolerance, numbers, flat)

    @property
    @override
    def size(self) -> int:
        return self.dimension * len(self.pairs) + len(self.alone)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        flip = np.where(np.arange(3) == self.axis, -1.0, 1.0)
        apart = places[self.pairs[:, 0]] - flip * places[self.pairs[:, 1]]
        off = 2 * places[self.alone, self.axis]
        return jnp.concatenate([apart[:, : self.dimension].reshape(-1), off])


def _partners(places: np.ndarray, axis: int, tolerance: float) -> Int[np.ndarray, "p 2"]:
    """Each point of the positive side and the one that is nearest to its mirror image."""
    flip = np.where(np.arange(3) == axis, -1.0, 1.0)
    close = tolerance * float(np.ptp(places, axis=0).max())
    gaps, partner = KDTree(places).query(places * flip)
    if gaps.max(initial=0.0) > close:
        worst = int(gaps.argmax())
        raise ParameterError(
            f"the point at {places[worst].tolist()} has no mirror image across "
            f"{'xyz'[axis]} = 0: the nearest point is {gaps[worst]:.3g} from it"
        )
    own = np.arange(len(places))
    partner[np.abs(places[:, axis]) <= close] = own[np.abs(places[:, axis]) <= close]
    return np.stack([own, partner], axis=1)[places[:, axis] >= -close]
