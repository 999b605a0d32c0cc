"""`moldline info`."""

import argparse
from pathlib import Path

from . import show

HELP = "Tell what a geometry file holds."
EXAMPLE = "  moldline info examples/data/transport_wing.tri"


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    command.add_argument("file", type=Path, help="geometry file, of any format that is read")
    command.add_argument("--json", action="store_true", help="report for a script")


def run(given: argparse.Namespace) -> int:
    """Do it."""
    from ..mesh.summary import summary

    report = summary(given.file)
    width = max(map(len, report))
    lines = [f"{key.replace('_', ' '):{width}}  {_told(value)}" for key, value in report.items()]
    show(report, given.json, lines)
    return 0


def _told(value: object) -> str:
    if isinstance(value, list):
        return ", ".join(map(_told, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
