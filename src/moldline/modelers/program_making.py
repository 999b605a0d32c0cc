"""A program tied to the geometry that it takes."""

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import numpy as np
from typing_extensions import override

from .._types import Array, Vector, is_concrete
from ..mesh import Geometry
from ..numerics.step_control import Slope
from .base import AbstractMaking
from .program_kernels import Values
from .program_slopes import Change


class ProgramMaking(AbstractMaking):
    """Parameters and moved points in, the program's points out.

    JAX differentiates it forwards, and backwards by the parameters. By the points of the file in
    it is known by directions only.

    Attributes
    ----------
    geometry
        What it makes of its own values.
    kernel
        What runs it.
    """

    geometry: Geometry
    kernel: Values = eqx.field(static=True)

    @override
    def __call__(self, parameters: Vector, *points: Array) -> Array:
        return self.kernel(parameters, *points)[0]

    @property
    @override
    def is_foreign(self) -> bool:
        return True

    @override
    def along(
        self,
        parameters: Vector,
        points: Sequence[Array],
        changes: Sequence[tuple[Vector, Sequence[Array]]],
    ) -> list[Array]:
        given = (parameters, *points)
        if not is_concrete(*given, *jax.tree.leaves(changes)):
            return [jax.jvp(self, given, (change, *moves))[1] for change, moves in changes]
        found = self.kernel.slopes.motions(
            np.array(parameters, float),
            np.array(points[0], float) if points else None,
            [
                Change(np.array(change, float), np.array(moves[0], float) if moves else None)
                for change, moves in changes
            ],
        )
        return list(found)

    @property
    def accuracy(self) -> Mapping[str, Slope]:
        """By parameter, and "points of the file in": step and about the error of the last slope."""
        return self.kernel.slopes.found
