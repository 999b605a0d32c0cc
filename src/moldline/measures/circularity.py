"""Circles through places of a shape: a leading edge's radius, a duct that stays round."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Points, Vector
from ..errors import ParameterError
from .base import AbstractMeasure
from .directions import direction
from .spot import Spot, gathered


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

    def __init__(self, spots: Sequence[Spot], normal: str | Sequence[float] = "y"):
        self.reads, self.matrix = gathered(_three(spots))
        self.plane = spanned(normal)

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
    matrix: Float[np.ndarray, "s r"]
    plane: Float[np.ndarray, "2 3"]

    def __init__(self, spots: Sequence[Spot], normal: str | Sequence[float] = "x"):
        self.reads, self.matrix = gathered(_three(spots))
        self.plane = spanned(normal)

    @property
    @override
    def size(self) -> int:
        return len(self.matrix)

    @override
    def of(self, places: Points) -> Vector:
        flat = self.matrix @ places @ self.plane.T
        centre, radius = circle(flat)
        return jnp.linalg.norm(flat - centre, axis=1) - radius


def circle(
    flat: Float[jnp.ndarray, "s 2"],
) -> tuple[Float[jnp.ndarray, "2"], Float[jnp.ndarray, ""]]:
    """Centre and radius of the circle nearest to points of a plane."""
    middle = jnp.mean(flat, axis=0)
    own = flat - middle  # or the squares below cancel far from the origin
    rows = jnp.concatenate([2 * own, jnp.ones((len(own), 1))], axis=1)
    normal = rows.T @ rows
    x, y, rest = jnp.linalg.solve(normal, rows.T @ jnp.sum(own**2, axis=1))
    centre = jnp.stack([x, y])
    return middle + centre, jnp.sqrt(rest + centre @ centre)


def spanned(normal: str | Sequence[float]) -> Float[np.ndarray, "2 3"]:
    """Two unit vectors of the plane across a direction."""
    along = direction(normal)
    one = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    one = one / np.linalg.norm(one)
    return np.stack([one, np.cross(along, one)])


def _three(spots: Sequence[Spot]) -> Sequence[Spot]:
    if len(spots) < 3:
        raise ParameterError(f"a circle needs three spots or more, got {len(spots)}")
    return spots
