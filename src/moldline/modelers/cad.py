"""A modeler of CAD shapes: a STEP file, or a modelling script with parameters."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import numpy as np
from typing_extensions import override

from .._types import Points, Vector
from ..errors import GeometryError, ParameterError
from ..mesh import Surface
from .base import AbstractMaking, AbstractShape
from .cad_sources import METRES, Given, Script, from_step
from .cad_tessellation import Fineness, Tessellation, tessellated
from .cad_topology import difference, open_edges, opencascade
from .differencing import Differences, Programmed
from .quantities import choices

Parts = Literal["auto", "names", "colours", "solids", "faces", "one"]
Unit = Literal["m", "cm", "mm", "in", "ft"]


class Cad(AbstractShape):
    """A CAD shape by OpenCascade (`pip install 'moldline[step]'`), as triangles of fixed owners.

    Each point belongs for ever to a vertex, to a part of an edge's range or to a face's (u, v),
    so that the same triangles fit the shape for other parameters. Points are one where faces
    meet: a closed shape gives a closed surface. Derivatives come from differences of the points
    at fixed owners, at four shapes a parameter.

    Attributes
    ----------
    program
        What makes the points of the parameters.
    surface
        The triangulation, in m; its components are as asked for.
    open_edges
        How many edges of the shape have a face on one side only; the surface is open there.

    Notes
    -----
    Parameters have their script's units, save lengths of the shape that it makes (`unit`).
    """

    program: Programmed = eqx.field(static=True)
    surface: Surface
    open_edges: int = eqx.field(static=True)

    def __init__(
        self,
        file: Path | None = None,
        script: Path | None = None,
        parameters: dict[str, float | list[float]] | None = None,
        *,
        steps: dict[str, float] | None = None,
        unit: Unit | None = None,
        max_edge: float | None = None,
        sag: float | None = None,
        angle: float | None = None,
        degrees: bool = False,
        components: Parts = "auto",
        groups: dict[str, list[int]] | None = None,
    ):
        """A shape from a STEP `file`, or from a `script` with a function make(parameters).

        `max_edge` and `sag` (how far triangles may be from the shape) are lengths [m], by default
        a twentieth and a thousandth of the shape's extent; `angle` is the largest between normals
        of neighbours along an edge or across a face, [rad] unless `degrees`, by default 15
        degrees. `groups` name faces by their numbers, from 1; the rest get `components`: by the
        file's names of faces and solids or colours of them, one for each solid or face, or one.
        """
        choices(components=(components, Parts), unit=(unit, (None, *METRES)))
        source = _source(file, script, parameters, unit)
        given = source(dict(parameters or {}))
        fineness = _fineness(given, max_edge, sag, angle, degrees)
        mesh = tessellated(given.shape, given.parts, fineness)
        tags, names = _components(given, mesh, components, groups or {})
        _check_closed(mesh.faces, given)
        form = _Form(source, given, mesh)
        self.program = Programmed(form, parameters or {}, steps)
        self.surface = Surface(form(dict(parameters or {})), mesh.faces, tags, names)
        self.open_edges = len(open_edges(given.parts))

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "Cad":
        paths = {k: folder / options.pop(k) for k in ("file", "script") if options.get(k)}
        return cls(**options, **paths)

    @property
    @override
    def parameters(self) -> dict[str, np.ndarray]:
        return self.program.quantities.rows

    @property
    @override
    def values(self) -> Vector:
        return self.program.values

    @property
    @override
    def geometry(self) -> Surface:
        return self.surface

    @override
    def __call__(self, parameters: Vector) -> Points:
        if not self.size:
            return self.surface.points
        return self.program(parameters)[0]

    @override
    def bind(self, *geometries: Any, names: Any = None) -> "Modelled":
        return Modelled(self, self.surface)

    def differences(self, parameters: Vector | None = None) -> Differences:
        """Derivatives by all parameters, with their errors and steps."""
        values = self.values if parameters is None else parameters
        return self.program.differences(np.asarray(values, float))


class Modelled(AbstractMaking):
    """A shape of another program with what it makes of its own values; never compiled.

    So its errors (a changed topology, a program that fails) stay what they are.
    """

    shape: AbstractShape
    geometry: Surface

    @override
    def __call__(self, parameters: Vector, *points: Any) -> Points:
        return self.shape(parameters)


class _Form:
    """Points for parameters, with the owners and triangles of the first shape."""

    def __init__(self, source: Any, given: Given, mesh: Tessellation):
        self.source, self.mesh = source, mesh
        self.parts, self.scale = given.parts, given.scale

    def __call__(self, parameters: Mapping[str, Any]) -> np.ndarray:
        given = self.source(parameters)
        if clause := difference(self.parts, given.parts):
            told = ", ".join(f"{name} = {value}" for name, value in parameters.items())
            raise GeometryError(
                f"at {told} the CAD shape has another topology than at first: {clause}; begin "
                "from parameters whose shape is like this one, or keep them nearer"
            )
        return self.mesh.owners(given.parts) * self.scale


def _source(file: Path | None, script: Path | None, parameters: Any, unit: str | None) -> Any:
    """What makes a shape of parameters by name."""
    if (file is None) == (script is None):
        raise ParameterError(f"give a file or a script, got file = {file} and script = {script}")
    if script is not None:
        return Script(Path(script), unit or "m")
    if parameters:
        raise ParameterError(
            f"a STEP file has no parameters, got {', '.join(parameters)}; a script has"
        )
    if unit is not None:
        raise ParameterError(f"a STEP file states its unit, got unit = {unit!r}; leave it out")
    given = from_step(Path(str(file)))
    return lambda parameters: given


def _fineness(
    given: Given, max_edge: float | None, sag: float | None, angle: float | None, degrees: bool
) -> Fineness:
    """What is asked for, else parts of the shape's extent, in the shape's unit."""
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


def _check_closed(faces: np.ndarray, given: Given) -> None:
    """Refuse triangles that are open where the shape is closed: the mesher failed there."""
    if open_edges(given.parts):
        return
    pairs = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    count = int(faces.max()) + 1
    there, back = np.sort(pairs @ [count, 1]), np.sort(pairs[:, ::-1] @ [count, 1])
    if not np.array_equal(there, back):
        odd = len(np.setxor1d(there, back)) // 2
        raise GeometryError(
            f"OpenCascade's triangles leave {odd} edges open on a closed shape; make sag smaller, "
            "or heal the shape"
        )
