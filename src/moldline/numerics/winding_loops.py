"""Compiled loops of winding numbers."""

import numba
import numpy as np

_compiled = numba.njit(nogil=True, cache=True, error_model="numpy")


@_compiled
def winding(points, corners, out, part, start, stop):
    """How often closed triangles (t, 3, 3) go around each point.

    Source: Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 1983.
    """
    for n in range(start, stop):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        total = 0.0
        for t in range(len(corners)):
            ax, ay, az = corners[t, 0, 0] - x, corners[t, 0, 1] - y, corners[t, 0, 2] - z
            bx, by, bz = corners[t, 1, 0] - x, corners[t, 1, 1] - y, corners[t, 1, 2] - z
            cx, cy, cz = corners[t, 2, 0] - x, corners[t, 2, 1] - y, corners[t, 2, 2] - z
            a = np.sqrt(ax * ax + ay * ay + az * az)
            b = np.sqrt(bx * bx + by * by + bz * bz)
            c = np.sqrt(cx * cx + cy * cy + cz * cz)
            volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            ab, bc, ca = (
                ax * bx + ay * by + az * bz,
                bx * cx + by * cy + bz * cz,
                ax * cx + ay * cy + az * cz,
            )
            total += np.arctan2(volume, a * b * c + ab * c + bc * a + ca * b)
        out[n] = total / (2 * np.pi)
