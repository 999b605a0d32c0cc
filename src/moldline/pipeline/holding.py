"""Whether pilots hold what they are asked for."""

from dataclasses import dataclass

import numpy as np

from ..deformers.pilots import PilotReport, Pilots
from .pipeline import Pipeline, Values

MOST_NAMES = 6
"""Names that a sentence lists."""


STRAINED = 10.0
"""Control points that move this many times as far as what they hold are too few."""


@dataclass(frozen=True)
class Holding:
    """How well a stage's pilots and constraints are met.

    Attributes
    ----------
    stage
        Its name.
    conditions
        Numbers that are prescribed or bounded.
    controls
        Controls of the hidden deformer.
    report
        What its solver found.
    """

    stage: str
    conditions: int
    controls: int
    report: PilotReport

    @property
    def is_met(self) -> bool:
        """Whether all is held; it may still not be smooth there."""
        return self.report.status in ("met", "not smooth")

    @property
    def worst(self) -> float:
        """The largest miss, in the measures' own units."""
        return max(float(np.abs(miss).max(initial=0.0)) for miss in self.report.misses.values())

    def sentences(self) -> list[str]:
        """What was found, and what to do about it."""
        found, steps = self.report, self.report.iterations
        lines = [
            f"stage {self.stage!r}: {self.conditions} conditions on {self.controls} hidden "
            f"controls: {found.status}, {steps} step{'' if steps == 1 else 's'}, largest miss "
            f"{self.worst:.1e}"
        ]
        if found.active:
            lines.append(f"held by a bound: {_listed(found.active)}")
        if found.unmet:
            lines.append(
                f"! unmet: {_listed(found.unmet)}; they contradict each other, or the hidden "
                "deformer is too coarse for them: give it more control points, or drop one"
            )
        elif found.strain > STRAINED:
            lines.append(
                f"! hidden control points move {found.strain:.3g} times as far as what is held: "
                "pilots are too near to each other for them; give more of them, or fewer pilots"
            )
        if found.dependent and not found.unmet:
            lines.append(f"implied by others: {_listed(found.dependent)}")
        if found.status == "not converged":
            lines.append("! ask for less at once, or for smaller steps: step = 0.5")
        if found.status == "not smooth":
            lines.append(
                "! a small change may take the shape elsewhere: derivatives hold on one side only"
            )
        return lines

    def as_dict(self) -> dict:
        """For a script."""
        found = self.report
        return {
            "stage": self.stage,
            "status": found.status,
            "iterations": found.iterations,
            "curvature": found.curvature,
            "strain": found.strain,
            "misses": {name: miss.tolist() for name, miss in found.misses.items()},
            "unmet": list(found.unmet),
            "active": list(found.active),
            "dependent": list(found.dependent),
        }


def holding(pipeline: Pipeline, values: Values | None = None) -> list[Holding]:
    """How well the pilots of each stage are met, also on what the result is made from."""
    here = pipeline.at(values)
    return [held for name in here.feeding for held in _own_holding(here.of(name), values)]


def _own_holding(pipeline: Pipeline, values: Values | None) -> list[Holding]:
    full = pipeline.values(values)
    rest = np.asarray(pipeline.source(full))
    is_fixed = pipeline.branches[pipeline.leading].is_fixed
    steps = pipeline.steps(full)
    present, found = rest, []
    for number, step in enumerate(steps):
        pilots, stage = step.stage.deformer, step.stage
        is_first = number == 0 or steps[number - 1].stage is not stage
        if isinstance(pilots, Pilots) and is_first:
            is_bound = is_fixed and (number == 0 or stage.carried)
            shape = None if is_bound else rest if stage.carried else present
            report = pilots.report(np.asarray(stage.controls(full)), shape)
            count = sum(measure.size for measure in pilots.measures)
            found.append(Holding(stage.name, count, pilots.net.size, report))
        present = np.asarray(step.after(rest, present))
    return found


def _listed(names: tuple[str, ...]) -> str:
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
