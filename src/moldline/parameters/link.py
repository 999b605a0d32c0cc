"""Links: affine maps from a variable's numbers to a deformer's controls."""

from typing import Literal

import equinox as eqx
import numpy as np
from jaxtyping import Float

from .._types import Array
from ..errors import ParameterError

Across = Literal["x", "y", "z"]


class Link(eqx.Module):
    """Controls are the matrix times the variable, less what the variable is at rest.

    Attributes
    ----------
    matrix
        Shape (k, v): k controls, v numbers of the variable [control unit per SI unit].
    across
        The plane of symmetry that this link respects (the coordinate that is 0 on it), if any:
        a stage all of whose links respect it keeps points on that plane there, to the bit.
    rest
        The controls that the variable's numbers at rest would give; zero where it is left out.
    """

    matrix: Float[Array, "k v"]
    across: Across | None = eqx.field(static=True, default=None)
    rest: Float[Array, "k"] | None = None

    def __check_init__(self) -> None:
        if not np.all(np.isfinite(np.asarray(self.matrix))):
            raise ParameterError("a link's matrix must be finite")

    def __call__(self, numbers: Float[Array, "v"]) -> Float[Array, "k"]:
        """Controls, counted from the neutral ones."""
        turned = self.matrix @ numbers
        return turned if self.rest is None else turned - self.rest

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
        return Link(self.matrix + other.matrix, both, _sum(self.rest, other.rest))

    def __mul__(self, factor: float) -> "Link":
        """The same motion, scaled."""
        return Link(self.matrix * factor, self.across, _scaled(self.rest, factor))

    __rmul__ = __mul__

    def __matmul__(self, mix: Float[Array, "v w"]) -> "Link":
        """The same controls turned by other numbers: variable = mix @ other."""
        return Link(self.matrix @ np.asarray(mix, float), self.across, self.rest)


def _sum(one: Array | None, other: Array | None) -> Array | None:
    return other if one is None else one if other is None else one + other


def _scaled(rest: Array | None, factor: float) -> Array | None:
    return None if rest is None else rest * factor
