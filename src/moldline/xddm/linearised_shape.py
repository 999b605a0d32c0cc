"""A surface known with its derivatives only, as a modeler whose parameters are the variables."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector
from ..mesh import Geometry, Surface
from ..modelers.base import AbstractShape
from .exchange import Linearised


class LinearisedShape(AbstractShape):
    """What somebody else's program made at one place, and how it changes about that.

    At that place points and derivatives are the program's; farther off it is a tangent.

    Attributes
    ----------
    surface
        At that place [m].
    slopes
        Derivatives of the points, by each parameter.
    start
        The parameters there.
    names
        Of the parameters, in order.
    """

    surface: Surface
    slopes: Float[Array, "n 3 v"]
    start: Float[Array, "v"]
    names: tuple[str, ...] = eqx.field(static=True)

    def __init__(self, linearised: Linearised, values: dict[str, float]):
        """`values` are those of the variables at that place, by their names."""
        self.surface = linearised.surface
        self.names = tuple(linearised.columns)
        shape = (*np.shape(linearised.surface.points), len(self.names))
        columns = [np.asarray(column) for column in linearised.columns.values()]
        self.slopes = np.stack(columns, axis=-1) if columns else np.zeros(shape)
        self.start = np.array([values[name] for name in self.names])

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return {name: np.array([k]) for k, name in enumerate(self.names)}

    @property
    @override
    def values(self) -> Vector:
        return self.start

    @property
    @override
    def geometry(self) -> Geometry:
        return self.surface

    @override
    def __call__(self, parameters: Vector) -> Points:
        return jnp.asarray(self.surface.points) + self.slopes @ (parameters - self.start)
