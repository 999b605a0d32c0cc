"""One geometry of a pipeline with the stages on it, and its compiled derivatives."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._types import Array, Points
from ..deformers.base import AbstractBinding
from ..deformers.chain import plain
from ..errors import GeometryError
from ..mesh import Geometry, Surface
from ..modelers.base import AbstractMaking
from .construction import Construction
from .stage import Stage, Step

Full = Mapping[str, Array]
"""A value of every variable."""


class Branch(eqx.Module):
    """A geometry, where it comes from, and the stages that deform it.

    Attributes
    ----------
    name
        Of the geometry.
    geometry
        Before the stages, at the variables' own values.
    construction, making
        What makes it; None for one that is given.
    stages
        In order.
    bindings
        The first stage and the carried ones tied to the points, by their place among the stages;
        none where the points move before the first stage.
    leader
        Of points that ride on a geometry, that geometry: pilots look at it.
    """

    name: str = eqx.field(static=True)
    geometry: Geometry
    construction: Construction | None
    making: AbstractMaking | None
    stages: tuple[Stage, ...]
    bindings: dict[int, AbstractBinding]
    leader: "Branch | None"

    def __init__(
        self,
        name: str,
        geometry: Geometry,
        stages: Sequence[Stage],
        construction: Construction | None = None,
        making: AbstractMaking | None = None,
        leader: "Branch | None" = None,
    ):
        self.name = name
        self.geometry = geometry
        self.construction = construction
        self.making = making
        self.stages = tuple(stages)
        self.leader = leader
        self.bindings = {
            number: stage.bind(name, geometry.points)
            for number, stage in enumerate(self.stages)
            if self.is_fixed and (number == 0 or stage.carried)
        }

    @property
    def is_fixed(self) -> bool:
        """Whether the points stay where they are before the first stage."""
        return self.construction is None or self.construction.is_fixed

    @property
    def is_foreign(self) -> bool:
        """Whether another program makes it: then it is differentiated by directions."""
        return self.making is not None and self.making.is_foreign

    @property
    def turned_by(self) -> set[str]:
        """Names of the variables of its own."""
        made = {} if self.construction is None else self.construction.links
        links = [made, *(stage.links for stage in self.stages)]
        return {variable.name for own in links for variable in own}

    @property
    def of(self) -> tuple[str, ...]:
        """Names of the geometries that it is made from."""
        return () if self.construction is None else self.construction.of

    @property
    def settles(self) -> bool:
        """Whether a stage must see the present surface."""
        return any(stage.settles for stage in self.stages)

    def remade(self, making: AbstractMaking) -> "Branch":
        """The same stages on what is made anew."""
        asked = [stage.name for stage in self.stages if stage.settles]
        if asked and not _same_faces(self.geometry, making.geometry):
            raise GeometryError(
                f"stage {asked[0]!r} holds points of {self.name!r} by their numbers, which is made "
                "anew at these values, with other points: let it act on the parts, before they "
                "are joined"
            )
        return Branch(self.name, making.geometry, self.stages, self.construction, making)

    def source(self, full: Full, made: Sequence[Array]) -> Array:
        """Points before the stages; `made` are those of the geometries that it is made from."""
        if self.is_fixed:
            return self.geometry.points
        assert self.construction is not None and self.making is not None
        return self.making(self.construction.controls(full), *made)

    def points(self, full: Full, made: Sequence[Array] = ()) -> Array:
        """Points behind the stages."""
        return self.deformed(full, self.source(full, made))

    def deformed(self, full: Full, rest: Array) -> Array:
        """Where the stages take the points of the source."""
        states = {self.name: (rest, rest)}
        if self.leader is not None and self.settles:
            own = self.leader.geometry.points
            states[self.leader.name] = (own, own)
        for number, stage in enumerate(self.stages):
            controls = stage.controls(full)
            moving = stage.deformer
            if stage.settles and not self._is_bound(number):
                seen = states[self.leader.name if self.leader is not None else self.name]
                moving, controls = stage.deformer.settle(seen[not stage.carried], controls)
            for name, (start, present) in states.items():
                of = self if name == self.name or self.leader is None else self.leader
                if number in of.bindings:
                    moved = of.bindings[number](controls)
                else:
                    moved = moving.follow(start if stage.carried else present, controls)
                if stage.carried and number > 0:
                    moved = present + (moved - start)
                states[name] = (start, stage.held(start, present, moved))
        return states[self.name][1]

    def steps(self, full: Full, rest: Points) -> list[Step]:
        """What moves points, stage by stage; pilots behind another stage see the present shape."""
        start = rest if self.leader is None else self.leader.geometry.points
        present, found = start, []
        for number, stage in enumerate(self.stages):
            moving, controls = stage.deformer, stage.controls(full)
            if stage.settles and not self._is_bound(number):
                moving, controls = moving.settle(start if stage.carried else present, controls)
            parts = plain(moving, controls)
            if stage.carried and len(parts) > 1:  # each part would be carried by itself
                parts = [(moving, controls)]
            own = [Step(stage, *part) for part in parts]
            found += own
            if self.settles:
                for step in own:
                    present = step.after(start, present)
        return found

    def push(
        self, full: Full, change: Full, made: Sequence[Array], moves: Sequence[Array]
    ) -> tuple[Array, Array]:
        """Points, and their motion for a change of the values and of what they are made from."""
        if self.is_foreign:
            rest = self.source(full, made)
            (motion,) = self.source_motions(full, [change], made, [moves])
        elif self.of:
            rest, motion = jax.jvp(self.source, (full, tuple(made)), (change, tuple(moves)))
        else:
            return self._push(full, change)
        return self._push_stages(full, change, rest, motion) if self.stages else (rest, motion)

    def motions(
        self,
        full: Full,
        changes: Sequence[Full],
        made: Sequence[Array],
        moves: Sequence[Sequence[Array]],
    ) -> list[Array]:
        """Motions of the points for several changes; a program runs for them at the same time."""
        both = list(zip(changes, moves, strict=True))
        if not self.is_foreign:
            return [self.push(full, change, made, own)[1] for change, own in both]
        found = self.source_motions(full, changes, made, moves)
        if not self.stages:
            return found
        rest = self.source(full, made)
        pairs = zip(changes, found, strict=True)
        return [self._push_stages(full, change, rest, own)[1] for change, own in pairs]

    def source_motions(
        self,
        full: Full,
        changes: Sequence[Full],
        made: Sequence[Array],
        moves: Sequence[Sequence[Array]],
    ) -> list[Array]:
        """The same before the stages, of what another program makes."""
        assert self.construction is not None and self.making is not None
        turn = self.construction.controls
        turns = [jax.jvp(turn, (full,), (change,))[1] for change in changes]
        return self.making.along(turn(full), made, list(zip(turns, moves, strict=True)))

    def pull_stages(
        self, full: Full, made: Sequence[Array], cotangent: Array
    ) -> tuple[dict[str, Array], Array]:
        """Cotangents of the values by the stages alone, and of the points before them."""
        if not self.stages:
            return {name: jnp.zeros_like(value) for name, value in full.items()}, cotangent
        found: tuple[dict[str, Array], Array] = self._pull_stages(
            full, self.source(full, made), cotangent
        )
        return found

    def pull(
        self, full: Full, made: Sequence[Array], cotangent: Array
    ) -> tuple[dict[str, Array], tuple[Array, ...]]:
        """Cotangents of the values and of what it is made from."""
        if not self.of:
            return self._pull(full, cotangent), ()
        rest, back = jax.vjp(self.source, full, tuple(made))
        if not self.stages:
            return back(cotangent)
        by_stages, at_rest = self._pull_stages(full, rest, cotangent)
        by_source, at_made = back(at_rest)
        return {name: by_stages[name] + by_source[name] for name in full}, at_made

    def _is_bound(self, number: int) -> bool:
        """Whether a stage acts on points where they are at rest."""
        return self.is_fixed and (number == 0 or self.stages[number].carried)

    # what is made from other geometries may change its connectivity: it is not compiled in

    @cached_property
    def _push(self) -> Callable[..., Any]:
        return jax.jit(lambda full, change: jax.jvp(self.points, (full,), (change,)))

    @cached_property
    def _pull(self) -> Callable[..., Any]:
        return jax.jit(lambda full, cotangent: jax.vjp(self.points, full)[1](cotangent)[0])

    @cached_property
    def _push_stages(self) -> Callable[..., Any]:
        return jax.jit(
            lambda full, change, rest, motion: jax.jvp(
                self.deformed, (full, rest), (change, motion)
            )
        )

    @cached_property
    def _pull_stages(self) -> Callable[..., Any]:
        return jax.jit(
            lambda full, rest, cotangent: jax.vjp(self.deformed, full, rest)[1](cotangent)
        )


def _same_faces(one: Geometry, other: Geometry) -> bool:
    """Whether the numbers of points mean the same in both."""
    if not isinstance(one, Surface) or not isinstance(other, Surface):
        return False
    return np.array_equal(np.asarray(one.faces), np.asarray(other.faces))
