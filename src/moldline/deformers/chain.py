"""Several deformers one after the other, as one; and what moves points in the end."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from typing_extensions import override

from .._types import Array, Points, Vector
from ..errors import ParameterError
from .base import AbstractBinding, AbstractDeformer
from .posed import AbstractPosed


class Chain(AbstractDeformer):
    """Each deformer acts on what those before it give; controls are those of all, in order."""

    parts: tuple[AbstractDeformer, ...]

    def __init__(self, parts: Sequence[AbstractDeformer]):
        self.parts = tuple(parts)
        if not self.parts:
            raise ParameterError("a chain needs one deformer at least")

    @property
    @override
    def size(self) -> int:
        return sum(part.size for part in self.parts)

    @property
    @override
    def neutral(self) -> Vector:
        return np.concatenate([np.asarray(part.neutral) for part in self.parts])

    @override
    def __call__(self, points: Points, controls: Vector) -> Points:
        for part, own in zip(self.parts, self.split(controls), strict=True):
            points = part(points, own)
        return points

    @override
    def bind(self, points: Points) -> AbstractBinding:
        return ChainBinding(self, self.parts[0].bind(points))

    @override
    def follow(self, points: Points, controls: Vector) -> Points:
        for part, own in zip(self.parts, self.split(controls), strict=True):
            points = part.follow(points, own)
        return points

    def split(self, controls: Vector) -> Sequence[Array]:
        """The controls of each."""
        ends = np.cumsum([part.size for part in self.parts])[:-1]
        return jnp.split(jnp.asarray(controls), ends)


class ChainBinding(AbstractBinding):
    """The first deformer bound, the others following."""

    chain: Chain
    first: AbstractBinding

    @override
    def __call__(self, controls: Vector) -> Points:
        own, *others = self.chain.split(controls)
        points = self.first(own)
        for part, controls_of_part in zip(self.chain.parts[1:], others, strict=True):
            points = part.follow(points, controls_of_part)
        return points


def plain(deformer: AbstractDeformer, controls: Vector) -> list[tuple[AbstractDeformer, Array]]:
    """The deformers that move points, in order, with their controls: of posed ones their nets."""
    if isinstance(deformer, AbstractPosed):
        return plain(deformer.net, deformer.pose(controls))
    if isinstance(deformer, Chain):
        parts = zip(deformer.parts, deformer.split(controls), strict=True)
        return [one for part, own in parts for one in plain(part, own)]
    return [(deformer, controls)]
