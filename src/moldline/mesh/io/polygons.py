"""Polygons become triangles."""

import numpy as np
from jaxtyping import Float, Int

from ...errors import GeometryError
from ..planar import triangulated

LARGEST = 1000
"""Corners of a polygon that is cut; larger ones stay fans, since cutting takes their square."""


def triangles(
    points: Float[np.ndarray, "n 3"], corners: Int[np.ndarray, "w"], sizes: Int[np.ndarray, "p"]
) -> tuple[Int[np.ndarray, "m 3"], Int[np.ndarray, "m"]]:
    """Triangles of each polygon, and the polygon each comes from.

    `corners` holds the points of all polygons, one polygon after the other, of 3 or more each. They
    are fans from each polygon's first corner; where such a fan leaves the polygon, which is not
    convex then, it is cut in the plane that fits it.
    """
    if (sizes == 3).all():
        return corners.reshape(-1, 3), np.arange(len(sizes))
    faces, owner = _fans(corners, sizes)
    ends = np.cumsum(sizes)
    for polygon in np.unique(owner[_is_turned(points, faces, owner, sizes)]).tolist():
        loop = corners[ends[polygon] - sizes[polygon] : ends[polygon]]
        cut = _cut(points, loop) if len(loop) <= LARGEST else None
        if cut is not None:
            end = ends[polygon] - 2 * (polygon + 1)  # each before it has two triangles fewer
            faces[end - len(cut) : end] = cut
    return faces, owner


def _fans(corners: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    counts = sizes - 2
    owner = np.repeat(np.arange(len(sizes)), counts)
    first = (np.cumsum(sizes) - sizes)[owner]
    second = first + 1 + np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
    return np.stack([corners[first], corners[second], corners[second + 1]], axis=1), owner


def _is_turned(
    points: np.ndarray, faces: np.ndarray, owner: np.ndarray, sizes: np.ndarray
) -> np.ndarray:
    """Which triangles of a fan look the other way than their polygon."""
    is_turned = np.zeros(len(faces), bool)
    among = np.flatnonzero(sizes[owner] > 3)
    with np.errstate(all="ignore"):  # points that are not finite are refused by who uses them
        a, b, c = (points[faces[among, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        total = np.stack([np.bincount(owner[among], x, len(sizes)) for x in normals.T], axis=1)
        is_turned[among] = np.einsum("ij,ij->i", normals, total[owner[among]]) < 0
    return is_turned


def _cut(points: np.ndarray, loop: np.ndarray) -> Int[np.ndarray, "t 3"] | None:
    """Triangles of a polygon in its own plane; None where it crosses itself there."""
    places = points[loop] - points[loop].mean(axis=0)
    normal = np.sum(np.cross(places, np.roll(places, -1, axis=0)), axis=0)
    along = np.eye(3)[np.abs(normal).argmin()]
    first = np.cross(normal, along)
    axes = np.stack([first, np.cross(normal, first)])
    lengths = np.linalg.norm(axes, axis=1, keepdims=True)
    if not np.isfinite(lengths).all() or not np.all(lengths > 0):
        return None
    try:
        found = triangulated(places @ (axes / lengths).T, [np.arange(len(loop))])
    except GeometryError:
        return None
    return loop[found] if len(found) == len(loop) - 2 else None
