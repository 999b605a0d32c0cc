"""Sine bumps along a chord, in JAX, and a shear, in plain NumPy."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import moldline as ml
from moldline.errors import ParameterError


class SineBumps(ml.AbstractDeformer):
    """Bend a chord along z by sine bumps; its two ends stay. Controls are bump heights [m].

    Source: Hicks and Henne, J. Aircraft 15 (7), 1978.
    """

    crests: np.ndarray  # where each bump is highest, as a fraction of chord
    nose: float = 0.0
    chord: float = 1.0
    sharpness: float = eqx.field(default=3.0, static=True)

    def __check_init__(self):
        if not np.all((np.asarray(self.crests) > 0) & (np.asarray(self.crests) < 1)):
            raise ParameterError(f"crests must lie inside (0, 1) of chord, got {self.crests}")

    @property
    def size(self):
        return len(self.crests)

    def bind(self, points):
        x = jnp.clip((points[:, 0] - self.nose) / self.chord, 1e-9, 1.0)
        s = jnp.log(0.5) / jnp.log(jnp.asarray(self.crests))
        height = jnp.sin(jnp.pi * x[:, None] ** s) ** self.sharpness
        modes = jnp.zeros((len(x), 3, self.size)).at[:, 2].set(height)
        return ml.LinearBinding(points, modes)  # points + modes @ controls


class Shear(ml.AbstractNumpyDeformer):
    """Shift x in proportion to y, as sweep does. The control is the tangent of the sweep angle."""

    @property
    def size(self):
        return 1

    def move(self, points, controls):
        moved = points + 0 * controls[0]  # a copy of the right type, complex where it must be
        moved[:, 0] = points[:, 0] + controls[0] * points[:, 1]
        return moved
