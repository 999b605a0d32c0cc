"""The wetted surface: overlapping closed components united into one watertight surface."""

from collections.abc import Sequence

import equinox as eqx
import numpy as np
from typing_extensions import override

from .._types import is_concrete
from ..errors import GeometryError, ParameterError
from ..mesh import Geometry, Surface
from .assembly import assembled
from .base import AbstractModeler
from .cleaning import Limits
from .provenance import joined
from .solids import Plane, Solid, check, extent, solid, symmetry_plane
from .touching import apart, check_coplanar, grazing, groups
from .wetted_report import ALTITUDE
from .wetted_state import WettedState
from .wetting import Wetting

DEPTH = 0.05
"""How far half models are extended through their plane, by the extent; each by another multiple."""

CLEAN = 1e-4
"""How far off the plane of its face cleaning takes a corner at most, by the extent."""


class Union(AbstractModeler):
    """The wetted surface of two or more overlapping closed surfaces.

    Each of its points is a point of a component, kept to the bit, or lies where an edge of one runs
    through a face of another, or where faces of three meet. It follows the components by these
    formulas, and so do its derivatives, as long as the same edges run through the same faces.

    Attributes
    ----------
    symmetry
        "y" for half models, which may be open at the plane y = 0 (or "x", "z"): they are closed
        there by extensions through the plane, which are dropped again. Faces that lie in the plane
        are dropped too.
    apart
        "allow" leaves components that cross no other as pieces of their own, and those inside
        another out; "refuse" refuses them.
    crossings
        "refuse" refuses components whose own faces run through each other, "allow" does not look.
    slivers
        "clean" takes slivers away that the cut made, by merging points into neighbours and turning
        edges; what is left follows the components by the same formulas. "keep" leaves the cut as
        it is, which alone has the exact volume.
    altitude
        A face is a sliver if its smallest altitude is below this part of its longest side.
    tolerance
        How far cleaning may take a corner off the plane of its face [m]; by default `CLEAN` of the
        extent.

    Notes
    -----
    The boolean is by manifold3d, which calls which part of a face is left.
    """

    symmetry: str | None = eqx.field(default=None, static=True)
    apart: str = eqx.field(default="refuse", static=True)
    crossings: str = eqx.field(default="refuse", static=True)
    slivers: str = eqx.field(default="keep", static=True)
    altitude: float = eqx.field(default=ALTITUDE, static=True)
    tolerance: float | None = eqx.field(default=None, static=True)

    def __check_init__(self) -> None:
        choices = {
            "symmetry": (None, "x", "y", "z"),
            "apart": ("refuse", "allow"),
            "crossings": ("refuse", "allow"),
            "slivers": ("keep", "clean"),
        }
        for name, allowed in choices.items():
            if getattr(self, name) not in allowed:
                raise ParameterError(
                    f"a union's {name} is one of {', '.join(map(repr, allowed))}, got "
                    f"{getattr(self, name)!r}"
                )
        if not 0 <= self.altitude <= np.sqrt(3) / 2:
            raise ParameterError(
                f"a union's altitude is a part of a face's longest side, got {self.altitude}"
            )
        if self.tolerance is not None and not 0 < self.tolerance < np.inf:
            raise ParameterError(f"a union's tolerance is a length [m], got {self.tolerance}")

    @property
    @override
    def takes(self) -> tuple[int, float]:
        return (2, float("inf"))

    @override
    def bind(self, *geometries: Geometry, names: Sequence[str] | None = None) -> Wetting:
        """Unite surfaces; `names` are what they are called, by default "1", "2" ..."""
        surfaces = _surfaces(geometries)
        called = [str(k + 1) for k in range(len(surfaces))] if names is None else list(names)
        if len(called) != len(surfaces):
            raise ParameterError(f"{len(surfaces)} surfaces need as many names, got {called}")
        plane = self._plane(surfaces, called)
        solids = self._solids(surfaces, called, plane)
        state = WettedState(solids, plane)
        check_coplanar(solids, state)
        notes = self._apart(apart(solids, state), solids, groups(state))
        made = joined(solids)
        notes = (*notes, *self._apart(grazing(solids, state, made), solids, 1))
        geometry, report, follow = assembled(
            surfaces, called, solids, plane, made, self._limits(solids), notes
        )
        return Wetting(geometry, report, follow, state)

    def _limits(self, solids: list[Solid]) -> Limits:
        if self.slivers == "keep":
            return Limits(self.altitude, None)
        return Limits(self.altitude, self.tolerance or CLEAN * extent(s.points for s in solids))

    def _plane(self, surfaces: list[Surface], names: list[str]) -> Plane | None:
        if self.symmetry is None:
            return None
        return symmetry_plane(surfaces, names, "xyz".index(self.symmetry))

    def _solids(
        self, surfaces: list[Surface], names: list[str], plane: Plane | None
    ) -> list[Solid]:
        depth = DEPTH * extent(s.points for s in surfaces)
        solids = []
        for k, (surface, name) in enumerate(zip(surfaces, names, strict=True)):
            solids.append(solid(surface, name, plane, depth * (1 + k)))
            check(solids[-1], plane, self.crossings == "refuse")
        return solids

    def _apart(self, told: list[str], solids: list[Solid], groups: int) -> tuple[str, ...]:
        """The sentences, where components may be apart."""
        if self.apart == "allow":
            return tuple(told)
        if not told and groups > 1:
            names = ", ".join(s.name for s in solids)
            told = [f"{names} cross in {groups} groups that do not touch each other"]
        if not told:
            return ()
        raise GeometryError(
            f"{'; '.join(told)}: components of one wetted surface must run through each other; "
            'move them together, leave one out, or say apart="allow"'
        )


def _surfaces(geometries: Sequence[Geometry]) -> list[Surface]:
    for k, geometry in enumerate(geometries):
        if not isinstance(geometry, Surface):
            raise GeometryError(
                f"geometry {k + 1} of a union is a {type(geometry).__name__}; it takes surfaces"
            )
        if not is_concrete(geometry.points):
            raise GeometryError(
                "a union is bound to surfaces with known points; under jit and grad call what "
                "`bind` returned with the moved points"
            )
    if len(geometries) < 2:
        raise GeometryError(f"a union takes two surfaces or more, got {len(geometries)}")
    return [g for g in geometries if isinstance(g, Surface)]
