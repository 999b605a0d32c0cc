"""Deformers whose controls have names and measure something."""

import abc

import numpy as np

from .._types import Vector
from .base import AbstractDeformer


class AbstractNamed(AbstractDeformer):
    """A deformer of named parameters, such as the twist of a wing."""

    @property
    @abc.abstractmethod
    def parameters(self) -> dict[str, np.ndarray]:
        """Numbers of the controls by the name of what they change."""

    @property
    @abc.abstractmethod
    def values(self) -> Vector:
        """What the parameters measure at rest [m, rad, 1], one number for each control."""
