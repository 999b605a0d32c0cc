"""Sections that planes cut from triangulations."""

from typing import Any

import numpy as np

from ..errors import ParameterError

NEAR = 1e-6
"""Points this near to a plane, in the surface's extent, lie in it; single precision asks for it."""


def cut(points: Any, faces: Any, axis: str, at: float) -> list[np.ndarray]:
    """The polylines, each (p, 3), in which a plane x, y or z = `at` cuts a triangulation.

    A closed one ends with its first point. Points that lie in the plane count as below it.
    """
    points, faces = np.asarray(points, float), np.asarray(faces)
    height = points[:, axis_number(axis)] - at
    above = height[faces] > 0
    crossed = faces[above.any(axis=1) & ~above.all(axis=1)]
    sides = np.sort(np.stack([crossed, np.roll(crossed, -1, axis=1)], axis=-1), axis=-1)
    splits = (height[sides] > 0).sum(axis=-1) == 1  # two sides of each crossed face
    ends, pairs = np.unique(sides[splits], axis=0, return_inverse=True)
    low, high = ends.T
    share = height[low] / np.where(low != high, height[low] - height[high], 1.0)
    places = points[low] + share[:, None] * (points[high] - points[low])
    return [places[chain] for chain in _chains(pairs.reshape(-1, 2))]


def section(points: Any, faces: Any, axis: str, at: float) -> list[np.ndarray]:
    """The same where points that all but lie in the plane do, also at the surface's upper end."""
    number, faces = axis_number(axis), np.asarray(faces)
    points = np.array(points, float)
    height = points[:, number]
    height[np.abs(height - at) <= NEAR * np.ptp(height[faces])] = at
    # points in the plane count as below it, so the upper end is cut from the other side
    way = -1.0 if height[faces].max() <= at else 1.0
    height *= way
    lines = cut(points, faces, axis, way * at)
    for line in lines:
        line[:, number] = at
    return lines


def axis_number(axis: str) -> int:
    """0, 1 or 2 for x, y or z."""
    if axis not in ("x", "y", "z"):
        raise ParameterError(f"an axis is x, y or z, got {axis!r}")
    return "xyz".index(axis)


def _chains(pairs: np.ndarray) -> list[list[int]]:
    """Chains of numbers that cover all pairs, each pair once; a closed one repeats its first."""
    near: dict[int, list[int]] = {}
    for number, pair in enumerate(pairs.tolist()):
        for end in pair:
            near.setdefault(end, []).append(number)
    unused = set(range(len(pairs)))

    def onward(here: int) -> list[int]:
        chain = []
        while (number := next((n for n in near[here] if n in unused), None)) is not None:
            unused.remove(number)
            here = int(pairs[number].sum()) - here
            chain.append(here)
        return chain

    chains = []
    loose = [end for end, touching in near.items() if len(touching) == 1]
    for start in [*loose, *near]:  # open chains from one of their ends, then closed ones
        if any(number in unused for number in near[start]):
            chains.append([start, *onward(start)])
    return chains
