"""Order of triangles along a space-filling curve, and the tree of boxes that stands on it."""

import numpy as np
from jaxtyping import Float, Int


def along_curve(places: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, "n"]:
    """Order of points along Morton's curve, 2²¹ steps a side."""
    low = places.min(axis=0)
    size = (places - low).max() or 1.0
    code = np.zeros(len(places), np.uint64)
    steps = ((places - low) / size * (2**21 - 1)).astype(np.uint64)
    for axis in range(3):
        bits = steps[:, axis]
        for shift, mask in (
            (32, 0x1F00000000FFFF),
            (16, 0x1F0000FF0000FF),
            (8, 0x100F00F00F00F00F),
            (4, 0x10C30C30C30C30C3),
            (2, 0x1249249249249249),
        ):
            bits = (bits | bits << np.uint64(shift)) & np.uint64(mask)
        code |= bits << np.uint64(axis)
    return np.argsort(code, kind="stable")


def leaves(count: int, leaf: int) -> int:
    """Leaves of the complete binary tree over so many triangles, `leaf` in each: a power of 2."""
    return 1 << max(-(-count // leaf) - 1, 0).bit_length()
