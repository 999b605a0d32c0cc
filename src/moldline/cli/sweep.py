"""`moldline sweep`."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import show, values

if TYPE_CHECKING:
    from ..case import Case
    from ..case.samples import Samples
    from ..workers import AbstractExecutor

HELP = "Make, measure and draw many shapes of a case, between its bounds or from a table."
EXAMPLE = """\
  moldline sweep examples/wing_body.toml --samples 1000 -o study
  moldline sweep examples/wing_body.toml --table values.csv --shapes study/shapes -o study
  moldline sweep case.toml --samples 1000 --executor dask --scheduler tcp://node1:8786"""

TOLD = 5
"""Failures that are told one by one."""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    values.configure(command)
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--samples", type=values.count, metavar="N", help="Latin hypercube of N")
    which.add_argument(
        "--table", type=Path, metavar="FILE", help="CSV file, its first line names t, t[1] ..."
    )
    command.add_argument("--seed", type=int, default=0, help="of the hypercube; 0 without it")
    command.add_argument(
        "--vary", action="append", default=[], metavar="NAME", help="only this variable, and so on"
    )
    command.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER", help="for the tables; CASE_sweep without it"
    )
    command.add_argument("--shapes", type=Path, metavar="FOLDER", help="write each geometry there")
    command.add_argument(
        "--format", default="tri", metavar="SUFFIX", help="of shapes: tri, stl ..."
    )
    command.add_argument("--pictures", type=Path, metavar="FOLDER", help="draw each shape there")
    command.add_argument("--limit", type=float, metavar="SECONDS", help="time of each sample")
    command.add_argument("--retry", action="store_true", help="try again what has failed")
    command.add_argument("--restart", action="store_true", help="forget what is done")
    command.add_argument(
        "--executor", choices=("processes", "serial", "dask"), default="processes",
        help="what samples run in; --jobs processes without it",
    )  # fmt: skip
    command.add_argument("--scheduler", metavar="ADDRESS", help="of Dask: tcp://node1:8786")
    command.add_argument("--json", action="store_true", help="report for a script")


def run(given: argparse.Namespace) -> int:
    """Do it; 0 only if every sample came out."""
    import contextlib
    import time

    from tqdm import tqdm

    from ..case import load
    from ..case.sweep import Sweep
    from ..mesh.io import named_by

    start = time.perf_counter()
    named_by(Path(f"x.{given.format}"))  # an unknown one is told before anything runs
    case = load(given.case)
    folder = given.output or Path(f"{given.case.stem}_sweep")
    sweep = Sweep(
        case, _samples(case, given), folder, shapes=given.shapes, format=given.format,
        pictures=given.pictures, is_anew=given.restart,
    )  # fmt: skip
    total, left = len(sweep.samples), len(sweep.waiting(given.retry))
    executor = _executor(given)
    try:
        with (
            tqdm(total=total, initial=total - left, desc="sweep", delay=2, leave=False) as bar,
            contextlib.closing(sweep.run(executor, given.limit, given.retry)) as records,
        ):
            for _ in records:
                bar.update()
    finally:
        executor.close()
    report, lines = _report(sweep.records, total - left, folder)
    show(report | {"seconds": time.perf_counter() - start}, given.json, lines)
    return 1 if report["failed"] else 0


def _samples(case: "Case", given: argparse.Namespace) -> "Samples":
    from ..case.samples import from_table, hypercube

    base = values.chosen(case, given)
    if given.table is not None:
        return from_table(case, given.table, base)
    return hypercube(case, given.samples, given.seed, given.vary, base)


def _executor(given: argparse.Namespace) -> "AbstractExecutor":
    from ..case.sweep import ALONE
    from ..errors import ParameterError
    from ..workers import Dask, Processes, Serial

    if (given.executor == "dask") != (given.scheduler is not None):
        raise ParameterError("--executor dask and --scheduler ADDRESS go together: give both")
    if given.executor == "dask":
        return Dask(given.scheduler)
    return Serial() if given.executor == "serial" else Processes(given.jobs, ALONE)


def _report(records: dict[int, Any], kept: int, folder: Path) -> tuple[dict, list[str]]:
    failed = {number: one.error for number, one in sorted(records.items()) if one.error}
    good = [one for one in records.values() if one.error is None]
    within = sum(one.is_within for one in good)
    report = {
        "folder": str(folder),
        "samples": len(records),
        "kept": kept,
        "done": len(good),
        "within": within,
        "failed": [{"sample": number, "error": error} for number, error in failed.items()],
    }
    lines = [
        f"{folder}: {len(good)} of {len(records)} samples done"
        + (f" ({kept} were before)" if kept else "")
        + f", {within} within their bounds",
        *(f"sample {n}: {error}" for n, error in list(failed.items())[:TOLD]),
    ]
    if len(failed) > TOLD:
        lines.append(f"... {len(failed)} failed in all; see {folder / 'sweep.csv'}")
    return report, lines
