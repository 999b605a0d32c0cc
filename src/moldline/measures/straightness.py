"""Straight lines and flat regions."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry, Section
from .base import AbstractMeasure, as_rows
from .circularity import spanned
from .picks import Place, Region, row
from .picks import spots as picked
from .spot import Spot, gathered, padded
from .stations import Side


class Linearity(AbstractMeasure):
    """How far spots are beside the straight line from the first to the last [m].

    Two numbers for each spot between, across the line at rest; all zero keep a leading edge or a
    hinge straight. Spots keep their parts of the line, so the numbers are affine.

    Attributes
    ----------
    matrix
        What of the points read each spot between, less its part of the line, is.
    across
        Directions across the line; in a section's plane there is one only.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "s r"]
    across: Float[np.ndarray, "d 3"]

    def __init__(self, points: Array, spots: Sequence[Spot], is_flat: bool = False):
        if len(spots) < 3:
            raise ParameterError(f"a line needs three spots or more, got {len(spots)}")
        places = np.array([spot.of(points) for spot in spots])
        line = places[-1] - places[0]
        length = float(np.linalg.norm(line))
        if length == 0:
            raise ParameterError("the line's first and last spot are in one place")
        beside = np.cross([0.0, 0.0, 1.0], line)[None] / length
        self.across = beside if is_flat else spanned(line)
        share = (places[1:-1] - places[0]) @ line / length**2
        self.reads, matrix = gathered(spots)
        self.matrix = matrix[1:-1] - np.outer(1 - share, matrix[0]) - np.outer(share, matrix[-1])

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        spots: list[Place] | None = None,
        at: list[float] | None = None,
        chord: float = 0.0,
        side: Side = "upper",
        component: str | None = None,
    ) -> "Linearity":
        """Of spots in a row, or of a wing's line at a fraction of the chord over stations `at`."""
        if (spots is None) == (at is None):
            raise ParameterError("a line is said by spots, or by stations `at` of a wing")
        if at is not None:
            line = row(geometry, chord, side, at, component)
        else:
            line = picked(geometry, spots, None, "a line")
        return cls(geometry.points, line, isinstance(geometry, Section))

    @property
    @override
    def size(self) -> int:
        return len(self.matrix) * len(self.across)

    @property
    @override
    def is_affine(self) -> bool:
        return True

    @override
    def of(self, places: Points) -> Vector:
        return (self.matrix @ places @ self.across.T).reshape(-1)


class Planarity(AbstractMeasure):
    """How far spots are above the plane through three of them [m], one number for each other.

    It has no derivative where the three lie on one line.

    Attributes
    ----------
    rows, weights
        Points of each spot, counted among those read, and their weights; the first three span the
        plane.
    """

    reads: np.ndarray
    rows: Int[np.ndarray, "s w"]
    weights: Float[np.ndarray, "s w"]

    def __init__(self, spots: Sequence[Spot]):
        if len(spots) < 4:
            raise ParameterError(f"a plane needs four spots or more, got {len(spots)}")
        rows, self.weights = padded(spots)
        self.reads, self.rows = as_rows(rows)

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        spots: list[Place] | None = None,
        region: Region | None = None,
    ) -> "Planarity":
        """Of spots, of the vertices of a region, or both; three far apart span the plane."""
        found = picked(geometry, spots, region, "a plane")
        if isinstance(geometry, Section):
            raise ParameterError("a section is flat; ask for the linearity of spots instead")
        if len(found) < 4:
            raise ParameterError(f"a plane needs four spots or more, got {len(found)}")
        first = far_apart(np.array([one.of(geometry.points) for one in found]), "a plane").tolist()
        others = [one for number, one in enumerate(found) if number not in first]
        return cls([*(found[number] for number in first), *others])

    @property
    @override
    def size(self) -> int:
        return len(self.rows) - 3

    @override
    def of(self, places: Points) -> Vector:
        spots = jnp.einsum("sw,swi->si", self.weights, places[self.rows])
        sides = spots[1:] - spots[0]
        normal = jnp.cross(sides[0], sides[1])
        return sides[2:] @ (normal / jnp.linalg.norm(normal))


def far_apart(places: Float[np.ndarray, "r 3"], what: str) -> np.ndarray:
    """Which three points span a large triangle."""
    if len(places) < 3:
        raise ParameterError(f"{what} needs three points or more, got {len(places)}")
    first = int(np.linalg.norm(places - places.mean(axis=0), axis=1).argmax())
    second = int(np.linalg.norm(places - places[first], axis=1).argmax())
    sides = np.cross(places - places[first], places[second] - places[first])
    third = int(np.linalg.norm(sides, axis=1).argmax())
    if np.linalg.norm(sides[third]) < 1e-9 * np.ptp(places, axis=0).max() ** 2:
        raise ParameterError(f"the points of {what} lie on one line; add one beside it")
    return np.array([first, second, third])
