"""`moldline build`."""

import argparse
from pathlib import Path

from . import show, values

HELP = "Make a case's geometry from its modelers and write it."
EXAMPLE = """\
  moldline build examples/wing_body.toml -o wing_body.tri
  moldline build examples/wing_body.toml --geometry wing --set sweep=30 -o wing.stl"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    values.configure(command)
    command.add_argument(
        "-o", "--output", type=Path, help="file to write; its name tells the format"
    )
    command.add_argument("--geometry", metavar="NAME", help="another of the case's geometries")
    command.add_argument("--picture", type=Path, help="draw it too: .png, .svg or .pdf")
    command.add_argument("--json", action="store_true", help="report for a script")


def run(given: argparse.Namespace) -> int:
    """Do it."""
    import time

    from ..case import load
    from ..errors import ParameterError
    from ..mesh.io import write
    from ..pipeline.making import made

    start = time.perf_counter()
    case = load(given.case)
    chosen = values.chosen(case, given)
    target = given.output or case.output("surface")
    if target is None:
        raise ParameterError("where to? give -o FILE, or output.surface in the case file")
    pipeline = case.pipeline.of(given.geometry) if given.geometry else case.pipeline
    report = made(pipeline, chosen)
    units = case.units() if pipeline.result == case.pipeline.result else None
    write(target, report.geometry, units=units)
    if given.picture:
        from ..plot import pictures, save

        save(pictures.of_geometry(report.geometry, title=pipeline.result), given.picture)
    seconds = time.perf_counter() - start
    told = report.as_dict() | {"file": str(target), "seconds": seconds}
    lines = [f"{target}: {pipeline.result}, {line}" for line in report.sentences()[:1]]
    show(told, given.json, [*lines, *report.sentences()[1:]])
    return 0
