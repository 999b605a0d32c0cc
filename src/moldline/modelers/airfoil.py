"""What every airfoil is: two sides at fixed chordwise stations, and a section made of them."""

import abc
from pathlib import Path
from typing import Any, Literal, TypeAlias

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, ArrayLike, Points, Vector
from ..errors import ParameterError
from ..mesh import Section
from .base import AbstractModeler, AbstractShape
from .spacing import Spacing, stations

Edge: TypeAlias = Literal["sharp", "blunt"]
"""Whether the two sides meet in one point at the trailing edge or leave a base between them."""


class Outline(eqx.Module):
    """How an airfoil alone is drawn.

    Attributes
    ----------
    stations
        Of its points on each side, from the nose to the trailing edge.
    base_points
        Points inside the base of a blunt trailing edge.
    chord
        Length that the section is drawn with [m].
    """

    stations: Float[np.ndarray, "c"]
    base_points: int = eqx.field(static=True)
    chord: float = eqx.field(static=True)


class AbstractAirfoil(AbstractShape):
    """A section whose parameters bend it and whose points stay at their chordwise stations.

    Attributes
    ----------
    outline
        How it is drawn where it stands alone; a wing chooses its own stations.
    """

    outline: eqx.AbstractVar[Outline]

    @abc.abstractmethod
    def sides(self, parameters: Vector, stations: Float[Array, "c"]) -> Array:
        """Points (x, y) of the upper and the lower side, shape (2, c, 2), for the chord 1.

        Stations run from 0, the nose, which both sides share, to 1, the trailing edge. By plain
        JAX; the derivatives are finite at the nose too.
        """

    @property
    @abc.abstractmethod
    def is_blunt(self) -> bool:
        """Whether a base closes the trailing edge: by its options, never by its parameters."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """What the section is called."""

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "AbstractModeler":
        """Make one from a case file's options, whose lists stay lists."""
        return cls(**options)

    @override
    def __call__(self, parameters: Vector) -> Points:
        upper, lower = self.sides(parameters, self.outline.stations)
        runs = [upper[::-1], lower[1:]]
        if self.is_blunt:
            share = np.linspace(0.0, 1.0, self.outline.base_points + 2)[1:-1, None]
            runs.append((1 - share) * lower[-1] + share * upper[-1])
        loop = self.outline.chord * jnp.concatenate(runs)
        return jnp.concatenate([loop, jnp.zeros((len(loop), 1))], axis=1)

    @property
    @override
    def geometry(self) -> Section:
        """From the trailing edge over the upper side to the nose and back along the lower one.

        A sharp trailing edge is there twice, first and last; a blunt one is closed by a segment.
        """
        return Section(np.asarray(self(self.values)), self.name, self.is_blunt)


def outlined(
    airfoil: AbstractAirfoil,
    points_per_side: int,
    spacing: Spacing | ArrayLike,
    base_points: int,
    chord: float,
) -> Outline:
    """The outline of an airfoil whose other fields are set."""
    if base_points < 0:
        raise ParameterError(f"a base has 0 points inside or more, got {base_points}")
    if base_points and not airfoil.is_blunt:
        raise ParameterError(
            f"{base_points} base_points need a base: a sharp trailing edge has none; "
            "say trailing_edge = blunt"
        )
    if not 0 < chord < np.inf:
        raise ParameterError(f"the chord must be a length above 0 [m], got {chord}")
    return Outline(stations(airfoil, points_per_side, spacing), base_points, float(chord))


def check_edge(trailing_edge: str) -> None:
    """Refuse what is no kind of trailing edge."""
    if trailing_edge not in ("sharp", "blunt"):
        raise ParameterError(f"trailing_edge must be sharp or blunt, got {trailing_edge!r}")


def check_crest(crest: float) -> None:
    """Refuse a place of the greatest camber that is not inside the chord."""
    if not 0 < crest < 1:
        raise ParameterError(f"the crest must lie inside (0, 1) of chord, got {crest}")


def check_thickness(thickness: float) -> None:
    """Refuse a section without thickness."""
    if not thickness > 0:
        raise ParameterError(f"the thickness must be above 0 of chord, got {thickness}")


def around_camber(camber: Array, slope: Array, half: Array, stations: Array) -> Array:
    """Both sides of a camber line, half the thickness off it, at a right angle to it."""
    cosine = 1 / jnp.sqrt(1 + slope**2)
    across = jnp.stack([-slope * cosine, cosine], axis=1) * half[:, None]
    line = jnp.stack([jnp.asarray(stations), camber], axis=1)
    return jnp.stack([line + across, line - across])
