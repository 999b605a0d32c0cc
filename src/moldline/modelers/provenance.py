"""The union of closed solids by manifold3d, and where each of its points comes from."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..errors import GeometryError
from .solids import Solid
from .sources import Sources, traced


class Provenance(NamedTuple):
    """A union's faces, and what each of its points is made of.

    Points of the inputs are numbered through, one input after the other; nodes are these, then the
    points that follow them at the symmetry plane.

    Attributes
    ----------
    faces
        Of kept points, then points on edges, then those of three triangles.
    surface, face
        The input of each face, and its face there.
    kept
        Points that are points of inputs, ascending; where fans of faces touch in a point, twice.
    edges
        Nodes of an edge (2) and of the triangle that it runs through (3).
    triples
        Nodes of three triangles.
    walls
        The points that the nodes beyond the inputs' follow.
    residual
        How far the formulas are from manifold3d's own points at most [m].
    """

    faces: Int[np.ndarray, "m 3"]
    surface: Int[np.ndarray, "m"]
    face: Int[np.ndarray, "m"]
    kept: Int[np.ndarray, "k"]
    edges: Int[np.ndarray, "e 5"]
    triples: Int[np.ndarray, "t 9"]
    walls: Int[np.ndarray, "w"]
    residual: float


class _All(NamedTuple):
    """All solids with common numbers."""

    nodes: Float[np.ndarray, "n 3"]
    faces: Int[np.ndarray, "m 3"]
    first_face: Int[np.ndarray, "s"]
    surface: Int[np.ndarray, "m"]
    own: Int[np.ndarray, "m"]
    """The input's face; -1 for an extension's."""
    points: int
    """How many nodes are points of inputs."""
    follows: Int[np.ndarray, "w"]
    """The points that the other nodes follow."""
    is_flat: np.ndarray
    """Whether a node is on the edge of an opening in the symmetry plane, or follows such a one."""


def joined(solids: Sequence[Solid]) -> Provenance:
    """Unite the solids and trace every point of the result that is not beyond the plane."""
    everything = _numbered(solids)
    places, faces, face = _united(solids, everything)
    source = _kept(everything, places, faces, face)
    stays = everything.own[face] >= 0
    used = np.unique(faces[stays])
    fresh = used[source[used] < 0]
    found = traced(Sources(everything.nodes, everything.faces, everything.surface,
                           everything.points), places, faces, face, fresh)  # fmt: skip
    # in an order that does not depend on the boolean, so that unions of moved parts compare
    one, other = np.lexsort(found.edges.T[::-1]), np.lexsort(found.triples.T[::-1])
    edges, walls = _in_plane(everything, found.edges[one])
    old = used[source[used] >= 0]
    old = old[np.argsort(source[old], kind="stable")]
    # points of two fans that touch stay two, as manifold3d has them, so that edges stay manifold
    key = np.full(len(places), -1)
    key[np.concatenate([old, found.on_edges[one], found.on_triples[other]])] = np.arange(len(used))
    face = face[stays]
    return Provenance(
        key[faces[stays]],
        everything.surface[face],
        everything.own[face],
        source[old],
        edges,
        found.triples[other],
        walls,
        found.residual,
    )


def _numbered(solids: Sequence[Solid]) -> _All:
    sizes = [len(s.points) for s in solids]
    first = np.cumsum([0, *sizes])
    follows = [s.sources + at for s, at in zip(solids, first, strict=False)]
    behind = first[-1] + np.cumsum([0, *map(len, follows)])
    faces, own, surface = [], [], []
    for k, s in enumerate(solids):
        local = s.all_faces
        faces.append(np.where(local < sizes[k], local + first[k], local - sizes[k] + behind[k]))
        own.append(np.append(s.own, np.full(len(s.extension), -1)))
        surface.append(np.full(len(local), k))
    nodes = np.concatenate(
        [*(s.points for s in solids), *(s.points[s.sources] + s.offset for s in solids)]
    )
    is_flat = np.zeros(len(nodes), bool)
    all_follows = np.concatenate(follows)
    is_flat[all_follows], is_flat[first[-1] :] = True, True
    return _All(
        nodes,
        np.concatenate(faces),
        np.cumsum([0, *map(len, faces)]),
        np.concatenate(surface),
        np.concatenate(own),
        int(first[-1]),
        all_follows,
        is_flat,
    )


def _united(solids: Sequence[Solid], everything: _All) -> tuple[np.ndarray, ...]:
    """Points and faces of the union, and for each face the one that it is a part of."""
    import manifold3d

    base = manifold3d.Manifold.reserve_ids(len(solids))
    shapes = []
    for k, solid in enumerate(solids):
        faces = solid.all_faces
        mesh = manifold3d.Mesh64(
            vert_properties=np.ascontiguousarray(solid.nodes),
            tri_verts=np.ascontiguousarray(faces, np.uint64),
            run_index=np.array([0, 3 * len(faces)], np.uint64),
            run_original_id=np.array([base + k], np.uint32),
            # faces in one plane stay apart, and each part of one says whose it is
            face_id=np.arange(len(faces), dtype=np.uint64),
        )
        shape = manifold3d.Manifold(mesh)
        if shape.status() != manifold3d.Error.NoError:
            raise GeometryError(
                f"{solid.name}: manifold3d does not take it as a closed body: "
                f"{shape.status().name}; look at it with `moldline check`"
            )
        shapes.append(shape)
    union = manifold3d.Manifold.batch_boolean(shapes, manifold3d.OpType.Add)
    if union.status() != manifold3d.Error.NoError:
        names = ", ".join(s.name for s in solids)
        raise GeometryError(f"manifold3d cannot unite {names}: {union.status().name}")
    mesh = union.to_mesh64()
    ends = np.asarray(mesh.run_index, np.int64) // 3
    ids = np.asarray(mesh.run_original_id, np.int64) - base
    surface = np.repeat(ids, ends[1:] - ends[:-1])
    face = np.asarray(mesh.face_id, np.int64) + everything.first_face[surface]
    places = np.array(mesh.vert_properties)[:, :3]
    return places, np.asarray(mesh.tri_verts).astype(np.int64), face


def _kept(everything: _All, places: np.ndarray, faces: np.ndarray, face: np.ndarray) -> np.ndarray:
    """The node that each point of the union equals to the bit, or -1."""
    source = np.full(len(places), -1)
    owner = everything.faces[face]
    corners, theirs = places[faces], everything.nodes[owner]
    for a in range(3):
        for b in range(3):
            hit = (corners[:, a] == theirs[:, b]).all(axis=1)
            source[faces[hit, a]] = owner[hit, b]
    return source


def _in_plane(everything: _All, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges in the symmetry plane run through walls, not through the faces that end there.

    A wall stands on an edge in the plane, its third corner follows the first; so the point stays
    in the plane whatever moves.
    """
    count = everything.points
    origin = np.append(np.arange(count), everything.follows)
    plain = edges.copy()
    needed: list[int] = []
    is_plane = everything.is_flat[edges[:, :2]].all(axis=1)
    for row in np.flatnonzero(is_plane).tolist():
        triangle = edges[row, 2:]
        ends = np.unique(origin[triangle[everything.is_flat[triangle]]])
        if len(ends) == 2:
            plain[row, 2:] = [ends[0], ends[1], count + len(needed)]
            needed.append(int(ends[0]))
    return plain, np.array(needed, np.int64)
