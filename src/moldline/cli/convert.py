"""`moldline convert`."""

import argparse
from pathlib import Path

HELP = "Read a geometry file and write it in another format or unit."
EXAMPLE = """\
  moldline convert wing.stl wing.tri
  moldline convert wing_inches.stl wing.tri --from-units in --to-units m
  moldline convert inv_ONERAM6_ffd.cfg case.toml     (an SU2 case with FFD boxes)"""

UNITS = ("m", "cm", "mm", "in", "ft")


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    command.add_argument("source", type=Path, help="file to read; its content tells the format")
    command.add_argument("target", type=Path, help="file to write; its name tells the format")
    command.add_argument("--from-units", choices=UNITS, help="the source's unit of length")
    command.add_argument("--to-units", choices=UNITS, help="the target's unit of length")


def run(given: argparse.Namespace) -> int:
    """Do it."""
    from ..errors import ParameterError
    from ..mesh.io import read, write

    if given.source.suffix.lower() == ".cfg":
        return _su2_case(given.source, given.target)
    if (given.from_units is None) != (given.to_units is None):
        raise ParameterError("--from-units and --to-units go together")
    geometry = read(given.source, units=given.from_units)
    write(given.target, geometry, units=given.to_units)
    print(f"{given.target}: {type(geometry).__name__} of {len(geometry.points)} points")
    return 0


def _su2_case(source: Path, target: Path) -> int:
    """An SU2 configuration and its mesh become a case file and a surface."""
    from ..case.su2_config import convert

    made = convert(source, target)
    print(f"{target}: {made.variables} design variables, which move {made.surface}")
    for note in made.notes:
        print(f"  note: {note}")
    return 0
