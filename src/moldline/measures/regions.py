"""Regions that stay, move as a rigid body, or mirror each other."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from .base import AbstractMeasure, as_rows


class Fixed(AbstractMeasure):
    """Motion of points from their rest [m]: three numbers each, zero where they stay."""

    reads: np.ndarray
    rest: Float[np.ndarray, "r 3"]

    def __init__(self, points: Array, numbers: Sequence[int]):
        self.reads = np.unique(np.asarray(numbers, int))
        self.rest = np.asarray(points)[self.reads]

    @property
    @override
    def size(self) -> int:
        return self.rest.size

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        return (places - self.rest).reshape(-1)


class Rigid(AbstractMeasure):
    """How far points move otherwise than as a rigid body [m]: an engine's mount.

    The body's motion is that of three of the points, chosen far apart; the numbers are the
    changes of the sides of their triangle, and where the other points are in its axes, less where
    they were.

    Attributes
    ----------
    base
        Which of the points read are the three.
    """

    reads: np.ndarray
    base: Int[np.ndarray, "3"]
    rest: Float[np.ndarray, "k"]

    def __init__(self, points: Array, numbers: Sequence[int]):
        self.reads = np.unique(np.asarray(numbers, int))
        places = np.asarray(points)[self.reads]
        self.base = _far_apart(places)
        self.rest = np.zeros(3 * len(places) - 6)
        self.rest = np.asarray(self.of(jnp.asarray(places)))

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
        others = np.setdiff1d(np.arange(len(self.reads)), self.base)
        triangle = jnp.stack([own[self.base[1], 0], own[self.base[2], 0], own[self.base[2], 1]])
        return jnp.concatenate([triangle, own[others].reshape(-1)]) - self.rest


class Symmetry(AbstractMeasure):
    """How far points are from the mirror image of their partners [m], three numbers a pair.

    Attributes
    ----------
    pairs
        A point of the positive side and its partner, counted among the points read; points on the
        plane are their own partners.
    axis
        Number of the coordinate that is 0 on the plane.
    """

    reads: np.ndarray
    pairs: Int[np.ndarray, "p 2"]
    axis: int

    def __init__(self, points: Array, across: str = "y", tolerance: float = 1e-6):
        self.axis = "xyz".index(across)
        places = np.asarray(points)
        size = float(np.ptp(places, axis=0).max())
        flip = np.where(np.arange(3) == self.axis, -1.0, 1.0)
        side = np.flatnonzero(places[:, self.axis] >= 0)
        gaps, partner = KDTree(places).query(places[side] * flip)
        if gaps.max(initial=0.0) > tolerance * size:
            worst = side[int(gaps.argmax())]
            raise ParameterError(
                f"point {worst} at {places[worst].tolist()} has no mirror image across "
                f"{across} = 0: the nearest point is {gaps.max():.3g} from it"
            )
        self.reads, self.pairs = as_rows(np.stack([side, partner], axis=1))

    @property
    @override
    def size(self) -> int:
        return 3 * len(self.pairs)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        flip = np.where(np.arange(3) == self.axis, -1.0, 1.0)
        return (places[self.pairs[:, 0]] - flip * places[self.pairs[:, 1]]).reshape(-1)


def _far_apart(places: np.ndarray) -> np.ndarray:
    """Three points that span a large triangle."""
    if len(places) < 3:
        raise ParameterError(f"a rigid group needs three points or more, got {len(places)}")
    first = int(np.linalg.norm(places - places.mean(axis=0), axis=1).argmax())
    second = int(np.linalg.norm(places - places[first], axis=1).argmax())
    sides = np.cross(places - places[first], places[second] - places[first])
    third = int(np.linalg.norm(sides, axis=1).argmax())
    if np.linalg.norm(sides[third]) < 1e-9 * np.ptp(places, axis=0).max() ** 2:
        raise ParameterError("the points of a rigid group lie on one line; add one beside it")
    return np.array([first, second, third])
