"""One step of a pipeline: a deformer, and the links that turn variables into its controls."""

from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._types import Array, Points, Vector
from ..deformers.base import AbstractBinding, AbstractDeformer
from ..errors import GeometryError, ParameterError
from ..parameters.link import Across, Link
from ..parameters.variable import Variable


class Stage(eqx.Module):
    """A deformer with its links.

    Attributes
    ----------
    deformer
        What moves the points.
    links
        For each variable the link to the deformer's controls; what several variables do adds up.
    on
        Name of the geometry that it acts on; "" is the only one of a pipeline.
    name
        What reports call it.
    carried
        Whether the stages before it carry it along, as a child box is by its parent: its points are
        bound where they are at rest, and its displacements add to what those stages do.
    """

    deformer: AbstractDeformer
    links: dict[Variable, Link]
    on: str = eqx.field(static=True)
    name: str = eqx.field(static=True)
    carried: bool = eqx.field(static=True)

    def __init__(
        self,
        deformer: AbstractDeformer,
        links: Mapping[Variable, Link],
        on: str = "",
        name: str = "",
        carried: bool = False,
    ):
        self.deformer = deformer
        self.links = dict(links)
        self.on = on
        self.name = name or type(deformer).__name__.lower()
        self.carried = carried

    def __check_init__(self) -> None:
        check_links(self.name, self.links, self.deformer.size)

    @property
    def across(self) -> Across | None:
        """The plane of symmetry that all links respect, if there is one."""
        planes = {link.across for link in self.links.values()}
        return planes.pop() if len(planes) == 1 else None

    @property
    def settles(self) -> bool:
        """Whether the deformer must see the present surface before it knows its controls."""
        return type(self.deformer).settle is not AbstractDeformer.settle

    def controls(self, values: Mapping[str, Float[Array, "v"]]) -> Vector:
        """Controls from the variables' values, given in the designer's units."""
        return turned(self.deformer.neutral, self.links, values)

    def bind(self, geometry: str, points: Points) -> AbstractBinding:
        """The deformer tied to the points of a geometry, whose name an error gives."""
        try:
            return self.deformer.bind(points)
        except GeometryError as error:
            raise GeometryError(f"stage {self.name!r} on {geometry!r}: {error}") from None

    def held(self, rest: Points, present: Points, moved: Points) -> Points:
        """Points that rest on the plane of symmetry, not moved across it by this stage.

        This only undoes rounding; where a stage before has taken them off it, there they stay.
        """
        if self.across is None:
            return moved
        axis = "xyz".index(self.across)
        across = jnp.where(rest[:, axis] == 0.0, present[:, axis], moved[:, axis])
        return jnp.asarray(moved).at[:, axis].set(across)


class Step(NamedTuple):
    """What moves points in a stage, at some values of the variables.

    Attributes
    ----------
    stage
        Whose step it is.
    deformer
        The deformer that acts in the end: of a skeleton or of pilots the hidden one.
    controls
        Its controls.
    """

    stage: Stage
    deformer: AbstractDeformer
    controls: Vector

    def after(self, rest: Points, present: Points) -> Points:
        """Where it takes points from where they are at rest and at present."""
        if self.stage.carried:
            return present + (self.deformer.follow(rest, self.controls) - rest)
        return self.deformer.follow(present, self.controls)


def check_links(name: str, links: Mapping[Variable, Link], size: int) -> None:
    """Refuse links of a stage that were made for another number of controls or of variables."""
    for variable, link in links.items():
        rows = link.matrix.shape[0]
        if rows != size:
            raise ParameterError(
                f"stage {name!r}: the link of variable {variable.name!r} is for {rows} controls, "
                f"the stage has {size}; was it made for another?"
            )
        if link.size != variable.size:
            raise ParameterError(
                f"stage {name!r}: the link of variable {variable.name!r} takes {link.size} "
                f"numbers, the variable has {variable.size}; make its size {link.size}"
            )
    rests = {v.name: np.asarray(k.rest) for v, k in links.items() if k.rest is not None}
    if rests and np.any(np.count_nonzero([*rests.values()], axis=0) > 1):
        raise ParameterError(
            f"stage {name!r}: of {', '.join(map(repr, rests))} more than one is what the same "
            "parameter measures (absolute); let the others be changes of it"
        )


def turned(
    neutral: Vector, links: Mapping[Variable, Link], values: Mapping[str, Float[Array, "v"]]
) -> Vector:
    """Controls from the variables' values, given in the designer's units."""
    total = jnp.asarray(neutral)
    for variable, link in links.items():
        total = total + link(values[variable.name] * variable.factor)
    return total
