"""`moldline plot`."""

import argparse
from pathlib import Path
from typing import Any

from . import values

HELP = "Draw a geometry, or a case before and after, or its sensitivity to one number."
EXAMPLE = """\
  moldline plot examples/data/transport_wing.tri -o wing.png
  moldline plot examples/transport_wing.toml -o before_and_after.png
  moldline plot examples/transport_wing.toml --sensitivity 'droop[1]' --view top -o map.png
  moldline plot examples/transport_wing.toml --cuts 5,15,25 -o sections.png
  moldline plot examples/transport_wing.toml --reflections -o smooth.png"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    values.configure(command)
    command.add_argument("-o", "--output", type=Path, help="picture: .png, .svg or .pdf")
    command.add_argument(
        "--view", default="iso", help="iso, iso-left, top, bottom, front, rear, side"
    )
    command.add_argument(
        "--sensitivity", metavar="NUMBER", help="colour by the derivative, e.g. droop or droop[1]"
    )
    command.add_argument("--cuts", metavar="Y,Y,...", help="draw sections at these y instead")
    command.add_argument(
        "--reflections", action="store_true", help="lamps in the polished surface: is it smooth?"
    )
    command.add_argument("--window", action="store_true", help="an interactive window (PyVista)")


def run(given: argparse.Namespace) -> int:
    """Do it."""
    from ..errors import ParameterError
    from ..plot.figure import save

    if (given.output is None) != given.window:
        raise ParameterError("give -o FILE for a picture, or --window for a window")
    if given.window:
        return _window(given)
    save(_picture(given), given.output)
    print(given.output)
    return 0


def _picture(given: argparse.Namespace) -> Any:
    from ..case import load
    from ..mesh.io import read
    from ..plot import of_reflections, pictures

    title = given.case.stem.replace("_", " ")
    if given.case.suffix.lower() != ".toml":
        geometry = read(given.case)
        if given.reflections:
            return of_reflections(_surface(geometry), given.view, title=title)
        return pictures.of_geometry(geometry, given.view, title)
    case = load(given.case)
    chosen = values.chosen(case, given)
    if given.sensitivity:
        number = given.sensitivity
        return pictures.of_sensitivity(case.pipeline, chosen, number, given.view, title)
    if given.cuts:
        return pictures.of_cuts(case.pipeline, chosen, values.numbers(given.cuts, "--cuts"))
    if given.reflections:
        return of_reflections(_surface(case.pipeline(chosen)), given.view, title=title)
    return pictures.of_deformation(case.pipeline, chosen, given.view, title)


def _surface(geometry: Any) -> Any:
    from ..errors import ParameterError
    from ..mesh import Surface

    if not isinstance(geometry, Surface):
        raise ParameterError(f"--reflections are a surface's, got a {type(geometry).__name__}")
    return geometry


def _window(given: argparse.Namespace) -> int:
    from ..case import load
    from ..mesh.io import read
    from ..plot import pictures, window

    if given.case.suffix.lower() != ".toml":
        window.show(read(given.case))
        return 0
    case = load(given.case)
    chosen = values.chosen(case, given)
    window.show(case.pipeline(chosen), nets=pictures.nets(case.pipeline, chosen))
    return 0
