"""A modeler of OpenVSP models, through its Python module."""

import importlib
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import numpy as np
from typing_extensions import override

from ..errors import FileError, GeometryError, ParameterError
from ..mesh import Surface
from ..mesh.io import read
from .differencing import AbstractProgrammed, Programmed

Unit = Literal["m", "cm", "mm", "in", "ft"]


class OpenVsp(AbstractProgrammed):
    """A model of OpenVSP: parameters are set, and its triangles read back as it exports them.

    OpenVSP's own tessellation follows the surfaces' parameters, so its triangles stay the same
    while numbers of points do; where they change, that is an error. Its Cart3D files hold about
    ten decimals: steps of differences must not be small. Tried with a stand-in for the module
    only, which behaves as its documentation says.

    Attributes
    ----------
    program
        What makes the points of the parameters.
    surface
        The triangles of the parameters' own values [m].
    """

    program: Programmed = eqx.field(static=True)
    surface: Surface

    def __init__(
        self,
        file: Path,
        parameters: dict[str, float] | None = None,
        where: dict[str, str] | None = None,
        *,
        steps: dict[str, float] | None = None,
        unit: Unit = "m",
    ):
        """From a .vsp3 `file` and the parameters to set, in its own units.

        `where` says what a parameter is in OpenVSP, as "geom/group/parm" such as
        "MainWing/WingGeom/TotalSpan"; one that it does not name has that for a name. `unit` is
        the model's unit of length.
        """
        model = _Model(Path(file), dict(where or {}), unit)
        model.named(parameters or {})
        self.surface = model.surface(parameters or {})
        model.faces = np.asarray(self.surface.faces)
        points = np.asarray(self.surface.points)
        self.program = Programmed(model, parameters or {}, steps, points)

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "OpenVsp":
        return cls(folder / options.pop("file"), **options)


class _Model:
    """A model that is read anew for each set of parameters: OpenVSP has one at a time."""

    faces: np.ndarray | None = None

    def __init__(self, file: Path, where: dict[str, str], unit: str):
        if not file.is_file():
            raise FileError(f"{file}: there is no such file")
        self.file, self.where, self.unit = file, where, unit
        try:
            self.vsp = importlib.import_module("openvsp")
        except ImportError:
            raise ParameterError(
                "OpenVSP's Python module is not installed; it comes with OpenVSP (openvsp.org), in "
                "its folder python: pip install ./openvsp_config ./degen_geom ./utilities ./openvsp"
            ) from None

    def named(self, parameters: Mapping[str, Any]) -> dict[str, tuple[str, str, str]]:
        """Geom, group and parm of each parameter."""
        if unknown := set(self.where) - set(parameters):
            raise ParameterError(f"where names {', '.join(sorted(unknown))}, no parameters")
        found = {}
        for name in parameters:
            parts = self.where.get(name, name).split("/")
            if len(parts) != 3:
                raise ParameterError(
                    f"parameter {name!r} is not said as geom/group/parm, such as "
                    f"MainWing/WingGeom/TotalSpan; got {self.where.get(name, name)!r}"
                )
            found[name] = (parts[0], parts[1], parts[2])
        return found

    def __call__(self, parameters: Mapping[str, Any]) -> np.ndarray:
        made = self.surface(parameters)
        if self.faces is not None and not np.array_equal(made.faces, self.faces):
            raise GeometryError(
                f"{self.file}: at {dict(parameters)} OpenVSP makes other triangles "
                f"({len(made.faces)}) than at first ({len(self.faces)}); parameters that change "
                "numbers of points or sections cannot be differentiated"
            )
        return np.asarray(made.points)

    def surface(self, parameters: Mapping[str, Any]) -> Surface:
        """What OpenVSP exports."""
        vsp = self.vsp
        vsp.ClearVSPModel()
        vsp.ReadVSPFile(str(self.file))
        for name, (geom, group, parm) in self.named(parameters).items():
            vsp.SetParmVal(self._parm(name, geom, group, parm), float(parameters[name]))
        vsp.Update()
        with tempfile.TemporaryDirectory(prefix="moldline_vsp_") as folder:
            path = Path(folder) / "model.tri"
            vsp.ExportFile(str(path), vsp.SET_ALL, vsp.EXPORT_CART3D)
            if not path.is_file():
                raise GeometryError(f"{self.file}: OpenVSP exports no triangles")
            made = read(path, units=self.unit, format="tri")
        if not isinstance(made, Surface):
            raise GeometryError(f"{self.file}: OpenVSP exports no triangles")
        return made

    def _parm(self, name: str, geom: str, group: str, parm: str) -> str:
        found = list(self.vsp.FindGeomsWithName(geom))
        if len(found) != 1:
            raise ParameterError(
                f"{self.file}: {len(found)} geoms are named {geom!r}, which parameter {name!r} is "
                "of; expected one"
            )
        number = self.vsp.FindParm(found[0], parm, group)
        if not number:
            raise ParameterError(
                f"{self.file}: {geom!r} has no parm {parm!r} in a group {group!r}, which parameter "
                f"{name!r} is"
            )
        return number
