"""Polygons become triangles."""

import numpy as np
from jaxtyping import Int


def fans(
    corners: Int[np.ndarray, "w"], sizes: Int[np.ndarray, "p"]
) -> tuple[Int[np.ndarray, "m 3"], Int[np.ndarray, "m"]]:
    """Fans of triangles from each polygon's first corner, and the polygon each comes from.

    `corners` holds the points of all polygons, one polygon after the other, of 3 or more each.
    """
    if (sizes == 3).all():
        return corners.reshape(-1, 3), np.arange(len(sizes))
    counts = sizes - 2
    owner = np.repeat(np.arange(len(sizes)), counts)
    first = (np.cumsum(sizes) - sizes)[owner]
    second = first + 1 + np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
    return np.stack([corners[first], corners[second], corners[second + 1]], axis=1), owner
