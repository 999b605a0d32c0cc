"""Deformers whose parameters pose a net of control points, which moves the geometry."""

import abc
from collections.abc import Callable

import equinox as eqx
import jax
from jaxtyping import Float
from typing_extensions import override

from .._types import Array, Points, Vector
from .base import AbstractBinding, AbstractDeformer
from .named import AbstractNamed


class AbstractPosed(AbstractNamed):
    """A deformer of named parameters in two phases: they move control points, these the geometry.

    What is asked of the second phase, speed and smoothness, is the net's.
    """

    net: eqx.AbstractVar[AbstractDeformer]
    """What moves the geometry."""

    @abc.abstractmethod
    def pose(self, controls: Vector) -> Float[Array, "n"]:
        """The net's controls; plain JAX, and exactly zero where the controls are."""

    @override
    def __call__(self, points: Points, controls: Vector) -> Points:
        return self.net(points, self.pose(controls))

    @override
    def bind(self, points: Points) -> AbstractBinding:
        return PosedBinding(jax.jit(lambda controls: self.pose(controls)), self.net.bind(points))

    @override
    def follow(self, points: Points, controls: Vector) -> Points:
        return self.net.follow(points, self.pose(controls))


class PosedBinding(AbstractBinding):
    """A net on fixed points, moved by the parameters that pose it."""

    pose: Callable[[Vector], Vector] = eqx.field(static=True)
    binding: AbstractBinding

    @override
    def __call__(self, controls: Vector) -> Points:
        return self.binding(self.pose(controls))
