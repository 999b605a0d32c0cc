"""What a union takes: surfaces with a name, checked and closed, half models by an extension."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .._types import Array
from ..errors import GeometryError
from ..mesh import Surface, parts, quality, topology
from ..mesh.cap import IN_PLANE, spanned
from ..mesh.intersections import self_intersections


class Plane(NamedTuple):
    """The plane x, y or z = 0 at which a half model is open.

    Attributes
    ----------
    axis
        0, 1 or 2.
    side
        1 if the model lies at positive coordinates, else -1.
    near
        Points within this distance lie in the plane [m].
    """

    axis: int
    side: int
    near: float

    @property
    def name(self) -> str:
        """As it is written."""
        return f"{'xyz'[self.axis]} = 0"


class Solid(NamedTuple):
    """A closed surface, whose points are those of an input and some that follow them.

    Attributes
    ----------
    name
        What messages call it.
    points
        The input's, those in the symmetry plane put onto it to the bit.
    faces, own
        The input's faces without those in the symmetry plane, and their numbers there.
    extension
        Faces beyond the symmetry plane, which close it; they use points that follow the input's.
    sources
        The input's points that those follow.
    offset
        By which they are displaced.
    plane_edges
        Edges in the symmetry plane, in the direction of their faces.
    """

    name: str
    points: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]
    own: Int[np.ndarray, "m"]
    extension: Int[np.ndarray, "e 3"]
    sources: Int[np.ndarray, "w"]
    offset: Float[np.ndarray, "3"]
    plane_edges: Int[np.ndarray, "p 2"]

    @property
    def nodes(self) -> np.ndarray:
        """All points, those that follow behind the input's."""
        return np.concatenate([self.points, self.points[self.sources] + self.offset])

    @property
    def all_faces(self) -> np.ndarray:
        """Those of the input, then the extension's."""
        return np.concatenate([self.faces, self.extension])


def symmetry_plane(surfaces: Sequence[Surface], names: Sequence[str], axis: int) -> Plane:
    """The plane and the side of it on which all of the half models lie."""
    heights = [np.asarray(s.points)[np.unique(s.faces)] for s in surfaces]
    everything = np.concatenate(heights)
    near = IN_PLANE * float(np.linalg.norm(np.ptp(everything, axis=0)))
    side = 1 if everything[:, axis].max() >= -everything[:, axis].min() else -1
    plane = Plane(axis, side, near)
    for name, points in zip(names, heights, strict=True):
        depth = -side * points[:, axis]
        beyond = np.flatnonzero(depth > near)
        if len(beyond):
            worst = points[np.argmax(depth)]
            raise GeometryError(
                f"{name}: {len(beyond)} points lie beyond the symmetry plane {plane.name}, up to "
                f"{depth.max():.4g} near {_place(worst)}, while the model is a half on its "
                f"{'positive' if side > 0 else 'negative'} side: cut the component at the plane, "
                "or unite whole models without symmetry"
            )
    return plane


def solid(surface: Surface, name: str, plane: Plane | None, depth: float) -> Solid:
    """The surface closed; at the plane, if there is one, by a prism as deep as `depth`."""
    points, faces = np.array(surface.points, float), np.asarray(surface.faces, np.int64)
    own = np.arange(len(faces))
    nothing = np.empty((0, 3), np.int64)
    offset, edges = np.zeros(3), np.empty((0, 2), np.int64)
    sources, extension = np.empty(0, np.int64), nothing
    if plane is not None:
        is_flat = np.abs(points[:, plane.axis]) <= plane.near
        own = np.flatnonzero(~is_flat[faces].all(axis=1))
        faces = faces[own]
        loops = _loops_in_plane(points, faces, is_flat, name, plane)
        if loops:
            sources = np.unique(np.concatenate(loops))
            points[sources, plane.axis] = 0.0
            offset[plane.axis] = -plane.side * depth
            edges = np.concatenate([np.stack([lp, np.roll(lp, -1)], axis=1) for lp in loops])
            extension = _prism(points, loops, sources, plane.axis)
    return Solid(name, points, faces, own, extension, sources, offset, edges)


def _loops_in_plane(
    points: np.ndarray, faces: np.ndarray, is_flat: np.ndarray, name: str, plane: Plane
) -> list[np.ndarray]:
    loops = topology.boundary_loops(faces)
    for loop in loops:
        if not is_flat[loop].all():
            off = loop[~is_flat[loop]]
            raise GeometryError(
                f"{name}: an opening of {len(loop)} edges does not lie in the symmetry plane "
                f"{plane.name}: {len(off)} of its points are off it, first near "
                f"{_place(points[off[0]])}; a half model may be open there only: close the opening "
                "(mesh.cap) or put its points onto the plane"
            )
    return loops


def _prism(
    points: np.ndarray, loops: list[np.ndarray], sources: np.ndarray, axis: int
) -> np.ndarray:
    """Walls from the loops to their displaced copies, and a cap between those."""
    after = np.empty(len(points), np.int64)
    after[sources] = len(points) + np.arange(len(sources))
    start = np.concatenate(loops)
    end = np.concatenate([np.roll(loop, -1) for loop in loops])
    walls = [
        np.stack([end, start, after[start]], axis=1),
        np.stack([end, after[start], after[end]], axis=1),
    ]
    flat = points[:, [(axis + 1) % 3, (axis + 2) % 3]]
    return np.concatenate([*walls, after[spanned(flat, [loop[::-1] for loop in loops])]])


def check(solid: Solid, plane: Plane | None, looks_for_crossings: bool) -> None:
    """Refuse what is open, badly joined, inside out or runs through itself."""
    points, faces = solid.nodes, solid.all_faces
    used = points[np.unique(faces)]
    if not len(faces) or not np.isfinite(used).all():
        what = "has points that are no finite numbers" if len(faces) else "has no faces"
        raise GeometryError(f"{solid.name}: {what}: it cannot be united with anything")
    edges = topology.edges(faces)
    hint = "close it first (mesh.cap)"
    if plane is None:
        hint += '; a half model that is open at its symmetry plane needs symmetry="y"'
    faults = (
        (edges.open, "edges belong to one face only, so it is open", hint),
        (edges.nonmanifold, "edges belong to more than two faces", "leave one body at each edge"),
        (
            edges.misoriented,
            "edges separate faces that show different sides",
            "turn faces over (`moldline check --fix`)",
        ),
    )
    for found, what, remedy in faults:
        if len(found):
            near = _place(points[found[0]].mean(axis=0))
            raise GeometryError(
                f"{solid.name}: {len(found)} {what}, first near {near}; a union takes closed "
                f"components: {remedy}"
            )
    whole = Surface(points, faces)
    if len(parts.inside_out_pieces(whole)):
        raise GeometryError(
            f"{solid.name}: it is inside out, its volume is {quality.signed_volume(whole):.4g}; "
            "turn its faces over (`moldline check --fix`)"
        )
    if not looks_for_crossings:
        return
    crossing = self_intersections(solid.points, solid.faces)
    if len(crossing.pairs):
        raise GeometryError(
            f"{solid.name}: {len(crossing.pairs)} pairs of its faces run through each other, first "
            f"near {_place(crossing.places[0])}; a union needs to know inside from outside: part "
            'them, make the piece a component of its own, or say crossings="allow"'
        )


def extent(clouds: Iterable[Array]) -> float:
    """Diagonal of the box around all points [m]."""
    return float(np.linalg.norm(np.ptp(np.concatenate([np.asarray(c) for c in clouds]), axis=0)))


def _place(point: Array) -> str:
    return "({:.6g}, {:.6g}, {:.6g})".format(*np.asarray(point).tolist())
