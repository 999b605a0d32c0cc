"""Where rows stand between stations, and the weights of the stations in each row."""

from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.interpolate import BSpline, CubicSpline

from ..errors import ParameterError

Lofting = Literal["linear", "cubic", "bspline"]


def row_places(
    stations: Float[np.ndarray, "s"],
    count: int,
    clustering: float,
    ends: tuple[bool, bool] = (True, True),
) -> Float[np.ndarray, "rows"]:
    """Places of about `count` + 1 rows from the first station to the last, one at each station.

    `clustering` runs from 0, even, to 1, a cosine's spacing, at the ends that are named.
    """
    if count < len(stations) - 1:
        raise ParameterError(
            f"{len(stations)} stations need at least {len(stations) - 1} intervals between their "
            f"rows of points, got {count}"
        )
    if not 0 <= clustering <= 1:
        raise ParameterError(f"clustering lies from 0, even, to 1, cosine; got {clustering}")
    fine = np.linspace(0, 1, 4001)
    run = stations[0] + (stations[-1] - stations[0]) * _clustered(fine, clustering, ends)
    shares = np.interp(stations, run, fine)
    counts = np.maximum(1, np.rint(np.diff(shares) * count).astype(int))
    counts[np.argmax(counts)] += max(count - counts.sum(), 1 - counts.max())
    parts = []
    for k, number in enumerate(counts.tolist()):
        even = shares[k] + (shares[k + 1] - shares[k]) * np.arange(number) / number
        parts.append(np.interp(even, fine, run))
        parts[k][0] = stations[k]
    return np.concatenate([*parts, stations[-1:]])


def _clustered(share: np.ndarray, clustering: float, ends: tuple[bool, bool]) -> np.ndarray:
    cosine = {
        (True, True): (1 - np.cos(np.pi * share)) / 2,
        (True, False): 1 - np.cos(np.pi / 2 * share),
        (False, True): np.sin(np.pi / 2 * share),
        (False, False): share,
    }
    return (1 - clustering) * share + clustering * cosine[ends]


def loft_weights(
    stations: Float[np.ndarray, "s"], rows: Float[np.ndarray, "rows"], loft: str, order: int = 0
) -> Float[np.ndarray, "rows s"]:
    """What each station counts for in each row, or in its derivative along the stations.

    "linear" is straight from station to station. "cubic" goes through them with a continuous
    curvature. "bspline" is drawn by them, as by control points, and goes through the ends only.
    """
    count = len(stations)
    if loft not in Lofting.__args__:  # type: ignore[attr-defined]
        raise ParameterError(f"loft must be linear, cubic or bspline, got {loft!r}")
    if loft == "bspline" and count > 2:
        degree = min(3, count - 1)
        inner = [stations[k : k + degree].mean() for k in range(1, count - degree)]
        knots = np.r_[[stations[0]] * (degree + 1), inner, [stations[-1]] * (degree + 1)]
        weights = BSpline(knots, np.eye(count), degree)(rows, nu=order)
    elif loft == "linear" or count == 2:
        cell = np.clip(np.searchsorted(stations, rows, side="right") - 1, 0, count - 2)
        width = np.diff(stations)[cell]
        share = (rows - stations[cell]) / width
        weights = np.zeros((len(rows), count))
        values = (1 - share, share) if order == 0 else (-1 / width, 1 / width)
        for step, value in enumerate(values):
            weights[np.arange(len(rows)), cell + step] = value
    else:
        weights = CubicSpline(stations, np.eye(count))(rows, nu=order)
    if order == 0:
        exact(weights, stations, rows, loft)
    return weights


def exact(weights: np.ndarray, stations: np.ndarray, rows: np.ndarray, loft: str) -> None:
    """Make rows at stations theirs to the bit, where the loft goes through them."""
    own = [0, len(stations) - 1] if loft == "bspline" else range(len(stations))
    for k in own:
        weights[rows == stations[k]] = np.eye(len(stations))[k]
