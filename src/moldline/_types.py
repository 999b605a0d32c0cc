"""Names for arrays by shape, and the one test for concrete values."""

from typing import Any, TypeAlias

import jax
import numpy as np
from jaxtyping import Float, Int

Array: TypeAlias = jax.Array | np.ndarray
"""Arrays of NumPy and of JAX are both welcome; what was read from a file is NumPy's."""

ArrayLike: TypeAlias = Any
"""An array, or nested lists of numbers."""

Points: TypeAlias = Float[Array, "n 3"]
Faces: TypeAlias = Int[Array, "m 3"]
Vector: TypeAlias = Float[Array, "k"]
Matrix: TypeAlias = Float[Array, "rows columns"]
Scalar: TypeAlias = float | Float[Array, ""]


def is_concrete(*arrays: Any) -> bool:
    """Whether all values can be looked at now, that is, outside `jax.jit` and `jax.grad`."""
    return not any(isinstance(array, jax.core.Tracer) for array in arrays)
