"""`moldline convert`."""

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..mesh import Geometry

HELP = "Read a geometry file and write it in another format, unit or kind."
EXAMPLE = """\
  moldline convert wing.stl wing.tri
  moldline convert wing_inches.stl wing.tri --from-units in --to-units m
  moldline convert crm.xyz crm.tri --component wing=3-6,9-12,17,18 --cap y
  moldline convert wing.xyz wing.step --from-units m --tolerance 1e-4
  moldline convert flow.su2 wing.stl --marker WING
  moldline convert inv_ONERAM6_ffd.cfg case.toml     (an SU2 case with FFD boxes)
  moldline convert case.toml model.xml               (a case as a Model of XDDM, and back)"""

UNITS = ("m", "cm", "mm", "in", "ft")

_BLOCKS = re.compile(r"\d{1,6}(-\d{1,6})?(,\d{1,6}(-\d{1,6})?)*")


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    command.add_argument("source", type=Path, help="file to read; its content tells the format")
    command.add_argument("target", type=Path, help="file to write; its name tells the format")
    command.add_argument("--from-units", choices=UNITS, help="the source's unit of length")
    command.add_argument("--to-units", choices=UNITS, help="the target's unit of length")
    command.add_argument(
        "--component",
        action="append",
        default=[],
        metavar="NAME=BLOCKS",
        help="name blocks of a grid, counted from 1, e.g. wing=3-6,17; may be given several times",
    )
    command.add_argument(
        "--cap", metavar="PLANE", help="close openings in a plane: x, y or z, or e.g. y=0.5"
    )
    command.add_argument("--uncap", action="store_true", help="drop the component of a cap")
    command.add_argument("--tag", default="symmetry", help="the cap's component (default symmetry)")
    command.add_argument(
        "--marker", action="append", metavar="NAME", help="of a volume mesh: only these markers"
    )
    command.add_argument(
        "--tolerance", type=float, help="STEP: largest distance of points [the target's unit]"
    )


def run(given: argparse.Namespace) -> int:
    """Do it."""
    from ..errors import ParameterError
    from ..mesh.conversion import converted
    from ..mesh.io import named_by, read, write

    if given.source.suffix.lower() == ".cfg":
        return _su2_case(given.source, given.target)
    if given.source.suffix.lower() in (".toml", ".xml"):
        return _document(given.source, given.target)
    target = named_by(given.target)
    if target.NAME == "STEP":
        return _step(given)
    if (given.from_units is None) != (given.to_units is None):
        raise ParameterError("--from-units and --to-units go together")
    if given.tolerance is not None:
        raise ParameterError("--tolerance is for STEP, whose surfaces are fitted")
    geometry = read(given.source, units=given.from_units)
    named = _blocks(given.component)
    geometry, notes = converted(geometry, target.HOLDS, named, given.marker)
    geometry, more = _capped(geometry, given)
    write(given.target, geometry, units=given.to_units)
    print(f"{given.target}: {type(geometry).__name__} of {len(geometry.points)} points")
    for note in [*notes, *more]:
        print(f"  {note}")
    return 0


def _capped(geometry: "Geometry", given: argparse.Namespace) -> "tuple[Geometry, list[str]]":
    """With a cap, without one, or as it is."""
    from ..errors import ParameterError
    from ..mesh import Surface
    from ..mesh.cap import capped, uncapped

    if not (given.cap or given.uncap):
        return geometry, []
    if not isinstance(geometry, Surface):
        kind = type(geometry).__name__
        raise ParameterError(f"a cap is a surface's, got a {kind}; write it as a surface")
    notes = []
    if given.uncap:
        geometry = uncapped(geometry, given.tag)
        notes.append(f"component {given.tag} dropped")
    if given.cap:
        plane, at = _plane(given.cap)
        geometry, report = capped(geometry, given.tag, plane, at)
        notes += report.sentences()
    names = ", ".join(f"{k} {name}" for k, name in enumerate(geometry.components, start=1))
    return geometry, [*notes, f"components: {names}"]


def _step(given: argparse.Namespace) -> int:
    """Patches become smooth surfaces."""
    from ..errors import ParameterError
    from ..mesh import Grid
    from ..mesh.io import METRES, read, step

    if given.from_units is None:
        raise ParameterError("a STEP file states its unit: give --from-units, and --to-units too "
                             "if it is to be another")  # fmt: skip
    if given.cap or given.uncap or given.marker:
        raise ParameterError("STEP holds patches, which have no cap and no markers")
    unit = given.to_units or given.from_units
    grid = read(given.source)
    if not isinstance(grid, Grid):
        kind = type(grid).__name__
        raise ParameterError(f"{given.source}: STEP is made of structured patches, got a {kind}")
    if unit != given.from_units:
        grid = grid.moved(grid.points * (METRES[given.from_units] / METRES[unit]))
    patches = step.write(given.target, grid, unit, given.tolerance, _blocks(given.component))
    worst = max(range(len(patches)), key=lambda k: patches[k].deviation)
    poles = sum(patch.poles.shape[0] * patch.poles.shape[1] for patch in patches)
    print(
        f"{given.target}: {len(patches)} B-spline surfaces with {poles} poles for "
        f"{len(grid.points)} points\n"
        f"  largest deviation {patches[worst].deviation:.3g} {unit} in block {worst + 1}"
    )
    return 0


def _blocks(given: list[str]) -> dict[str, list[int]]:
    """Block numbers by name."""
    from ..errors import ParameterError

    named: dict[str, list[int]] = {}
    for text in given:
        name, _, blocks = text.partition("=")
        if not name or not _BLOCKS.fullmatch(blocks):
            raise ParameterError(f"--component {text!r}: expected NAME=BLOCKS, e.g. wing=3-6,17")
        for part in blocks.split(","):
            first, _, last = part.partition("-")
            named.setdefault(name, []).extend(range(int(first), int(last or first) + 1))
    return named


def _plane(text: str) -> tuple[str, float]:
    from ..errors import ParameterError

    plane, _, at = text.partition("=")
    try:
        return plane, float(at or 0)
    except ValueError:
        raise ParameterError(f"--cap {text!r}: expected a place such as y=0.5") from None


def _document(source: Path, target: Path) -> int:
    """A case becomes a Model of XDDM, or a Model a case."""
    from ..case import load
    from ..errors import ParameterError
    from ..xddm import document
    from ..xddm.to_case import to_case
    from ..xddm.to_model import to_model

    kinds = source.suffix.lower(), target.suffix.lower()
    if kinds == (".toml", ".xml"):
        made = to_model(load(source), target)
        made.document.save(target)
        count, notes = len(made.document.by_name) - 1, made.notes
    elif kinds == (".xml", ".toml"):
        stated = to_case(document.read(source))
        stated.save(target)
        count = len(stated.tables.variable) + len(stated.tables.measure)
        notes = stated.notes
    else:
        wanted = ".xml" if kinds[0] == ".toml" else ".toml"
        raise ParameterError(f"{target}: from {source.name} a {wanted} file is made; name it so")
    print(f"{target}: {count} variables, measures and bounds")
    for note in notes:
        print(f"  {note}")
    return 0


def _su2_case(source: Path, target: Path) -> int:
    """An SU2 configuration and its mesh become a case file and a surface."""
    from ..case.su2_config import convert

    made = convert(source, target)
    print(f"{target}: {made.variables} design variables, which move {made.surface}")
    for note in made.notes:
        print(f"  note: {note}")
    return 0
