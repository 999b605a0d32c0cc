"""A modeler of CAD shapes: a STEP file, or a modelling script with parameters."""

from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import numpy as np
from typing_extensions import override

from ..errors import ParameterError
from ..mesh import Surface
from .cad_form import Asked, Form, Parts
from .cad_sources import METRES, Script, from_step
from .differencing import AbstractProgrammed, Programmed
from .quantities import choices

Unit = Literal["m", "cm", "mm", "in", "ft"]


class Cad(AbstractProgrammed):
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
        choices(unit=(unit, (None, *METRES)))
        source = _source(file, script, parameters, unit)
        asked = Asked(max_edge, sag, angle, degrees, components, groups)
        form = Form(source, parameters or {}, asked)
        self.program = Programmed(form, parameters or {}, steps, np.asarray(form.surface.points))
        self.surface, self.open_edges = form.surface, form.open_edges

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "Cad":
        paths = {k: folder / options.pop(k) for k in ("file", "script") if options.get(k)}
        return cls(**options, **paths)


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
