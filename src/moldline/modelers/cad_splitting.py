"""Triangles halved at marked edges, alike on both sides of each edge."""

import numpy as np


def halved(
    triangles: np.ndarray, points: np.ndarray, marks: np.ndarray, news: np.ndarray
) -> np.ndarray:
    """Triangles split at points on some of their edges, turned as they were.

    `marks` are the edges as pairs of points, `news` the new point on each.
    """
    count = len(points)
    keys = np.sort(marks, axis=1) @ [count, 1]
    order = np.argsort(keys)
    keys, news = keys[order], news[order]
    sides = triangles[:, [[0, 1], [1, 2], [2, 0]]]
    wanted = np.sort(sides, axis=2) @ [count, 1]
    place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    middle = np.where(keys[place] == wanted, news[place], -1)
    marked = (middle >= 0).sum(axis=1)
    parts = [triangles[marked == 0]]
    for number, split in ((1, _in_two), (2, _in_three), (3, _in_four)):
        chosen = marked == number
        if chosen.any():
            parts += split(triangles[chosen], middle[chosen], points)
    return np.concatenate(parts)


def _turned(
    triangles: np.ndarray, middle: np.ndarray, first: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles and the middles of their edges, counted from another corner."""
    order = (first[:, None] + np.arange(3)) % 3
    return tuple(np.take_along_axis(own, order, axis=1) for own in (triangles, middle))  # type: ignore[return-value]


def _in_two(triangles: np.ndarray, middle: np.ndarray, points: np.ndarray) -> list[np.ndarray]:
    triangles, middle = _turned(triangles, middle, np.argmax(middle >= 0, axis=1))
    (a, b, c), d = triangles.T, middle[:, 0]
    return [np.stack(own, axis=1) for own in ((a, d, c), (d, b, c))]


def _in_three(triangles: np.ndarray, middle: np.ndarray, points: np.ndarray) -> list[np.ndarray]:
    """The corner between the two edges is cut off; the rest is cut along its shorter diagonal."""
    triangles, middle = _turned(triangles, middle, (np.argmin(middle, axis=1) + 1) % 3)
    (a, b, c), (d, e, _) = triangles.T, middle.T
    one, other = (np.linalg.norm(points[p] - points[q], axis=1) for p, q in ((a, e), (d, c)))
    is_one = (one <= other)[:, None]
    first = np.where(is_one, np.stack([a, d, e], axis=1), np.stack([a, d, c], axis=1))
    second = np.where(is_one, np.stack([a, e, c], axis=1), np.stack([d, e, c], axis=1))
    return [np.stack([d, b, e], axis=1), first, second]


def _in_four(triangles: np.ndarray, middle: np.ndarray, points: np.ndarray) -> list[np.ndarray]:
    (a, b, c), (d, e, f) = triangles.T, middle.T
    return [np.stack(own, axis=1) for own in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))]
