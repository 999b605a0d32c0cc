"""`moldline info`."""

import argparse
from pathlib import Path

from . import show

HELP = "Tell what a geometry file holds, or draw the stages and variables of a case."
EXAMPLE = """\
  moldline info examples/data/transport_wing.tri
  moldline info examples/transport_wing.toml -o pipeline.png"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    command.add_argument(
        "file", type=Path, help="geometry file, of any format that is read, or case"
    )
    command.add_argument(
        "-o", "--output", type=Path, help="picture of a case's pipeline: .png, .svg or .pdf"
    )
    command.add_argument("--json", action="store_true", help="report for a script")


def run(given: argparse.Namespace) -> int:
    """Do it."""
    if given.file.suffix.lower() == ".toml":
        return _case(given)
    from ..errors import ParameterError
    from ..mesh.summary import summary

    if given.output is not None:
        raise ParameterError(
            "the picture is of a case's pipeline; `moldline plot` draws geometries"
        )
    report = summary(given.file)
    width = max(map(len, report))
    lines = [f"{key.replace('_', ' '):{width}}  {_told(value)}" for key, value in report.items()]
    show(report, given.json, lines)
    return 0


def _case(given: argparse.Namespace) -> int:
    from ..case import load
    from ..pipeline.overview import overview

    pipeline = load(given.file).pipeline
    told = overview(pipeline)
    if given.output is not None:
        from ..plot import of_pipeline, save

        save(of_pipeline(pipeline, title=given.file.stem.replace("_", " ")), given.output)
    show(told.as_dict(), given.json, told.sentences())
    return 0


def _told(value: object) -> str:
    if isinstance(value, list):
        return ", ".join(map(_told, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
