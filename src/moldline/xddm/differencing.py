"""Derivatives of what somebody else's program makes, by running it at perturbed variables."""

import re
import time
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from ..errors import FileError, GeometryError, MoldlineError
from ..mesh import Surface
from ..numerics.threads import cores
from ..workers import AbstractExecutor, Threads
from .asked import asking, differentiated
from .chain import Quantity
from .edit import Edit
from .exchange import SURFACE, Answer, Linearised
from .model import Design, Value
from .steps import Stencil, stencil
from .wrapper import LIMIT, Program, Reply, Run, program, run

FOLDER = "differences"
"""Of all runs, each in a folder of its own, within the one of the answer."""


class _Step(NamedTuple):
    """A perturbed variable."""

    variable: Value
    change: float
    folder: Path


def differenced(
    design: Design,
    source: Design,
    folder: Path,
    limit: float = LIMIT,
    executor: AbstractExecutor | None = None,
) -> Answer:
    """The answer of a Model's Wrapper to a request, with the derivatives that it does not give.

    Those are differences: see `steps.stencil`. A variable with the Comment FD or oFD is always
    differenced. `source` is the Model whose Wrapper is run, by default as often at the same time as
    there are cores. All runs stay in the folder, each with its log; an executor on other machines
    must see it, too, or they stay there.
    """
    command, place = program(source, limit), folder.absolute() / FOLDER
    workers = executor or Threads(cores())
    wanted = {value: stencil(value) for value in differentiated(design)}
    first = {"base": Run(command, design.document.data, place / "base")}
    ((_, base),) = _made(workers, design, first)
    own = _own_columns(design, base)
    lacking = [value for value in wanted if _lacks(value, own, design, base)]
    steps = [
        _Step(value, change, place / _folder(number, value, change))
        for number, value in enumerate(lacking, start=1)
        for change in wanted[value].changes
    ]
    start = time.perf_counter()
    replies = _replies(workers, command, design, steps, base)
    took = time.perf_counter() - start
    columns = {v.name: own[v.name] for v in wanted if v.name in own}
    slopes: dict[str, dict[str, float]] = {}
    for value in lacking:
        found = [replies[one] for one in steps if one.variable is value]
        if value.name not in own:
            columns[value.name] = _column(base, found, wanted[value])
        slopes[value.name] = _slopes(base, found, wanted[value])
    surface = Linearised(base.linearised.surface, {v.name: columns[v.name] for v in wanted})
    answer = Answer(
        design,
        {source.target.id or "model": surface},
        _results(design, base, list(wanted), slopes),
        notes=(*_cost(len(steps), lacking, took, own), *_silent(design, base)),
    )
    return answer.completed()


def _own_columns(design: Design, base: Reply) -> dict[str, np.ndarray]:
    """Derivatives that the program gives itself, by full names."""
    given = {_bracketless(name): column for name, column in base.linearised.columns.items()}
    found: dict[str, np.ndarray] = {}
    for value in design.variables:
        for name in (value.name, value.id):
            if value.differencing is None and _bracketless(name) in given:
                found.setdefault(value.name, given[_bracketless(name)])
    return found


def _bracketless(name: str) -> str:
    return re.sub(r"[\[\],]", "_", re.sub(r"\s", "", name))


def _lacks(value: Value, own: dict[str, np.ndarray], design: Design, base: Reply) -> bool:
    """Whether a derivative of the surface or of a result is not the program's own."""
    results = [base.results.get(analysis.name) for analysis in design.analyses]
    return value.name not in own or any(
        value.name not in (result.gradient or {}) for result in results if result is not None
    )


def _folder(number: int, value: Value, change: float) -> str:
    name = re.sub(r"[^\w.-]+", "_", value.id)[:40]
    return f"{number:03}_{name}/{'plus' if change > 0 else 'minus'}_{abs(change):.6g}"


