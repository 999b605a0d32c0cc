"""The boundary of a volume mesh as a geometry of its own."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int

from ..errors import GeometryError
from .section import Section
from .surface import Surface
from .volume import Cells, VolumeMesh

_LINE, _TRIANGLE, _QUAD = 3, 5, 9


def boundary(
    mesh: VolumeMesh, markers: Sequence[str] | None = None
) -> tuple[Surface | Section, Int[np.ndarray, "n"]]:
    """Some or all named parts of a mesh's boundary, and the node of the mesh that each point is.

    In three dimensions they are a surface with one component per marker, its quads cut along one
    diagonal. In two they must form one curve, which is a section.
    """
    names = list(mesh.markers) if markers is None else list(markers)
    unknown = [name for name in names if name not in mesh.markers]
    if unknown or not names:
        what = f"no marker named {unknown[0]!r}" if unknown else "no marker"
        raise GeometryError(f"{what}; the mesh has: {', '.join(mesh.markers) or 'none'}")
    points = np.asarray(mesh.points)
    if mesh.dimension == 2:
        lines = np.concatenate([_of(mesh.markers[name], _LINE, 2) for name in names])
        order, is_closed = _chained(lines, points, ", ".join(names))
        return Section(points[order], "+".join(names), is_closed), order
    parts = [_triangles(mesh.markers[name]) for name in names]
    faces, tags = np.concatenate(parts), np.repeat(np.arange(len(parts)), [len(p) for p in parts])
    nodes, index = np.unique(faces, return_inverse=True)
    return Surface(points[nodes], index.reshape(-1, 3), tags, tuple(names)), nodes


def _of(cells: Cells, kind: int, size: int) -> np.ndarray:
    """Nodes of the cells of one type, one row each."""
    types, starts, nodes = (np.asarray(array) for array in cells)
    return nodes[starts[:-1][types == kind][:, None] + np.arange(size)]


def _triangles(cells: Cells) -> np.ndarray:
    quads = _of(cells, _QUAD, 4)
    return np.concatenate([_of(cells, _TRIANGLE, 3), quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _chained(lines: np.ndarray, points: np.ndarray, name: str) -> tuple[np.ndarray, bool]:
    """Nodes in order along a curve, and whether it is closed.

    A closed one begins at its largest x and runs over the top, as airfoils do.
    """
    near: dict[int, list[int]] = {}
    for one, other in lines.tolist():
        near.setdefault(one, []).append(other)
        near.setdefault(other, []).append(one)
    ends = [node for node, others in near.items() if len(others) == 1]
    begin = ends[0] if ends else max(near, key=lambda node: points[node, 0])
    order, before = [begin], -1
    while following := [node for node in near[order[-1]] if node not in (before, begin)]:
        before = order[-1]
        order.append(following[0])
        if len(order) > len(near):
            break
    if len(order) != len(near) or len(ends) not in (0, 2):
        raise GeometryError(
            f"markers {name} are no single curve without branches; take them one by one"
        )
    nodes = np.array(order)
    if not ends:
        x, y = points[nodes, :2].T
        runs_below = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0
        nodes = np.append(nodes[0], nodes[:0:-1]) if runs_below else nodes
    return nodes, not ends
