"""Weights of a body's stations in its rows, so that round ends are smooth at their poles."""

from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from .loft import exact, loft_weights

FULLNESS = 0.6
"""What a round end's extra control point has of the size at the next station."""


def body_weights(
    stations: Float[np.ndarray, "s"],
    rows: Float[np.ndarray, "rows"],
    loft: str,
    is_round: tuple[bool, bool],
) -> tuple[Float[np.ndarray, "rows s"], Float[np.ndarray, "rows s"]]:
    """For what is the same on both sides of a pole, as x is, and for sizes, which change sign.

    Stations and rows are lengths along the outline. At a round end places are even and sizes odd
    functions of them, as they are where a smooth meridian crosses the axis. "linear" makes the end
    a quarter of an ellipse, "cubic" has the symmetry in its end conditions, "bspline" in one more
    control point, straight off the pole.
    """
    if loft == "bspline" and len(stations) > 2:
        return _bspline(stations, rows, is_round)
    even = loft_weights(stations, rows, "linear" if loft == "bspline" else loft)
    odd = even.copy()
    if loft == "cubic" and len(stations) > 2:
        even, odd = (
            CubicSpline(stations, np.eye(len(stations)), bc_type=_ends(stations, is_round, k))(rows)
            for k in (1, 2)
        )
    else:
        _elliptical(even, odd, stations, rows, is_round)
    for weights in (even, odd):
        exact(weights, stations, rows, loft)
    return even, odd


def _ends(stations: np.ndarray, is_round: tuple[bool, bool], order: int) -> tuple[Any, ...]:
    """Which derivative is 0 at a round end."""
    return tuple((order, np.zeros(len(stations))) if at else "not-a-knot" for at in is_round)


def _elliptical(
    even: np.ndarray,
    odd: np.ndarray,
    stations: np.ndarray,
    rows: np.ndarray,
    is_round: tuple[bool, bool],
) -> None:
    """Make panels that end round quarters of ellipses."""
    last = len(stations) - 1
    for at, (pole, inner) in zip(is_round, ((0, 1), (last, last - 1)), strict=True):
        if not at:
            continue
        share = (rows - stations[pole]) / (stations[inner] - stations[pole])
        own = (share >= 0) & (share <= 1)
        turn = np.pi / 2 * share[own]
        even[own], odd[own] = 0.0, 0.0
        even[own, pole], even[own, inner] = np.cos(turn), 1 - np.cos(turn)
        odd[own, inner] = np.sin(turn)


def _bspline(
    stations: np.ndarray, rows: np.ndarray, is_round: tuple[bool, bool]
) -> tuple[np.ndarray, np.ndarray]:
    places, source = stations.tolist(), list(range(len(stations)))
    for at, where, pole in ((is_round[1], -1, -1), (is_round[0], 1, 0)):
        if at:
            beside = 1 if pole == 0 else -2
            places.insert(where, (stations[pole] + stations[beside]) / 2)
            source.insert(where, source[pole])
    weights = loft_weights(np.array(places), rows, "bspline")
    even, odd = (np.zeros((len(rows), len(stations))) for _ in range(2))
    for column, station in enumerate(source):
        even[:, station] += weights[:, column]
        is_extra = source.count(station) > 1 and column in (1, len(source) - 2)
        beside = 1 if station == 0 else station - 1
        odd[:, beside if is_extra else station] += (FULLNESS if is_extra else 1) * weights[
            :, column
        ]
    return even, odd
