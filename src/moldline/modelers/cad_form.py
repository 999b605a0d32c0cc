"""The triangulation of a CAD shape that some source makes, and its points for other parameters."""

import logging
from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from ..errors import GeometryError, ParameterError
from ..mesh import Surface
from .cad_sources import Given
from .cad_tessellation import Fineness, Tessellation, tessellated
from .cad_topology import difference, open_edges, opencascade
from .quantities import Quantities, choices

log = logging.getLogger("moldline.modelers")

Parts = Literal["auto", "names", "colours", "solids", "faces", "one"]
"""What components are made of."""


class Asked(NamedTuple):
    """How fine a triangulation is to be [m, rad], and what its components are."""

    max_edge: float | None = None
    sag: float | None = None
    angle: float | None = None
    degrees: bool = False
    components: str = "auto"
    groups: Mapping[str, list[int]] | None = None


class Form:
    """Points for parameters, with the owners and triangles of the first shape.

    `surface` is that of the first parameters, in m; `open_edges` counts the edges that have a face
    on one side only.
    """

    def __init__(
        self,
        source: Callable[[Mapping[str, Any]], Given],
        parameters: Mapping[str, Any],
        asked: Asked,
    ):
        choices(components=(asked.components, Parts))
        if parameters:
            Quantities(parameters)  # refuses what is no number
        given = source(dict(parameters))
        self.mesh = tessellated(given.shape, given.parts, _fineness(given, asked))
        self.source, self.parts, self.scale = source, given.parts, given.scale
        self.open_edges = len(open_edges(given.parts))
        tags, names = _components(given, self.mesh, asked.components, asked.groups or {})
        if not self.open_edges:
            _check_closed(self.mesh.faces)
        points = self.mesh.owners(given.parts) * given.scale
        solids = np.array([face.solid for face in given.parts.faces])[self.mesh.of_face]
        self.surface = Surface(points, _outward(points, self.mesh.faces, solids), tags, names)

    def __call__(self, parameters: Mapping[str, Any]) -> np.ndarray:
        given = self.source(parameters)
        if clause := difference(self.parts, given.parts):
            told = ", ".join(f"{name} = {value}" for name, value in parameters.items())
            raise GeometryError(
                f"at {told} the CAD shape has another topology than at first: {clause}; begin "
                "from parameters whose shape is like this one, or keep them nearer"
            )
        placed = self.mesh.owners.placed(given.parts)
        if placed.folded:
            log.warning(
                "at %s %d of %d triangles are folded over, in faces whose boundary has moved far: "
                "make the modeler anew from parameters near these",
                ", ".join(f"{name} = {value}" for name, value in parameters.items()),
                placed.folded, len(self.mesh.faces),
            )  # fmt: skip
        return placed.points * self.scale


def _fineness(given: Given, asked: Asked) -> Fineness:
    """What is asked for, else parts of the shape's extent, in the shape's unit."""
    max_edge, sag, angle, degrees, *_ = asked
    for name, own in (("max_edge", max_edge), ("sag", sag)):
        if own is not None and not own > 0:
            raise ParameterError(f"{name} must be above 0 [m], got {own}")
    turn = np.radians(15.0 if angle is None else angle) if degrees or angle is None else angle
    if not 1e-3 < turn < np.pi / 2:
        raise ParameterError(
            f"angle must lie between 0.001 and 1.57 [rad], got {turn:g}; is it in degrees? Then "
            "say degrees = true"
        )
    size = _extent(given)
    return Fineness(
        size / 20 if max_edge is None else max_edge / given.scale,
        size / 1000 if sag is None else sag / given.scale,
        float(turn),
    )


def _extent(given: Given) -> float:
    occ = opencascade()
    box = occ.Bnd.Bnd_Box()
    occ.BRepBndLib.BRepBndLib.Add_s(given.shape, box, False)
    return float(np.sqrt(box.SquareExtent()))


def _components(
    given: Given, mesh: Tessellation, how: str, groups: Mapping[str, list[int]]
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Tags of the triangles, and the components' names, in the faces' order."""
    faces = given.parts.faces
    solids = [f"solid {face.solid + 1}" for face in faces]
    single = [f"face {k}" for k in range(1, len(faces) + 1)]
    if how == "auto":
        how = "names" if any(given.names) else "solids"
    if how == "colours" and not any(given.colours):
        raise ParameterError("components = 'colours', but no face of the shape has one")
    of_faces = {
        "names": [name or solid for name, solid in zip(given.names, solids, strict=True)],
        "colours": [colour or "no colour" for colour in given.colours],
        "solids": solids,
        "faces": single,
        "one": ["cad"] * len(faces),
    }[how]
    of_faces = list(of_faces)
    for name, numbers in groups.items():
        for number in numbers:
            if not 1 <= number <= len(faces):
                raise ParameterError(
                    f"group {name!r} names face {number}, the shape has faces 1 to {len(faces)}"
                )
            of_faces[number - 1] = name
    names = tuple(dict.fromkeys(of_faces))
    return np.array([names.index(name) for name in of_faces])[mesh.of_face], names


def _outward(points: np.ndarray, faces: np.ndarray, solids: np.ndarray) -> np.ndarray:
    """Triangles of closed solids and shells turned to look out of them."""
    faces = faces.copy()
    for solid in np.unique(solids):
        own = faces[solids == solid]
        a, b, c = (points[own[:, k]] - points[own[0, 0]] for k in range(3))
        if np.sum(a * np.cross(b, c)) < 0 and not _open_sides(own):
            faces[solids == solid] = own[:, ::-1]
    return faces


def _open_sides(faces: np.ndarray) -> int:
    """Sides of triangles without another triangle on them."""
    pairs = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    count = int(faces.max()) + 1
    there, back = np.sort(pairs @ [count, 1]), np.sort(pairs[:, ::-1] @ [count, 1])
    return 0 if np.array_equal(there, back) else max(len(np.setxor1d(there, back)) // 2, 1)


def _check_closed(faces: np.ndarray) -> None:
    """Refuse triangles that are open where the shape is closed: the mesher failed there."""
    if odd := _open_sides(faces):
        raise GeometryError(
            f"OpenCascade's triangles leave {odd} edges open on a closed shape; make sag smaller, "
            "or heal the shape"
        )
