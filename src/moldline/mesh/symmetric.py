"""Halves and their mirror images about y = 0."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from .slices import NEAR
from .surface import Surface
from .topology import edges

FLIP = np.array([1.0, -1.0, 1.0])


def is_half(points: Float[np.ndarray, "n 3"]) -> bool:
    """Whether points lie on one side of y = 0 and begin there: a half model's."""
    low, high = sorted(np.abs([points[:, 1].min(), points[:, 1].max()]).tolist())
    return bool(low <= NEAR * high and high > 0)


def with_image(
    points: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "t 3"]
) -> tuple[np.ndarray, np.ndarray]:
    """A half and its mirror image, which turns as it does; not joined."""
    image = triangles[:, ::-1] + len(points)
    return np.concatenate([points, points * FLIP]), np.concatenate([triangles, image])


def joined(points: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "t 3"]) -> Surface:
    """A surface at y >= 0, open towards the plane, joined there with its image.

    The points of its border are put onto the plane; those of the image come last.
    """
    points, found = points.copy(), edges(faces)
    points[found.ends[found.uses == 1], 1] = 0.0
    flat = points[:, 1] == 0
    faces = faces[~flat[faces].all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    points, flat, faces = points[used], flat[used], faces.reshape(-1, 3)
    image = np.arange(len(points))
    image[~flat] = len(points) + np.arange(np.count_nonzero(~flat))
    whole = np.concatenate([points, points[~flat] * FLIP])
    return Surface(whole, np.concatenate([faces, image[faces][:, ::-1]]))


def evened(points: Float[np.ndarray, "n 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Points that are symmetric to rounding made so to the bit, and the image of each."""
    image = KDTree(points).query(points * FLIP)[1]
    return (points + FLIP * points[image]) / 2, image
