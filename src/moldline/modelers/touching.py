"""How components meet: whether they cross, lie apart or inside, or touch in a face."""

from collections.abc import Sequence

import numpy as np

from ..errors import GeometryError
from ..mesh.crossings import overlaps
from .provenance import Provenance
from .solids import Solid
from .wetted_state import WettedState

MOST = 2000
"""Pairs of faces in one plane whose common area is worked out."""

WIDE = 1e-9
"""Faces overlap if they have more than this part of the smaller one's area in common."""


def check_coplanar(solids: Sequence[Solid], state: WettedState) -> None:
    """Refuse components with faces that lie in one plane and overlap there."""
    pairs = state.crossings.coplanar[:MOST]
    points = np.concatenate([s.points for s in solids])
    areas, places = overlaps(points, state.faces, pairs)
    corners = points[state.faces[pairs]]
    sides = corners[:, :, 1:] - corners[:, :, :1]
    own = np.linalg.norm(np.cross(sides[:, :, 0], sides[:, :, 1]), axis=2) / 2
    found = np.flatnonzero(areas > WIDE * own.min(axis=1, initial=np.inf))
    if not len(found):
        return
    starts = np.cumsum([0, *(len(s.faces) for s in solids)])
    one, other = np.searchsorted(starts, pairs[found[0]], side="right") - 1
    more = "at least " if len(state.crossings.coplanar) > MOST else ""
    raise GeometryError(
        f"{solids[one].name} and {solids[other].name} touch in a face: {more}{len(found)} pairs of "
        f"faces lie in one plane and overlap by {areas[found].sum():.4g} m² in all, first near "
        f"{_place(places[found[0]])}; what is inside is then a matter of rounding, and there is no "
        "derivative: let one reach into the other, or end short of it"
    )


def apart(solids: Sequence[Solid], state: WettedState) -> list[str]:
    """Sentences on components that cross no other, and whether they lie within another."""
    joins, inside = state.joins(), state.inside
    told: list[str] = []
    partners: set[frozenset[str]] = set()
    for k, one in enumerate(solids):
        if joins[k].any():
            continue
        rows = [row for row, (owner, _) in enumerate(state.free) if owner == k]
        around = [o.name for j, o in enumerate(solids) if all(inside[row, j] for row in rows)]
        if rows and around:
            told.append(f"{one.name} lies wholly inside {around[0]}")
            continue
        gap, other, place = _nearest(solids, k)
        if frozenset((one.name, other)) in partners:
            continue
        partners.add(frozenset((one.name, other)))
        told.append(
            f"{one.name} crosses no other component: the nearest is {other}, {gap:.4g} away near "
            f"{_place(place)}"
            if gap > 0
            else f"{one.name} touches {other} in a point or an edge only, near {_place(place)}"
        )
    return told


def grazing(solids: Sequence[Solid], state: WettedState, made: Provenance) -> list[str]:
    """Sentences on components that meet others, but have no point with them on the result."""
    first = np.cumsum([0, *(len(s.points) for s in solids)])
    # the first end of an edge and the first corners of triangles are points of the inputs
    ends = np.concatenate([made.edges[:, [0, 2]].ravel(), made.triples[:, ::3].ravel()])
    numbers = np.arange(len(solids))
    meets = np.isin(numbers, np.searchsorted(first, ends, side="right") - 1)
    is_seen = np.isin(numbers, made.surface)
    told = []
    for k in np.flatnonzero(state.joins().any(axis=1) & ~meets & is_seen).tolist():
        _, other, place = _nearest(solids, k)
        told.append(
            f"{solids[k].name} touches {other} in a point or an edge only, near {_place(place)}"
        )
    return told[:1] if len(solids) == 2 else told


def groups(state: WettedState) -> int:
    """How many sets of components there are that cross each other, directly or through others."""
    from scipy.sparse.csgraph import connected_components

    return int(connected_components(state.joins(), directed=False)[0])


def _nearest(solids: Sequence[Solid], k: int) -> tuple[float, str, np.ndarray]:
    """Distance to the nearest other component, its name, and a place on the way."""
    from ..numerics.closest import closest, tree  # the compiler need not be loaded to read a file

    one = solids[k]
    best = (np.inf, "", np.zeros(3))
    for j, other in enumerate(solids):
        if j != k:
            among = tree(other.points, other.faces)
            found = closest(one.points, one.faces, among)
            place = found.weights[0] @ one.points[one.faces[found.faces[0]]]
            best = min(best, (found.distance, other.name, place), key=lambda entry: entry[0])
    return best


def _place(point: np.ndarray) -> str:
    return "({:.6g}, {:.6g}, {:.6g})".format(*point.tolist())
