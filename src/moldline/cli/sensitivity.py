"""`moldline sensitivity`."""

import argparse
from pathlib import Path

from . import show, values

HELP = "Write the deformed geometry with its exact derivatives by the design variables."
EXAMPLE = """\
  moldline sensitivity examples/transport_wing.toml --variable thickness -o wing.vtp
  moldline sensitivity examples/transport_wing.toml -o Components.trix     (Cart3D, one file)
  moldline sensitivity examples/transport_wing.toml -o geometry --per-variable"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    values.configure(command)
    command.add_argument(
        "-o",
        "--output",
        type=Path,
        help="file to write: .trix or .vtp (surfaces), .npz or .h5 (anything)",
    )
    command.add_argument(
        "--per-variable",
        action="store_true",
        help="the output is a folder: a Cart3D file NAME/Components.i.tri below it per number",
    )
    command.add_argument(
        "--variable", action="append", metavar="NAME", help="only this one; may be repeated"
    )
    command.add_argument("--json", action="store_true", help="report for a script")


def run(given: argparse.Namespace) -> int:
    """Do it."""
    import numpy as np

    from ..case import load
    from ..errors import ParameterError
    from ..mesh.io.sensitivities import write_sensitivities

    case = load(given.case)
    chosen = values.chosen(case, given)
    target = given.output or case.output("sensitivity")
    if target is None:
        raise ParameterError("where to? give -o FILE, or output.sensitivity in the case file")
    names = given.variable or list(case.pipeline.variables)
    columns = {
        label: column
        for name in names
        for label, column in case.pipeline.labelled_sensitivity(chosen, name).items()
    }
    write_sensitivities(
        target, case.pipeline(chosen), columns, case.units(), per_variable=given.per_variable
    )
    largest = {k: float(np.linalg.norm(c, axis=1).max()) for k, c in columns.items()}
    reach = {k: int(np.count_nonzero(np.any(c != 0, axis=1))) for k, c in columns.items()}
    report = {"file": str(target), "largest": largest, "points_moved": reach}
    width = max(map(len, columns), default=0)
    lines = [
        f"{target}: derivatives of {len(case.pipeline.geometry.points)} points by "
        f"{len(columns)} numbers",
        *(f"  {k:{width}}  largest {largest[k]:.6g}, moves {reach[k]} points" for k in columns),
    ]
    show(report, given.json, lines)
    return 0
