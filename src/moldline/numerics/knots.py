"""Finer splines that span the coarser ones: knot insertion and degree elevation.

Source: Cohen, Lyche and Riesenfeld, Discrete B-splines and Subdivision Techniques, Computer
Graphics and Image Processing 14, 1980 (the Oslo algorithm); Barry and Goldman, A Recursive Proof
of a B-spline Identity for Degree Elevation, Computer Aided Geometric Design 5, 1988.
"""

import numpy as np
from jaxtyping import Float

from .bspline import Axis

Knots = Float[np.ndarray, "k"]


def cut(interior: Knots, parts: int) -> Float[np.ndarray, "cut"]:
    """With knots inserted that cut each cell of (0, 1) into even parts."""
    breaks = np.unique([0.0, *interior, 1.0])
    share = np.arange(1, parts) / parts
    new = breaks[:-1, None] + share * np.diff(breaks)[:, None]
    return np.sort(np.concatenate([interior, new.ravel()]))


def filled(interior: Knots, count: int) -> Float[np.ndarray, "filled"]:
    """With knots inserted until there are `count`, each in the middle of the longest cell.

    Of equally long cells it is the one nearest to the middle, then the first.
    """
    found = np.sort(interior)
    while len(found) < count:
        breaks = np.unique([0.0, *found, 1.0])
        middles = (breaks[:-1] + breaks[1:]) / 2
        # rounded, or cells that are equal but for rounding would come in any order
        width, off = np.diff(breaks).round(9), abs(middles - 0.5).round(9)
        new = middles[np.lexsort((off, -width))[0]]
        found = np.insert(found, np.searchsorted(found, new), new)
    return found


def raised(interior: Knots, times: int) -> Float[np.ndarray, "raised"]:
    """With each knot as often again as the degree is raised, so that no smoothness is asked for."""
    return np.sort(np.concatenate([interior, np.repeat(np.unique(interior), times)]))


def transfer(coarse: Axis, fine: Axis) -> Float[np.ndarray, "fine coarse"]:
    """Control values along a finer axis that give the spline of those along a coarser one.

    The finer has all the knots of the coarser, each one more time for each degree more. All
    entries are at least zero and every row sums to one.
    """
    if coarse.size == 1:
        return np.ones((fine.size, 1))
    knots, matrix = coarse.knots, np.eye(coarse.size)
    for degree in range(coarse.degree, fine.degree):
        more = np.sort(np.concatenate([knots, np.unique(knots)]))
        matrix = _elevation(_supports(knots, degree), more) @ matrix
        knots = more
    return _discrete(_supports(knots, fine.degree), fine.knots) @ matrix


def _supports(knots: np.ndarray, degree: int) -> np.ndarray:
    """The degree + 2 knots of each basis function."""
    return np.lib.stride_tricks.sliding_window_view(knots, degree + 2)


def _elevation(supports: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """Basis functions in those of one degree more: means of ones with one knot doubled."""
    ends = supports.shape[1]
    doubled = (np.insert(supports, k, supports[:, k], axis=1) for k in range(ends))
    return sum((_discrete(one, fine) for one in doubled), start=np.zeros(())) / (ends - 1)


def _discrete(supports: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """Discrete B-splines: basis functions, given by their knots, in those of the same degree.

    Shape (fine functions, functions).
    """
    degree = supports.shape[1] - 2
    count = len(fine) - degree - 1
    first = fine[:count, None, None]
    value = ((supports[:, :-1] <= first) & (first < supports[:, 1:])).astype(float)
    for d in range(1, degree + 1):
        place = fine[d : count + d, None, None]
        low, high = supports[:, : -d - 1], supports[:, d + 1 :]
        rise, fall = supports[:, d:-1] - low, high - supports[:, 1:-d]
        up = (place - low) / np.where(rise > 0, rise, np.inf)
        down = (high - place) / np.where(fall > 0, fall, np.inf)
        value = up * value[..., :-1] + down * value[..., 1:]
    return value[..., 0]
