"""STEP: smooth surfaces fitted to patches, for CAD. It is only written.

Each surface patch of a grid becomes a face with a B-spline surface of its own, of third degree and
with continuous curvature, named by its component and block. The file states its unit of length.
Faces that share a whole border have the same curve there and are sewn into one shell.
OpenCascade writes it: `pip install 'moldline[step]'`.

Lost on writing: the points, which the surfaces meet within a tolerance, and which points were
joined. Sections become a patch by `mesh.fit.lofted`.
"""

import importlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import FileError, ParameterError
from ..grid import Grid
from .files import replacing

if TYPE_CHECKING:
    from ..fit import SplinePatch

NAME = "STEP"
SUFFIXES = (".step", ".stp")
HOLDS = Grid

UNITS = {"m": ("M", 1e3), "cm": ("CM", 10.0), "mm": ("MM", 1.0), "in": ("INCH", 25.4),
         "ft": ("FT", 304.8)}  # fmt: skip
"""OpenCascade's name of each unit, and its length in mm, in which OpenCascade reckons."""

FINE = 1e-5
"""Unless it is given, the tolerance of the fit is this part of the grid's extent."""


def sniff(head: bytes, path: Path | str) -> bool:
    """Whether it begins as STEP does."""
    return head.lstrip().startswith(b"ISO-10303-21")


def write(
    path: Path | str,
    grid: Grid,
    unit: str | None = None,
    tolerance: float | None = None,
    components: Mapping[str, Sequence[int]] | None = None,
) -> "tuple[SplinePatch, ...]":
    """Fit surfaces no farther than `tolerance` from the points, write them, and give them back.

    `unit` (m, mm, cm, in, ft) is what coordinates and tolerance are in, and what the file says.
    `components` names blocks, counted from 1, as in `mesh.stitch.stitched`.
    """
    from ..fit import fitted
    from ..stitch import named

    if unit not in UNITS:
        raise ParameterError(
            f"{path}: a STEP file states its unit of length, got {unit}; name one of "
            f"{', '.join(UNITS)}"
        )
    extent = float(np.linalg.norm(np.ptp(np.asarray(grid.points), axis=0)))
    owners, names = named(len(grid.shapes), components or {})
    with replacing(path) as file:
        occ = _opencascade(path)
        patches = fitted(grid, FINE * extent if tolerance is None else tolerance)
        titles = [
            str(number) if names[owner] == str(number) else f"{names[owner]} {number}"
            for number, owner in enumerate(owners.tolist(), start=1)
        ]
        file.write(_text(occ, path, patches, titles, unit))
    return patches


def _opencascade(path: Path | str) -> Any:
    try:
        return importlib.import_module("OCP.OCP")
    except ImportError:
        raise FileError(
            f"{path}: STEP needs OpenCascade; install it by: pip install 'moldline[step]'"
        ) from None


def _text(
    occ: Any, path: Path | str, patches: "Sequence[SplinePatch]", titles: list[str], unit: str
) -> bytes:
    """The whole file."""
    name, scale = UNITS[unit]
    sewing, faces = occ.BRepBuilderAPI.BRepBuilderAPI_Sewing(_CLOSE), []
    for patch, title in zip(patches, titles, strict=True):
        made = occ.BRepBuilderAPI.BRepBuilderAPI_MakeFace(_surface(occ, patch, scale), _CLOSE)
        if not made.IsDone():
            raise FileError(f"{path}: OpenCascade makes no face of block {title} ({made.Error()})")
        faces.append(made.Face())
        sewing.Add(faces[-1])
    with _quiet(occ):
        sewing.Perform()
        writer = occ.STEPControl.STEPControl_Writer()  # makes the settings known
        for key, value in (("write.step.unit", name), ("write.step.product.name", _stem(path))):
            occ.Interface.Interface_Static.SetCVal_s(key, value)
        done = writer.Transfer(
            sewing.SewedShape(), occ.STEPControl.STEPControl_StepModelType.STEPControl_AsIs
        )
        finder = writer.WS().TransferWriter().FinderProcess()
        for face, title in zip(faces, titles, strict=True):
            entity = occ.STEPConstruct.STEPConstruct.FindEntity_s(finder, sewing.Modified(face))
            entity.SetName(occ.TCollection.TCollection_HAsciiString(title))
        stream = BytesIO()
        written = writer.WriteStream(stream)
    right = occ.IFSelect.IFSelect_ReturnStatus.IFSelect_RetDone
    if (done, written) != (right, right):
        raise FileError(f"{path}: OpenCascade could not write it ({done}, {written})")
    return stream.getvalue()


_CLOSE = 1e-6
"""Points of a border nearer than this are one to OpenCascade [mm]."""


def _stem(path: Path | str) -> str:
    return Path(path).name.partition(".")[0].encode("ascii", "replace").decode() or "moldline"


def _surface(occ: Any, patch: "SplinePatch", scale: float) -> Any:
    rows, columns = patch.poles.shape[:2]
    poles = occ.collections.Array2_gp_Pnt(1, rows, 1, columns)
    for i, row in enumerate((patch.poles * scale).tolist(), start=1):
        for j, pole in enumerate(row, start=1):
            poles.SetValue(i, j, occ.gp.gp_Pnt(*pole))
    knots, counts = [], []
    for along in patch.knots:
        places, times = np.unique(along, return_counts=True)
        knots.append(_array(occ.collections.Array1_double, places))
        counts.append(_array(occ.collections.Array1_int, times))
    return occ.Geom.Geom_BSplineSurface(poles, *knots, *counts, *patch.degrees)


def _array(kind: Any, values: np.ndarray) -> Any:
    array = kind(1, len(values))
    for i, value in enumerate(values.tolist(), start=1):
        array.SetValue(i, value)
    return array


@contextmanager
def _quiet(occ: Any) -> Iterator[None]:
    """Keep OpenCascade's progress off the standard output; its failures are still told."""
    printers = list(occ.Message.Message.DefaultMessenger_s().Printers())
    levels = [printer.GetTraceLevel() for printer in printers]
    for printer in printers:
        printer.SetTraceLevel(occ.Message.Message_Gravity.Message_Fail)
    try:
        yield
    finally:
        for printer, level in zip(printers, levels, strict=True):
            printer.SetTraceLevel(level)
