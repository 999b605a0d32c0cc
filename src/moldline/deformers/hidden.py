"""The lattice that is made behind pilots when none is given."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from .._types import Points
from ..errors import ParameterError
from ..measures.base import AbstractMeasure
from .lattice import Lattice

FEWEST, MOST = 4, 24
"""Control points along an axis on which the shape extends."""

MOST_IN_ALL = 4000
"""Control points."""

FLAT = 1e-9
"""A shape that extends less than this along an axis, in its size, is flat."""

SAME = 0.02
"""Pilots nearer than this along an axis, in the shape's extent, have one place on it."""

LARGE = 200
"""A measure that reads more points than this is one of a region, not of places."""


def automatic(rest: Points, measures: Sequence[AbstractMeasure], margin: float) -> Lattice:
    """A lattice around the shape whose cells are no wider than the gaps between pilots.

    What the pilots and constraints read lies at some places along each axis; the typical gap
    between them is a cell's width. A flat shape gets one control point across.

    Raises
    ------
    ParameterError
        Where the margin leaves no room around the shape.
    """
    if not 0 < margin < np.inf:
        raise ParameterError(f"the hidden lattice's margin is above zero, got {margin}")
    places = _places(rest, measures)
    low, high = np.min(rest, axis=0), np.max(rest, axis=0)
    extent = high - low
    counts = [
        1 if extent[i] <= FLAT * extent.max() else _count(places[:, i], extent[i]) for i in range(3)
    ]
    while np.prod(counts) > MOST_IN_ALL:
        counts[int(np.argmax(counts))] -= 1
    room = margin * np.where(extent > FLAT * extent.max(), extent, extent.max())
    return Lattice.box(low - room, high + room, counts)


def _places(rest: Points, measures: Sequence[AbstractMeasure]) -> Float[np.ndarray, "p 3"]:
    reads = [m.reads for m in measures if 0 < len(m.reads) <= LARGE]
    return (
        np.asarray(rest)[np.unique(np.concatenate(reads).astype(int))]
        if reads
        else np.asarray(rest)[:1]
    )


def _count(places: Float[np.ndarray, "p"], extent: float) -> int:
    gaps = np.diff(np.sort(places))
    gaps = gaps[gaps > SAME * extent]
    if not len(gaps):
        return FEWEST
    return int(np.clip(np.ceil(extent / np.median(gaps)) + 2, FEWEST, MOST))
