"""What a hand can move in the stages of a case, and where values put it."""

from collections.abc import Mapping
from functools import cached_property

import jax.numpy as jnp
import numpy as np
import scipy.sparse

from .._types import Array
from ..case import Case
from ..deformers.control_volume import ControlVolume
from ..deformers.lattice import Lattice
from ..deformers.net import AbstractControlNet
from ..deformers.pilots import Pilots
from ..pipeline.stage import Stage, Step
from .fitting import Reach
from .marks import is_shown, marks_of

DIRECT = ("each", "named", "controls")
"""Links that give a number to each control: where a stage has some, a hand turns these alone."""


class Hand:
    """What can be moved in one stage, and how its numbers move it.

    Attributes
    ----------
    number
        Of the stage in the case file, from 0.
    stage
        What it is.
    kind
        "net", "bones" or "marks".
    lines, frozen, labels
        Of its points, or of its bones.
    variables
        Those whose numbers a hand turns.
    """

    def __init__(self, case: Case, number: int):
        stage = case.pipeline.stages[number]
        assert isinstance(stage, Stage)
        self.number, self.stage = number, stage
        self._table = case.tables.stage[number]
        self._pipeline = case.pipeline.of(stage.on)
        self._place = [own is stage for own in self._pipeline.own_stages].index(True)
        net = stage.deformer if isinstance(stage.deformer, AbstractControlNet) else None
        self._net = net
        self._marks = None if net is not None else marks_of(stage, self._is_bound)
        self.kind = "net" if self._marks is None else self._marks.kind
        if net is not None:
            self.lines, self.labels = net.lines, labels_of(net)
            self.frozen = np.ravel(net.frozen)
        else:
            assert self._marks is not None
            self.lines, self.labels = np.empty((0, 2), int), self._marks.labels
            self.frozen = np.zeros(len(self.labels), bool)
        chosen = {row.variable for row in self._table.link if row.link in DIRECT}
        self.variables = [v for v in stage.links if v.name in chosen or not chosen]

    def as_dict(self) -> dict[str, object]:
        """What does not change with the values."""
        return {
            "stage": self.number,
            "name": getattr(self._table, "name", None) or "",
            "deformer": getattr(self._table, "deformer", ""),
            "on": self.stage.on,
            "kind": self.kind,
            "labels": self.labels,
        }

    def rest(self, full: Mapping[str, Array]) -> np.ndarray:
        """Places before the stages, (p, 3)."""
        if self._net is not None:
            return np.asarray(self._net.rest, float).reshape(-1, 3)
        assert self._marks is not None
        return self._marks.rest(self._source(full))

    def places(self, full: Mapping[str, Array]) -> np.ndarray:
        """Where values put its points, (p, 3)."""
        controls = self.stage.controls(full)
        if self._net is not None:
            rest = np.asarray(self._net.rest, float).reshape(-1, 3)
            moves = np.asarray(self._net.moves(controls), float).reshape(-1, 3)
            return self._carried(rest, full) + moves
        assert self._marks is not None
        if isinstance(self.stage.deformer, Pilots):
            return self._marks.places(controls, *self._shapes(full))
        rest = self._marks.rest(None)
        return self._carried(rest, full) + (self._marks.places(controls, None, None) - rest)

    def slopes(self, full: Mapping[str, Array]) -> scipy.sparse.csc_array:
        """Motion of its points for a unit of each number a hand turns, (3 p, v)."""
        if self._net is not None:
            return self._fixed
        assert self._marks is not None
        is_seeing = isinstance(self.stage.deformer, Pilots)
        seen, present = self._shapes(full) if is_seeing else (None, None)
        slopes = self._marks.slopes(self.stage.controls(full), seen, present)
        return scipy.sparse.csc_array(slopes @ self._matrix)

    @property
    def is_linear(self) -> bool:
        """Whether one step finds what a hand asks for."""
        own = {variable.name for variable in self.variables}
        before = self._pipeline.own_stages[: self._place] if self.stage.carried else ()
        carriers = {v.name for stage in before for v in stage.links}
        return self._net is not None and not own & carriers

    @cached_property
    def reach(self) -> Reach:
        """The numbers that a hand turns, and how far they may go."""
        return Reach(self.variables)

    @cached_property
    def _matrix(self) -> np.ndarray:
        """Controls for a unit of each number, in the designer's unit, (k, v)."""
        parts = [np.asarray(self.stage.links[v].matrix) * v.factor for v in self.variables]
        return np.concatenate([np.zeros((self.stage.deformer.size, 0)), *parts], axis=1)

    @cached_property
    def _fixed(self) -> scipy.sparse.csc_array:
        """Of a net, whose points move by the controls themselves."""
        return scipy.sparse.csc_array(self._matrix * ~np.repeat(self.frozen, 3)[:, None])

    def _source(self, full: Mapping[str, Array]) -> np.ndarray:
        return np.asarray(self._pipeline.source(full))

    def _steps(self, full: Mapping[str, Array]) -> list[Step]:
        """What moves points before this stage."""
        before = self._pipeline.own_stages[: self._place]
        return [s for s in self._pipeline.steps(full) if any(s.stage is own for own in before)]

    def _carried(self, rest: np.ndarray, full: Mapping[str, Array]) -> np.ndarray:
        """Where the stages before take places along with the points; nowhere unless carried."""
        if not self.stage.carried or not self._place:
            return rest
        return self._after(rest, full)

    def _after(self, rest: np.ndarray, full: Mapping[str, Array]) -> np.ndarray:
        place: Array = jnp.asarray(rest)
        for step in self._steps(full):
            place = step.after(rest, place)
        return np.asarray(place)

    def _shapes(self, full: Mapping[str, Array]) -> tuple[np.ndarray, np.ndarray]:
        """Points of the geometry that the stage sees, and where they are before it."""
        rest = self._source(full)
        present = self._after(rest, full) if self._place else rest
        return (rest if self.stage.carried else present), present

    @property
    def _is_bound(self) -> bool:
        """Whether the stage acts on points where they are at rest."""
        branch = self._pipeline.branches[self._pipeline.result]
        return branch.is_fixed and (self._place == 0 or self.stage.carried)


def hands(case: Case) -> dict[int, Hand]:
    """Those of the stages on the result and on what it is made from, by the stage's number."""
    feeding, found = case.pipeline.feeding, {}
    for number, stage in enumerate(case.pipeline.stages):
        if not isinstance(stage, Stage) or stage.on not in feeding:
            continue
        if isinstance(stage.deformer, AbstractControlNet) or is_shown(stage.deformer):
            found[number] = Hand(case, number)
    return found


def labels_of(net: AbstractControlNet) -> list[str]:
    """Indices of control points as links take them."""
    count = int(np.prod(net.rest.shape[:-1]))
    if isinstance(net, Lattice):
        rows = np.stack(np.unravel_index(np.arange(count), net.shape), axis=1)
        return [",".join(map(str, row)) for row in rows.tolist()]
    if not isinstance(net, ControlVolume):
        return [str(number) for number in range(count)]
    found = [""] * count
    for box, numbers in reversed(list(enumerate(net.frame.index))):
        begin = [box] if len(net.frame.index) > 1 else []
        for index, number in np.ndenumerate(numbers):
            found[int(number)] = ",".join(map(str, [*begin, *index]))
    return found
