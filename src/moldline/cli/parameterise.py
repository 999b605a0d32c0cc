"""`moldline parameterise`."""

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import values

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..pipeline.pipeline import Pipeline

HELP = "Write a case file to begin with for a geometry, and a picture of it."
EXAMPLE = """\
  moldline parameterise wing.tri --kind lattice --shape 8x6x2 -o case.toml
  moldline parameterise wing.tri --kind lattice --region 24,3,2,30,8,6 -o case.toml
  moldline parameterise wing.tri --kind wing-lattice --shape 7x5x2 -o case.toml
  moldline parameterise wing.tri --kind wing-skeleton --stations 4 -o case.toml
  moldline parameterise wing.tri --kind wing-skeleton --sections turned \
      --sweep-at 0.25 --twist-at 0.25 -o case.toml
  moldline parameterise body.stl --kind cage --faces 150 --offset 0.05 -o case.toml"""

KINDS = (
    "lattice", "wing-lattice", "cage", "wing-cage", "body-cage", "wing-skeleton", "body-skeleton"
)  # fmt: skip


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    command.add_argument("source", type=Path, help="geometry; its content tells the format")
    command.add_argument("--kind", choices=KINDS, required=True, help="what moves it")
    command.add_argument("-o", "--output", type=Path, required=True, help="case file to write")
    command.add_argument("--units", choices=("m", "cm", "mm", "in", "ft"), help="of the geometry")
    command.add_argument("--component", help="only what this component of the geometry covers")
    command.add_argument(
        "--shape", metavar="IxJxK", help="lattices: control points along each axis"
    )
    command.add_argument(
        "--region", metavar="X,Y,Z,X,Y,Z", help="lattice: two opposite corners of the part to move"
    )
    command.add_argument(
        "--align",
        choices=("axes", "principal"),
        help="lattice: along the axes of space, or its own",
    )
    command.add_argument(
        "--stations", help="wings and bodies: how many, or their places: 4, or 0,10,25"
    )
    command.add_argument(
        "--sections",
        choices=("streamwise", "turned"),
        help="wing-skeleton: do sections stay in their planes, or turn with sweep and dihedral",
    )
    command.add_argument(
        "--sweep-at",
        type=float,
        metavar="SHARE",
        help="wing-skeleton: of the chord, where sweep is",
    )
    command.add_argument(
        "--twist-at",
        type=float,
        metavar="SHARE",
        help="wing-skeleton: of the chord, where dihedral and twist are",
    )
    command.add_argument("--faces", type=int, help="cage: about how many triangles")
    command.add_argument(
        "--offset", type=float, help="cages: distance from the geometry, as a part of its size"
    )
    command.add_argument("--overwrite", action="store_true", help="write over what is there")


def run(given: argparse.Namespace) -> int:
    """Do it."""
    from ..case.parameterise import parameterise
    from ..errors import FileError
    from ..plot import save

    picture = given.output.with_suffix(".png")
    for path in (given.output, picture):
        if path.exists() and not given.overwrite:
            raise FileError(f"{path}: is there already; choose another name, or --overwrite")
    options = {"component": given.component, "align": given.align, "faces": given.faces}
    options |= {"offset": given.offset, "shape": _shape(given.shape), "region": _region(given)}
    options |= {"stations": _stations(given.stations), "sections": given.sections}
    options |= {"sweep_at": given.sweep_at, "twist_at": given.twist_at}
    case, why = parameterise(given.source, given.output, given.kind, units=given.units, **options)
    save(_picture(case.pipeline, given.source.stem.replace("_", " ")), picture)
    print(why)
    for variable in case.pipeline.variables.values():
        size = f"{variable.size} number{'s' * (variable.size > 1)}"
        print(f"  {variable.name:16} {size} [{variable.unit}]")
    print(f"{given.output}\n{picture}")
    return 0


def _picture(pipeline: "Pipeline", title: str) -> "Figure":
    """The geometry once, since nothing has moved yet, with its control points."""
    from ..mesh import Surface
    from ..plot import draw_net, of_deformation, of_geometry
    from ..plot.pictures import nets

    if not isinstance(pipeline.geometry, Surface):
        return of_deformation(pipeline, title=title)
    figure = of_geometry(pipeline.geometry, title=title)
    for net in nets(pipeline):
        draw_net(figure.axes[0], net.lines, net.rest)
    return figure


def _shape(text: str | None) -> tuple[int, ...] | None:
    from ..errors import ParameterError

    if text is None:
        return None
    if re.fullmatch(r"\d{1,4}x\d{1,4}x\d{1,4}", text) is None:
        raise ParameterError(f"--shape {text}: expected three counts, such as 7x4x2")
    return tuple(map(int, text.split("x")))


def _region(given: argparse.Namespace) -> list[list[float]] | None:
    from ..errors import ParameterError

    if given.region is None:
        return None
    corners = values.numbers(given.region, "--region")
    if len(corners) != 6:
        raise ParameterError(f"--region {given.region}: expected six numbers, x,y,z,x,y,z")
    return [corners[:3], corners[3:]]


def _stations(text: str | None) -> Any:
    if text is None or "," not in text:
        return None if text is None else int(values.numbers(text, "--stations")[0])
    return tuple(values.numbers(text, "--stations"))
