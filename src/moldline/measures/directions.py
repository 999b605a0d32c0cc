"""Directions by name or by numbers."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ..errors import ParameterError


def directions(along: str | Sequence[float] | None) -> Float[np.ndarray, "k 3"]:
    """Unit vectors: of axes such as "z" or "xz", of one vector; all three axes by default."""
    if along is None:
        return np.eye(3)
    if isinstance(along, str):
        if not along or not set(along) <= set("xyz"):
            raise ParameterError(f"directions are of x, y and z, such as 'xz', got {along!r}")
        return np.eye(3)[["xyz".index(name) for name in along]]
    return direction(along)[None]


def direction(along: str | Sequence[float]) -> Float[np.ndarray, "3"]:
    """One unit vector."""
    if isinstance(along, str):
        return directions(along)[0]
    vector = np.asarray(along, float)
    length = np.linalg.norm(vector) if vector.shape == (3,) else 0.0
    if not np.isfinite(length) or length == 0:
        raise ParameterError(f"a direction is a vector of length above zero, got {along}")
    return vector / length
