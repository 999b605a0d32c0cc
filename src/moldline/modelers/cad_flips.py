"""Edges of a surface's triangles turned, where that makes rounder triangles."""

import numpy as np

ROUNDS = 60
"""More rounds than this change little."""


def rounder(
    triangles: np.ndarray,
    points: np.ndarray,
    uv: np.ndarray,
    kept: np.ndarray,
    most: float,
) -> np.ndarray:
    """Triangles with edges turned until opposite angles are 180 degrees or less together.

    `kept` are pairs of nodes whose edges stay; so do those where the turned pair would fold in
    (u, v), or would lie farther than `most` from the first.
    """
    triangles = triangles.copy()
    for _ in range(ROUNDS):
        chosen = _apart(triangles, *_to_turn(triangles, points, uv, kept, most))
        if not len(chosen):
            break
        (one, other), (a, b, c, d) = chosen[:, :2].T, chosen[:, 2:].T
        triangles[one] = np.stack([a, d, c], axis=1)
        triangles[other] = np.stack([d, b, c], axis=1)
    return triangles


def _to_turn(
    triangles: np.ndarray, points: np.ndarray, uv: np.ndarray, kept: np.ndarray, most: float
) -> tuple[np.ndarray, np.ndarray]:
    """Edges a-b of two triangles (a, b, c) and (b, a, d) to turn to c-d, and how much that helps.

    A row each: the two triangles, then a, b, c, d.
    """
    count = len(points)
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    keys = np.sort(ends, axis=1) @ [count, 1]
    order = np.argsort(keys, kind="stable")
    is_pair = np.append(keys[order][1:] == keys[order][:-1], False)
    is_pair &= ~np.isin(keys[order], np.sort(kept, axis=1) @ [count, 1])
    one, other = order[is_pair], order[np.flatnonzero(is_pair) + 1]
    (a, b), c = ends[one].T, triangles[one // 3, (one + 2) % 3]
    d = triangles[other // 3, (other + 2) % 3]
    gain = _angle(points, c, a, b) + _angle(points, d, a, b) - np.pi
    is_good = (gain > 1e-6) & (ends[other, 0] == b) & (c != d)
    is_good &= (_area(uv, a, d, c) > 0) & (_area(uv, d, b, c) > 0)
    is_good &= _gap(points, a, b, c, d) <= most
    rows = np.stack([one // 3, other // 3, a, b, c, d], axis=1)
    return rows[is_good], gain[is_good]


def _apart(triangles: np.ndarray, rows: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """Those of the edges that help most, no two of them in one triangle."""
    best = np.full(len(triangles), -np.inf)
    gain = gain + 1e-12 * np.arange(len(gain))  # no two are equal
    for k in (0, 1):
        np.maximum.at(best, rows[:, k], gain)
    return rows[(best[rows[:, 0]] == gain) & (best[rows[:, 1]] == gain)]


def _angle(points: np.ndarray, at: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    a, b = points[one] - points[at], points[other] - points[at]
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))


def _area(uv: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Twice the area, above a small part of what such edges could span."""
    one, other = uv[b] - uv[a], uv[c] - uv[a]
    size = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] - 1e-6 * size


def _gap(
    points: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray
) -> np.ndarray:
    """How far the edges a-b and c-d pass each other: the turned pair is that far off the first."""
    across = np.cross(points[b] - points[a], points[d] - points[c])
    height = np.abs(np.sum(across * (points[c] - points[a]), axis=1))
    return height / np.maximum(np.linalg.norm(across, axis=1), 1e-300)
