"""Links: linear maps from a variable's numbers to a deformer's controls."""

from typing import Literal

import equinox as eqx
import numpy as np
from jaxtyping import Float

from .._types import Array
from ..errors import ParameterError

Across = Literal["x", "y", "z"]


class Link(eqx.Module):
    """Controls are the matrix times the variable.

    Attributes
    ----------
    matrix
        Shape (k, v): k controls, v numbers of the variable [control unit per SI unit].
    across
        The plane of symmetry that this link respects (the coordinate that is 0 on it), if any:
        a stage all of whose links respect it keeps points on that plane there, to the bit.
    """

    matrix: Float[Array, "k v"]
    across: Across | None = eqx.field(static=True, default=None)

    def __check_init__(self) -> None:
        if not np.all(np.isfinite(np.asarray(self.matrix))):
            raise ParameterError("a link's matrix must be finite")

    @property
    def size(self) -> int:
        """How many numbers the variable must have."""
        return self.matrix.shape[1]

    def __add__(self, other: "Link") -> "Link":
        """Both at once: the controls of the one plus the controls of the other."""
        if self.matrix.shape != other.matrix.shape:
            raise ParameterError(
                f"links of shapes {self.matrix.shape} and {other.matrix.shape} do not add"
            )
        both = self.across if self.across == other.across else None
        return Link(self.matrix + other.matrix, both)

    def __mul__(self, factor: float) -> "Link":
        """The same motion, scaled."""
        return Link(self.matrix * factor, self.across)

    __rmul__ = __mul__

    def __matmul__(self, mix: Float[Array, "v w"]) -> "Link":
        """The same controls turned by other numbers: variable = mix @ other."""
        return Link(self.matrix @ np.asarray(mix, float), self.across)
