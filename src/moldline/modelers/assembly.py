"""A wetted surface put together from its provenance: points, names, data, cleaning, report."""

from itertools import chain, pairwise

import numpy as np
from jaxtyping import Bool

from .._types import Array
from ..mesh import Surface
from .cleaning import Cleaned, Limits, cleaned
from .provenance import Provenance
from .solids import Plane, Solid
from .wetted_report import WettedReport, altitudes, reported
from .wetting import Recipe, followed, recipe


def assembled(
    surfaces: list[Surface],
    names: list[str],
    solids: list[Solid],
    plane: Plane | None,
    made: Provenance,
    limits: Limits,
    notes: tuple[str, ...],
) -> tuple[Surface, WettedReport, Recipe]:
    """The wetted surface, what is to be said of it, and how it follows its components.

    Where the limits have a tolerance, slivers are taken away.
    """
    points = tuple(np.asarray(s.points, float) for s in surfaces)
    offset = np.zeros(3)
    if plane is not None:
        offset[plane.axis] = -plane.side
    follow = recipe(points, made, offset)
    places = np.asarray(followed(follow, points)[0])
    components, tags = _components(surfaces, names, solids, made)
    if limits.tolerance is not None:
        made, tags, note = _cleaned(surfaces, places, made, tags, limits)
        follow, notes = recipe(points, made, offset), (*notes, note)
        places = np.asarray(followed(follow, points)[0])
    data = _face_data(surfaces, made)
    geometry = Surface(places, made.faces, tags, components, face_data=data)
    counts = len(made.kept), len(made.edges), len(made.triples)
    axis = None if plane is None else plane.axis
    report = reported(
        geometry, counts, made.residual, _is_cut(surfaces, made), axis, limits.altitude, notes
    )
    return geometry, report, follow


def _cleaned(
    surfaces: list[Surface],
    places: np.ndarray,
    made: Provenance,
    tags: np.ndarray,
    limits: Limits,
) -> tuple[Provenance, np.ndarray, str]:
    is_cut = _is_cut(surfaces, made)
    every = np.concatenate([np.asarray(s.points, float) for s in surfaces])
    corners = every[_sources(surfaces, made)]
    found = cleaned(places, made.faces, tags, is_cut, corners, limits)
    before = int(np.sum(altitudes(places, made.faces[is_cut]) < limits.altitude))
    result = reduced(made, found)
    left = altitudes(places, found.faces[_is_cut(surfaces, result)])
    after = int(np.sum(left < limits.altitude))
    gone = len(made.faces) - len(found.faces)
    volumes = _volume(places, made.faces), _volume(places, found.faces)
    note = (
        f"cleaned: {before} slivers along the curves became {after}; {found.collapsed} points "
        f"merged into neighbours, {found.turned} edges turned, {gone} faces fewer; corners are up "
        f"to {found.moved:.3g} off the planes of their faces, of {limits.tolerance:.3g} allowed; "
        f"volume changed by {volumes[1] - volumes[0]:.3g}"
    )
    return result, tags[found.rows], note


def reduced(made: Provenance, found: Cleaned) -> Provenance:
    """What is left with the faces of a cleaned surface: points that none uses are left out."""
    used = np.unique(found.faces)
    place = np.full(used.max(initial=0) + 1, -1)
    place[used] = np.arange(len(used))
    bounds = np.cumsum([0, len(made.kept), len(made.edges), len(made.triples)])
    kept, edges, triples = (used[(a <= used) & (used < b)] - a for a, b in pairwise(bounds))
    return made._replace(
        faces=place[found.faces],
        surface=made.surface[found.rows],
        face=made.face[found.rows],
        kept=made.kept[kept],
        edges=made.edges[edges],
        triples=made.triples[triples],
    )


def _sources(surfaces: list[Surface], made: Provenance) -> np.ndarray:
    """Corners of the face that each face is a part of, numbered through all inputs."""
    first = np.cumsum([0, *(len(s.points) for s in surfaces)])
    starts = np.cumsum([0, *(len(s.faces) for s in surfaces)])
    every = np.concatenate(
        [np.asarray(s.faces, np.int64) + at for s, at in zip(surfaces, first, strict=False)]
    )
    return every[starts[made.surface] + made.face]


def _is_cut(surfaces: list[Surface], made: Provenance) -> Bool[np.ndarray, "m"]:
    """Whether each face is another one than the input's."""
    node = np.full(len(made.kept) + len(made.edges) + len(made.triples), -1)
    node[: len(made.kept)] = made.kept
    same = np.sort(node[made.faces], axis=1) == np.sort(_sources(surfaces, made), axis=1)
    return ~same.all(axis=1)


def _volume(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (points[faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


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
