"""Compiled loops of mean value coordinates."""

import numba
import numpy as np

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy")

CLOSE = 1e-12
"""A point this near to a vertex or a face, in sizes of the cage, lies on it."""


@_compiled
def weights(points, corners, faces, size, out, part, start, stop):
    """Weights of the corners at points, whatever side of the cage they are on."""
    count = len(corners)
    unit, length = np.empty((count, 3)), np.empty(count)
    edge, angle, cosine, sine = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for n in range(start, stop):
        own = out[n]
        own[:] = 0.0
        at_corner, on_face = -1, -1
        for j in range(count):
            square = 0.0
            for d in range(3):
                unit[j, d] = corners[j, d] - points[n, d]
                square += unit[j, d] ** 2
            length[j] = np.sqrt(square)
            if length[j] <= CLOSE * size:
                at_corner = j
                break
            for d in range(3):
                unit[j, d] /= length[j]
        if at_corner >= 0:
            own[at_corner] = 1.0
            continue
        for t in range(len(faces)):
            half = 0.0
            for i in range(3):
                p, q = faces[t, (i + 1) % 3], faces[t, (i + 2) % 3]
                square = 0.0
                for d in range(3):
                    square += (unit[p, d] - unit[q, d]) ** 2
                edge[i] = np.sqrt(square)
                angle[i] = 2 * np.arcsin(min(1.0, edge[i] / 2))
                half += angle[i] / 2
            a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
            volume = (
                unit[a, 0] * (unit[b, 1] * unit[c, 2] - unit[b, 2] * unit[c, 1])
                + unit[a, 1] * (unit[b, 2] * unit[c, 0] - unit[b, 0] * unit[c, 2])
                + unit[a, 2] * (unit[b, 0] * unit[c, 1] - unit[b, 1] * unit[c, 0])
            )
            if np.pi - half < FLAT:
                on_face = t
                break
            if abs(volume) < FLAT:
                continue  # outside, in the plane of the face
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                cosine[i] = (
                    2
                    * np.sin(half)
                    * np.sin(half - angle[i])
                    / (np.sin(angle[j]) * np.sin(angle[k]))
                    - 1
                )
                sine[i] = np.sqrt(max(0.0, 1 - cosine[i] ** 2)) * (1.0 if volume > 0 else -1.0)
            if min(abs(sine[0]), abs(sine[1]), abs(sine[2])) < FLAT:
                continue
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                own[faces[t, i]] += (angle[i] - cosine[j] * angle[k] - cosine[k] * angle[j]) / (
                    length[faces[t, i]] * np.sin(angle[j]) * sine[k]
                )
        if on_face >= 0:
            own[:] = 0.0
            for i in range(3):
                j, k = faces[on_face, (i + 1) % 3], faces[on_face, (i + 2) % 3]
                square = 0.0
                for d in range(3):
                    square += (unit[j, d] - unit[k, d]) ** 2
                turn = 2 * np.arcsin(min(1.0, np.sqrt(square) / 2))
                own[faces[on_face, i]] = np.sin(turn) * length[j] * length[k]
        total = own.sum()
        for j in range(count):
            own[j] /= total


FLAT = 1e-9
"""A solid angle this near to half the sphere, or to none, is a flat one."""