def _replies(
    workers: AbstractExecutor,
    command: Program,
    design: Design,
    steps: Sequence[_Step],
    base: Reply,
) -> dict[_Step, Reply]:
    """Run all; the first that fails stops the others."""
    quiet = Design(asking(design.document, False))
    named = {f"{s.variable.name} = {s.variable.value:g} {s.change:+g}": s for s in steps}
    runs = {
        name: Run(command, _perturbed(quiet, step), step.folder) for name, step in named.items()
    }
    replies: dict[_Step, Reply] = {}
    with (
        closing(_made(workers, design, runs)) as made,
        tqdm(total=len(runs), desc="differences", unit="runs", delay=2, leave=False) as bar,
    ):
        for name, reply in made:
            step = named[name]
            place = f"{design.document.path}: {name}: {step.folder}"
            surface = reply.linearised.surface
            _check(base.linearised.surface, surface, f"{place}/{SURFACE}")
            for lost in base.results.keys() - reply.results.keys():
                raise FileError(f"{place}: {lost} has no Value, at the base it has one")
            replies[step] = reply
            bar.update()
    return replies


def _perturbed(quiet: Design, step: _Step) -> bytes:
    """The request with one other value."""
    edit = Edit()
    element = quiet.by_name[step.variable.name].element
    edit.set_number(element, "Value", (step.variable.value or 0.0) + step.change)
    return quiet.document.edited(edit).data


def _made(
    workers: AbstractExecutor, design: Design, runs: Mapping[str, Run]
) -> Generator[tuple[str, Reply], None, None]:
    """What comes of runs, as they end; an error says of which."""
    with closing(workers.run(run, runs)) as outcomes:
        for outcome in outcomes:
            if isinstance(outcome.error, MoldlineError | OSError):
                raise FileError(f"{design.document.path}: {outcome.name}: {outcome.error}")
            if outcome.error is not None:
                raise outcome.error
            yield outcome.name, outcome.value


def _check(base: Surface, other: Surface, place: str) -> None:
    """Refuse a surface with other triangles, whose points cannot be compared."""
    counts = [(len(s.points), len(s.faces)) for s in (base, other)]
    if counts[0] != counts[1]:
        what = "has {} points and {} triangles, at the base there are {} and {}".format(
            *counts[1], *counts[0]
        )
    elif n := int(np.count_nonzero(np.any(base.faces != other.faces, axis=1))):
        what = f"joins {n} of its {counts[0][1]} triangles otherwise than at the base"
    elif not np.isfinite(np.asarray(other.points)).all():
        what = "has points that are not finite"
    else:
        return
    raise GeometryError(
        f"{place}: {what}: its program must keep the connectivity where variables change little; "
        "fix its tessellation, or give a smaller FDstep"
    )


def _column(base: Reply, found: Sequence[Reply], weights: Stencil) -> np.ndarray:
    """The derivative of the points."""
    rest = np.asarray(base.linearised.surface.points)
    moves = [np.asarray(reply.linearised.surface.points) - rest for reply in found]
    return np.asarray(sum(w * move for w, move in zip(weights.weights, moves, strict=True)))


def _slopes(base: Reply, found: Sequence[Reply], weights: Stencil) -> dict[str, float]:
    """The derivative of each result."""
    return {
        name: sum(
            weight * (reply.results[name].value - result.value)
            for weight, reply in zip(weights.weights, found, strict=True)
        )
        for name, result in base.results.items()
    }


def _results(
    design: Design, base: Reply, wanted: Sequence[Value], slopes: dict[str, dict[str, float]]
) -> dict[str, Quantity]:
    """Results that the request asks for; the program's own derivatives before differences."""
    found = {}
    for analysis in design.analyses:
        result = base.results.get(analysis.name)
        if result is None:
            continue
        own = result.gradient or {}
        gradient = {
            v.name: own[v.name]
            if v.name in own and v.differencing is None
            else slopes[v.name][analysis.name]
            for v in wanted
        }
        found[analysis.name] = Quantity(result.value, gradient if wanted else None)
    return found


def _cost(
    runs: int, lacking: Sequence[Value], took: float, own: dict[str, np.ndarray]
) -> list[str]:
    if not lacking:
        return [f"{len(own)} derivatives are the program's own"] if own else []
    return [
        f"{len(lacking)} variables by differences: {runs} runs in {took:.3g} s, "
        f"{took / len(lacking):.3g} s per variable"
    ]


def _silent(design: Design, base: Reply) -> list[str]:
    return [
        f"{value.name} got no Value from its program"
        for value in design.analyses
        if value.name not in base.results and value.element.first("AeroFun") is None
    ]
