"""What a pipeline made, in figures."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..mesh import Geometry, Surface, quality, topology
from ..modelers.wetting import Wetting
from .pipeline import Pipeline, Values


@dataclass(frozen=True)
class Making:
    """A geometry, and what is to be said of it.

    Attributes
    ----------
    geometry
        With its points in place.
    figures
        Counts and measures by name; area and volume of surfaces, the latter of closed ones.
    unions
        What those did that it is made by, by the name of what they made.
    anew
        What had to be made anew for the values, by name.
    """

    geometry: Geometry
    figures: dict[str, Any]
    unions: dict[str, dict[str, Any]]
    anew: tuple[str, ...]
    told: tuple[str, ...]

    def sentences(self) -> list[str]:
        """One line of figures, then one for each union."""
        figures = [
            f"{key} {value:.8g}" if isinstance(value, float) else f"{value} {key}"
            for key, value in self.figures.items()
        ]
        anew = [f"{name} was made anew: parts cross in other places" for name in self.anew]
        return [", ".join(figures), *anew, *self.told]

    def as_dict(self) -> dict[str, Any]:
        """For a script."""
        return self.figures | {"unions": self.unions, "anew": list(self.anew)}


def made(pipeline: Pipeline, values: Values | None = None) -> Making:
    """The result at some values, and what is to be said of it."""
    here = pipeline.at(values)
    geometry = here(values)
    makings = {name: here.branches[name].making for name in here.feeding}
    unions = {name: one.report for name, one in makings.items() if isinstance(one, Wetting)}
    anew = tuple(
        name for name in here.feeding if here.branches[name] is not pipeline.branches[name]
    )
    return Making(
        geometry,
        _figures(geometry),
        {name: report.as_dict() for name, report in unions.items()},
        anew,
        tuple(line for report in unions.values() for line in report.sentences()),
    )


def _figures(geometry: Geometry) -> dict[str, Any]:
    found: dict[str, Any] = {"points": len(geometry.points)}
    if not isinstance(geometry, Surface):
        return found
    found |= {"faces": len(geometry.faces), "area": float(quality.area(geometry))}
    if len(topology.boundary_loops(geometry.faces)) == 0:
        found["volume"] = float(quality.signed_volume(geometry))
    return found


def largest_motion(pipeline: Pipeline, values: Values | None = None) -> float:
    """How far points move from where the variables' own values have them, at most [m].

    Of what is made from other geometries, which may be made anew with other points, it is the
    motion of these, and what its own stages do.
    """
    here, farthest = pipeline.at(values), 0.0
    for name in here.feeding:
        part = here.of(name)
        branch = part.branches[part.leading]
        is_anew = bool(branch.of) and not (branch.making and branch.making.is_foreign)
        start = part.source(values) if is_anew else part.geometry.points
        motion = np.asarray(part.points(values)) - np.asarray(start)
        farthest = max(farthest, float(np.linalg.norm(motion, axis=1).max(initial=0.0)))
    return farthest
