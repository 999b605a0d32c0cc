"""The wetted surface: overlapping closed components united into one watertight surface."""

from collections.abc import Sequence
from itertools import chain

import numpy as np
from typing_extensions import override

from .._types import Array, is_concrete
from ..errors import GeometryError, ParameterError
from ..mesh import Geometry, Surface
from .base import AbstractModeler
from .provenance import Provenance, joined
from .solids import Plane, Solid, check, solid, symmetry_plane
from .touching import apart, check_coplanar, groups
from .wetted_report import ALTITUDE, altitudes, reported
from .wetted_state import WettedState
from .wetting import Wetting, followed, recipe

DEPTH = 0.05
"""How far half models are extended through their plane, by the extent; each by another multiple."""


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

    Notes
    -----
    The boolean is by manifold3d, which calls which part of a face is left.
    """

    symmetry: str | None = None
    apart: str = "refuse"
    crossings: str = "refuse"

    def __check_init__(self) -> None:
        choices = {
            "symmetry": (None, "x", "y", "z"),
            "apart": ("refuse", "allow"),
            "crossings": ("refuse", "allow"),
        }
        for name, allowed in choices.items():
            if getattr(self, name) not in allowed:
                raise ParameterError(
                    f"a union's {name} is one of {', '.join(map(repr, allowed))}, got "
                    f"{getattr(self, name)!r}"
                )

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
        notes = self._notes(solids, state)
        made = joined(solids)
        return _bound(surfaces, called, solids, plane, state, made, notes)

    def _plane(self, surfaces: list[Surface], names: list[str]) -> Plane | None:
        if self.symmetry is None:
            return None
        return symmetry_plane(surfaces, names, "xyz".index(self.symmetry))

    def _solids(
        self, surfaces: list[Surface], names: list[str], plane: Plane | None
    ) -> list[Solid]:
        every = np.concatenate([np.asarray(s.points) for s in surfaces])
        depth = DEPTH * float(np.linalg.norm(np.ptp(every, axis=0)))
        solids = []
        for k, (surface, name) in enumerate(zip(surfaces, names, strict=True)):
            solids.append(solid(surface, name, plane, depth * (1 + k)))
            check(solids[-1], plane, self.crossings == "refuse")
        return solids

    def _notes(self, solids: list[Solid], state: WettedState) -> tuple[str, ...]:
        if groups(state) == 1:
            return ()
        told = apart(solids, state)
        if self.apart == "allow":
            return tuple(told)
        if not told:
            sets = ", ".join(s.name for s in solids)
            told = [f"{sets} cross in {groups(state)} groups that do not touch each other"]
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


def _bound(
    surfaces: list[Surface],
    names: list[str],
    solids: list[Solid],
    plane: Plane | None,
    state: WettedState,
    made: Provenance,
    notes: tuple[str, ...],
) -> Wetting:
    points = tuple(np.asarray(s.points, float) for s in surfaces)
    offset = np.zeros(3)
    if plane is not None:
        offset[plane.axis] = -plane.side
    follow = recipe(points, made, offset)
    components, tags = _components(surfaces, names, solids, made)
    geometry = Surface(
        np.asarray(followed(follow, points)[0]),
        made.faces,
        tags,
        components,
        face_data=_face_data(surfaces, made),
    )
    given = sum(int(np.sum(altitudes(s.points, s.faces) < ALTITUDE)) for s in solids)
    counts = len(made.kept), len(made.edges), len(made.triples)
    axis = None if plane is None else plane.axis
    report = reported(geometry, counts, made.residual, given, axis, notes)
    return Wetting(geometry, report, follow, state)


def _components(
    surfaces: list[Surface], names: list[str], solids: list[Solid], made: Provenance
) -> tuple[tuple[str, ...], np.ndarray]:
    """Names of the components, and the number of each face's.

    Those of the inputs if they all differ, else with the input's name before; an input that has
    but one, called "1" as where nothing was said, gives its own name. A component that lay wholly
    in the symmetry plane is gone.
    """
    own = [(name,) if s.components == ("1",) else s.components
           for s, name in zip(surfaces, names, strict=True)]  # fmt: skip
    if len(set(chain(*own))) < sum(map(len, own)):
        own = [
            c if len(c) == 1 and c[0] == n else tuple(f"{n}.{part}" for part in c)
            for c, n in zip(own, names, strict=True)
        ]
    left = [np.unique(np.asarray(s.tags)[sol.own]) for s, sol in zip(surfaces, solids, strict=True)]
    number = np.cumsum([0, *map(len, left)])
    tags = np.empty(len(made.faces), np.int64)
    for k, surface in enumerate(surfaces):
        mine = made.surface == k
        its = np.asarray(surface.tags)[made.face[mine]]
        tags[mine] = number[k] + np.searchsorted(left[k], its)
    return tuple(c[i] for c, ids in zip(own, left, strict=True) for i in ids.tolist()), tags


def _face_data(surfaces: list[Surface], made: Provenance) -> dict[str, Array]:
    """What all inputs have under one name and in one shape, from the faces that were cut."""
    data = {}
    for name in surfaces[0].face_data:
        arrays = [np.asarray(s.face_data[name]) for s in surfaces if name in s.face_data]
        if len(arrays) == len(surfaces) and len({a.shape[1:] for a in arrays}) == 1:
            first = np.cumsum([0, *map(len, arrays)])
            data[name] = np.concatenate(arrays)[first[made.surface] + made.face]
    return data
