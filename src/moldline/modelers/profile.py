"""An airfoil in a wing or a nacelle: at their stations, with their thickness and camber."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from .._types import Array
from ..errors import ParameterError
from .airfoil import AbstractAirfoil
from .spacing import stations


class Profile(eqx.Module):
    """An airfoil of its own values, or of others where its parameters are exposed.

    Attributes
    ----------
    airfoil
        Which.
    own
        Its own values.
    stations
        Chordwise, from the nose to the trailing edge.
    drawn
        Its two sides by its own values, for the chord 1.
    thick
        Its greatest thickness by its own values, of the chord.
    exposed
        Names of its parameters that may change.
    """

    airfoil: AbstractAirfoil
    own: np.ndarray
    stations: np.ndarray
    drawn: np.ndarray
    thick: float
    exposed: tuple[str, ...] = eqx.field(static=True)

    def __init__(self, airfoil: AbstractAirfoil, at: np.ndarray, wanted: bool | list[str]):
        self.airfoil, self.stations = airfoil, at
        self.own = np.asarray(airfoil.values, float)
        self.drawn = np.asarray(_drawn(airfoil, self.own, at))
        self.thick = _thickest(airfoil, self.own)
        self.exposed = _wanted(airfoil, wanted)

    @property
    def numbers(self) -> dict[str, np.ndarray]:
        """Own values of the exposed parameters."""
        return {name: self.own[self.airfoil.parameters[name]] for name in self.exposed}

    def sides(self, given: Mapping[str, Array]) -> Array:
        """Upper and lower side for other values of the exposed parameters, shape (2, c, 2)."""
        if not self.exposed:
            return jnp.asarray(self.drawn)
        values = jnp.asarray(self.own)
        for name in self.exposed:
            values = values.at[self.airfoil.parameters[name]].set(given[name])
        return self.airfoil.sides(values, self.stations)


def scaled(sides: Array, thickness: Array, camber: Array) -> tuple[Array, Array]:
    """Upper and lower sides, out of (..., 2, c, 2), with so many times the thickness and camber.

    What is halfway between points that face each other is scaled across the chord, and what they
    are off it along the line that joins them.
    """
    upper, lower = sides[..., 0, :, :], sides[..., 1, :, :]
    across, along = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    middle = (upper + lower) / 2 * (camber[..., None, None] * across + along)
    half = (upper - lower) / 2 * thickness[..., None, None]
    return middle + half, middle - half


@eqx.filter_jit
def _drawn(airfoil: AbstractAirfoil, values: Array, at: Array) -> Array:
    return airfoil.sides(values, at)


def _wanted(airfoil: AbstractAirfoil, wanted: bool | list[str]) -> tuple[str, ...]:
    """Names of an airfoil's parameters that are to be exposed."""
    if isinstance(wanted, bool):
        return tuple(airfoil.parameters) if wanted else ()
    for name in wanted:
        if name not in airfoil.parameters:
            raise ParameterError(
                f"{airfoil.name} has no parameter {name!r}; section_parameters may be: "
                f"{', '.join(airfoil.parameters)}"
            )
    return tuple(wanted)


def _thickest(airfoil: AbstractAirfoil, values: np.ndarray) -> float:
    """The greatest distance of the two sides, between close stations by a parabola."""
    upper, lower = np.asarray(_drawn(airfoil, values, stations(None, 2001)))
    gap = np.linalg.norm(upper - lower, axis=1)
    k = int(np.clip(np.argmax(gap), 1, len(gap) - 2))
    before, most, after = gap[k - 1 : k + 2]
    bend = 2 * most - before - after
    return float(most + (after - before) ** 2 / (8 * bend) if bend > 0 else gap.max())
