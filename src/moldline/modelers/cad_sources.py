"""CAD shapes from STEP files and from modelling scripts."""

import importlib.util
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import FileError, GeometryError
from .cad_topology import Topology, opencascade, topology

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
"""Units of length that a script may reckon in."""


class Given(NamedTuple):
    """A shape, and what its file or script says about it.

    Attributes
    ----------
    shape
        OpenCascade's.
    parts
        Its faces, edges and vertices.
    scale
        Its unit of length [m].
    names, colours
        Of each face; empty where there is none.
    """

    shape: Any
    parts: Topology
    scale: float
    names: tuple[str, ...]
    colours: tuple[str, ...]


def from_step(path: Path) -> Given:
    """All that a STEP file holds; it states its unit.

    A face's name is its own, else that of its solid or surface model.
    """
    if not path.is_file():
        raise FileError(f"{path}: there is no such file")
    occ = opencascade()
    name = occ.TCollection.TCollection_ExtendedString("moldline")
    document = occ.TDocStd.TDocStd_Document(name)
    occ.XCAFApp.XCAFApp_Application.GetApplication_s().InitDocument(document)
    caf = occ.STEPCAFControl.STEPCAFControl_Reader()
    with quiet():
        done = caf.ReadFile(str(path))
        if done != occ.IFSelect.IFSelect_ReturnStatus.IFSelect_RetDone:
            raise FileError(f"{path}: OpenCascade cannot read it as STEP ({done.name})")
        caf.Transfer(document)
    shape = caf.Reader().OneShape()
    if shape is None or shape.IsNull():
        raise FileError(f"{path}: it holds no shape; were only drawings exported?")
    try:
        parts = topology(shape)
    except GeometryError as error:
        raise GeometryError(f"{path}: {error}") from None
    colours = occ.XCAFDoc.XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    entities = caf.Reader().WS().TransferReader()
    return Given(
        shape, parts, 1e-3, _names(shape, parts, entities), _colours(shape, parts, colours)
    )


def _names(shape: Any, parts: Topology, entities: Any) -> tuple[str, ...]:
    """Each face's name, else that of what it is part of."""
    kinds = opencascade().TopAbs.TopAbs_ShapeEnum
    names = [""] * len(parts.faces)
    for kind in (kinds.TopAbs_FACE, kinds.TopAbs_SHELL, kinds.TopAbs_SOLID):
        for group, own in _members(shape, parts, kind):
            entity = entities.EntityFromShapeResult(group, 1)
            said = entity.Name() if hasattr(entity, "Name") else None
            text = said.ToCString().strip() if said is not None else ""
            for face in own:
                names[face] = names[face] or text
    return tuple(names)


def _colours(shape: Any, parts: Topology, tool: Any) -> tuple[str, ...]:
    """Each face's colour as hexadecimal red, green and blue, else that of its solid."""
    occ = opencascade()
    kinds, surface = occ.TopAbs.TopAbs_ShapeEnum, occ.XCAFDoc.XCAFDoc_ColorType
    colours = [""] * len(parts.faces)
    for kind in (kinds.TopAbs_FACE, kinds.TopAbs_SHELL, kinds.TopAbs_SOLID):
        for group, own in _members(shape, parts, kind):
            colour = occ.Quantity.Quantity_Color()
            for way in (surface.XCAFDoc_ColorSurf, surface.XCAFDoc_ColorGen):
                if tool.GetColor(group, way, colour):
                    text = occ.Quantity.Quantity_Color.ColorToHex_s(colour).ToCString().lower()
                    for face in own:
                        colours[face] = colours[face] or text
                    break
    return tuple(colours)


def _members(shape: Any, parts: Topology, kind: Any) -> Iterator[tuple[Any, list[int]]]:
    """Parts of a kind, each with the numbers of its faces."""
    occ = opencascade()
    order = occ.collections.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    for face in parts.faces:
        order.Add(face.shape)
    for group in _once(shape, kind):
        faces = _once(group, occ.TopAbs.TopAbs_ShapeEnum.TopAbs_FACE)
        yield group, [order.FindIndex(face) - 1 for face in faces]


def _once(shape: Any, kind: Any) -> list[Any]:
    occ = opencascade()
    found = occ.collections.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    occ.TopExp.TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(k) for k in range(1, found.Extent() + 1)]


class Script:
    """A Python file whose function `make(parameters)` returns a shape; it is run when loaded.

    The parameters come as a dictionary of numbers and lists of numbers. What it returns is a
    `TopoDS_Shape`, an object that has one as `wrapped`, or a dictionary of these, whose names
    become components.
    """

    def __init__(self, path: Path, unit: str):
        opencascade()
        self.path, self.scale = path, METRES[unit]
        self.make = _loaded(path)

    def __call__(self, parameters: Mapping[str, Any]) -> Given:
        """The shape for some parameters."""
        told = ", ".join(f"{name} = {value}" for name, value in parameters.items())
        try:
            made = self.make(dict(parameters))
        except Exception as error:
            raise GeometryError(
                f"{self.path}: make fails at {told or 'no parameters'}: "
                f"{type(error).__name__}: {error}"
            ) from error
        named = made if isinstance(made, Mapping) else {"": made}
        shapes = {str(name): self._shape(one) for name, one in named.items()}
        shape = _compound(list(shapes.values()))
        try:
            parts = topology(shape)
        except GeometryError as error:
            raise GeometryError(f"{self.path}: what make returns at {told}: {error}") from None
        kind = opencascade().TopAbs.TopAbs_ShapeEnum.TopAbs_FACE
        names = [""] * len(parts.faces)
        for name, one in shapes.items():
            for _, own in _members(one, parts, kind):
                for face in own:
                    names[face] = names[face] or name
        return Given(shape, parts, self.scale, tuple(names), ())

    def _shape(self, made: Any) -> Any:
        own = getattr(made, "wrapped", made)
        if not isinstance(own, opencascade().TopoDS.TopoDS_Shape) or own.IsNull():
            raise GeometryError(
                f"{self.path}: make must return an OpenCascade shape, an object that has one as "
                f"`wrapped`, or a dictionary of these; got {type(made).__name__}"
            )
        return own


def _loaded(path: Path) -> Callable[[Mapping[str, Any]], Any]:
    if not path.is_file():
        raise FileError(f"{path}: there is no such file")
    spec = importlib.util.spec_from_file_location(f"moldline_script_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise FileError(f"{path}: a script is a Python file, with the suffix .py")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise FileError(f"{path}: it cannot be run: {type(error).__name__}: {error}") from error
    make = getattr(module, "make", None)
    if not callable(make):
        raise FileError(f"{path}: it has no function make(parameters) that returns a shape")
    return make


def _compound(shapes: list[Any]) -> Any:
    if len(shapes) == 1:
        return shapes[0]
    occ = opencascade()
    builder, compound = occ.BRep.BRep_Builder(), occ.TopoDS.TopoDS_Compound()
    builder.MakeCompound(compound)
    for shape in shapes:
        builder.Add(compound, shape)
    return compound


@contextmanager
def quiet() -> Iterator[None]:
    """Keep OpenCascade's progress off the standard output; its failures are still told."""
    occ = opencascade()
    printers = list(occ.Message.Message.DefaultMessenger_s().Printers())
    levels = [printer.GetTraceLevel() for printer in printers]
    for printer in printers:
        printer.SetTraceLevel(occ.Message.Message_Gravity.Message_Fail)
    try:
        yield
    finally:
        for printer, level in zip(printers, levels, strict=True):
            printer.SetTraceLevel(level)
