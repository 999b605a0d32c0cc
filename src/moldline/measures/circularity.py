"""Circles through places of a shape: a leading edge's radius, a duct that stays round."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from ..mesh import Geometry
from .base import AbstractMeasure, as_rows
from .directions import Along, Way, direction
from .needs import span
from .picks import Place, Region
from .picks import spots as picked
from .spot import Spot, gathered, padded
from .stations import station

AROUND = (0.04, 0.16, 0.36, 0.64, 1.0)
"""Where a nose is read on both sides, in parts of how far it is read: even steps around it."""


class EdgeRadius(AbstractMeasure):
    """Radius of the circle nearest to spots around an edge, in a plane [m].

    Attributes
    ----------
    plane
        Two directions that span the plane.

    Notes
    -----
    The circle is the algebraic least-squares fit: Kåsa, IEEE Trans. Instrum. Meas. 25, 1976.
    """

    reads: np.ndarray
    matrix: Float[np.ndarray, "s r"]
    plane: Float[np.ndarray, "2 3"]

    def __init__(self, spots: Sequence[Spot], normal: Along = "y"):
        self.reads, self.matrix = gathered(_three(spots))
        self.plane = spanned(normal)

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        spots: list[Place] | None = None,
        at: float | None = None,
        component: str | None = None,
        length: float = 0.002,
        normal: Way | None = None,
    ) -> "EdgeRadius":
        """Of spots, or of the leading edge of a wing at the station y = `at`, or of a section.

        `length` says how far behind the leading edge its sides are read, in chords.
        """
        if spots is not None:
            around = picked(geometry, spots, None, "a radius")
        else:
            cut = station(geometry, at, component, "a leading edge's radius")
            around = [Spot(*cut.foot(0.0, "upper"))]
            for side in ("upper", "lower"):
                around += [Spot(*cut.foot(length * part, side)) for part in AROUND]
        return cls(around, span(geometry) if normal is None else normal)

    @property
    @override
    def size(self) -> int:
        return 1

    @override
    def of(self, places: Points) -> Vector:
        _, radius = circle(self.matrix @ places @ self.plane.T)
        return radius[None]


class Circularity(AbstractMeasure):
    """How far each spot is outside the circle nearest to them all, in a plane [m]."""

    reads: np.ndarray
    rows: Int[np.ndarray, "s w"]
    weights: Float[np.ndarray, "s w"]
    plane: Float[np.ndarray, "2 3"]

    def __init__(self, spots: Sequence[Spot], normal: Along = "x"):
        rows, self.weights = padded(_three(spots))
        self.reads, self.rows = as_rows(rows)
        self.plane = spanned(normal)

    @classmethod
    @override
    def build(
        cls,
        geometry: Geometry,
        *,
        spots: list[Place] | None = None,
        region: Region | None = None,
        normal: Way = "x",
    ) -> "Circularity":
        """Of spots, of the vertices of a region, or both."""
        return cls(picked(geometry, spots, region, "a circle"), normal)

    @property
    @override
    def size(self) -> int:
        return len(self.rows)

    @override
    def of(self, places: Points) -> Vector:
        flat = jnp.einsum("sw,swi->si", self.weights, places[self.rows]) @ self.plane.T
        centre, radius = circle(flat)
        return jnp.linalg.norm(flat - centre, axis=1) - radius


def circle(
    flat: Float[Array, "s 2"],
) -> tuple[Float[Array, "2"], Float[Array, ""]]:
    """Centre and radius of the circle nearest to points of a plane."""
    middle = jnp.mean(flat, axis=0)
    own = flat - middle  # or the squares below cancel far from the origin
    rows = jnp.concatenate([2 * own, jnp.ones((len(own), 1))], axis=1)
    normal = rows.T @ rows
    x, y, rest = jnp.linalg.solve(normal, rows.T @ jnp.sum(own**2, axis=1))
    centre = jnp.stack([x, y])
    return middle + centre, jnp.sqrt(rest + centre @ centre)


def spanned(normal: Along) -> Float[np.ndarray, "2 3"]:
    """Two unit vectors of the plane across a direction."""
    along = direction(normal)
    one = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    one = one / np.linalg.norm(one)
    return np.stack([one, np.cross(along, one)])


def _three(spots: Sequence[Spot]) -> Sequence[Spot]:
    if len(spots) < 3:
        raise ParameterError(f"a circle needs three spots or more, got {len(spots)}")
    return spots
