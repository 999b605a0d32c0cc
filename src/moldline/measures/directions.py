"""Directions by name or by numbers."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from ..errors import ParameterError

Way: TypeAlias = str | tuple[float, float, float]
"""A direction as a case file has it: the names of axes, or a vector."""

Along: TypeAlias = str | Sequence[float] | Float[np.ndarray, "3"]
"""A direction as Python has it."""


def directions(along: Along | None) -> Float[np.ndarray, "k 3"]:
    """Unit vectors: of axes such as "z" or "xz", of one vector; all three axes by default."""
    if along is None:
        return np.eye(3)
    if isinstance(along, str):
        if not along or not set(along) <= set("xyz"):
            raise ParameterError(f"directions are of x, y and z, such as 'xz', got {along!r}")
        return np.eye(3)[["xyz".index(name) for name in along]]
    return direction(along)[None]


def direction(along: Along) -> Float[np.ndarray, "3"]:
    """One unit vector."""
    if isinstance(along, str):
        if len(along) != 1:
            raise ParameterError(f"one direction is x, y or z, got {along!r}")
        return directions(along)[0]
    vector = np.asarray(along, float)
    length = np.linalg.norm(vector) if vector.shape == (3,) else 0.0
    if not np.isfinite(length) or length == 0:
        raise ParameterError(f"a direction is a vector of length above zero, got {along}")
    return vector / length
