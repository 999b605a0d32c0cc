"""Where along its chord a section has points: fixed, whatever its parameters become."""

from typing import TYPE_CHECKING, Literal, TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array, ArrayLike
from ..errors import ParameterError

if TYPE_CHECKING:
    from .airfoil import AbstractAirfoil

Spacing: TypeAlias = Literal["cosine", "half-cosine", "uniform", "curvature"]
"""How points are spread along a chord, by name."""

NAMES = ("cosine", "half-cosine", "uniform", "curvature")

MOST = 2**20
"""Points on a side; more are a slip of the pen."""

_DENSE = 2000
"""Places at which a section's curvature is looked at."""


def stations(
    airfoil: "AbstractAirfoil | None", count: int, spacing: "Spacing | ArrayLike" = "cosine"
) -> Float[np.ndarray, "c"]:
    """Chordwise stations from 0, the nose, to 1, the trailing edge.

    "cosine" is fine at both ends, "half-cosine" at the nose only, "uniform" nowhere. "curvature"
    looks at an airfoil of its own values: half of the points follow the length of its two sides,
    the other half the root of their curvature. Stations given as numbers are taken as they are.
    """
    if not isinstance(spacing, str):
        return _checked(spacing)
    if spacing not in NAMES:
        raise ParameterError(
            f"spacing must be one of {', '.join(NAMES)}, or stations from 0 to 1; got {spacing!r}"
        )
    if count < 3 or count > MOST:
        raise ParameterError(f"a side needs at least 3 points and {MOST} at most, got {count}")
    share = np.linspace(0.0, 1.0, count)
    if spacing == "uniform":
        return share
    if spacing == "half-cosine":
        return _ended(1 - np.cos(np.pi / 2 * share))
    if spacing == "curvature":
        return _by_curvature(airfoil, share)
    return _ended(0.5 * (1 - np.cos(np.pi * share)))


def root(x: Array) -> Array:
    """Square root with the slope 0 at 0, where the true one is infinite."""
    is_inside = x > 0
    return jnp.where(is_inside, jnp.sqrt(jnp.where(is_inside, x, 1.0)), 0.0)


def _by_curvature(airfoil: "AbstractAirfoil | None", share: np.ndarray) -> np.ndarray:
    if airfoil is None:
        raise ParameterError(
            "spacing 'curvature' needs an airfoil whose curvature it can follow; say cosine instead"
        )
    place = _ended(0.5 * (1 - np.cos(np.pi * np.linspace(0.0, 1.0, _DENSE + 1))))
    total = np.zeros(_DENSE)
    for side in np.asarray(airfoil.sides(airfoil.values, place)):
        step = np.diff(side, axis=0)
        length = np.linalg.norm(step, axis=1)
        along, across = step[:-1], step[1:]
        turned = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]
        turn = np.abs(np.arctan2(turned, np.sum(along * across, axis=1)))
        curvature = turn / (0.5 * (length[1:] + length[:-1]))
        bent = np.sqrt(np.append(curvature[:1], curvature)) * length
        total += length / length.sum() + bent / bent.sum()
    reached = np.append(0.0, np.cumsum(total))
    return _ended(np.interp(share * reached[-1], reached, place))


def _ended(places: np.ndarray) -> np.ndarray:
    """The first exactly 0 and the last exactly 1, which rounding may miss."""
    places[0], places[-1] = 0.0, 1.0
    return places


def _checked(given: ArrayLike) -> np.ndarray:
    places = np.asarray(given, float)
    is_right = places.ndim == 1 and len(places) >= 3 and bool(np.all(np.diff(places) > 0))
    if not (is_right and places[0] == 0 and places[-1] == 1):
        raise ParameterError(f"stations must ascend from 0 to 1, three at least; got {given}")
    return places
