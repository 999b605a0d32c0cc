"""`moldline deform`."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import show, values

if TYPE_CHECKING:
    from ..case import Case

HELP = "Deform a case's geometry by its variables' values and write it."
EXAMPLE = """\
  moldline deform examples/transport_wing.toml --set thickness[3]=0.1 -o wing_new.tri
  moldline deform huge.toml --stream -o huge_new.tri"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    values.configure(command)
    command.add_argument(
        "-o", "--output", type=Path, help="file to write; its name tells the format"
    )
    command.add_argument("--rider", help="deform this rider of the case instead of its geometry")
    command.add_argument(
        "--stream",
        action="store_true",
        help="file to file, some points at a time: for meshes larger than memory "
        "(binary tri, STL and PLOT3D)",
    )
    command.add_argument("--json", action="store_true", help="report for a script")


def run(given: argparse.Namespace) -> int:
    """Do it; 0 only if pilots, where there are some, hold what they are asked for."""
    import time

    from ..case import load
    from ..errors import ParameterError
    from ..mesh.io import write
    from ..pipeline import examine
    from ..pipeline.holding import holding
    from ..pipeline.making import largest_motion

    case = load(given.case, sampled=given.stream)
    chosen = values.chosen(case, given)
    pipeline = case.rider(given.rider) if given.rider else case.pipeline
    target = given.output or case.output("surface")
    if target is None:
        raise ParameterError("where to? give -o FILE, or output.surface in the case file")
    if given.stream:
        return _streamed(case, target, chosen, given)
    pipeline(chosen)
    start = time.perf_counter()
    shape = pipeline(chosen)
    seconds = time.perf_counter() - start
    write(target, shape, units=case.units(given.rider))
    moved = largest_motion(pipeline, chosen)
    torn, held = examine.tears(pipeline, chosen), holding(pipeline, chosen)
    report = {
        "points": len(shape.points),
        "largest_motion": moved,
        "seconds": seconds,
        "file": str(target),
        "tears": [vars(tear) for tear in torn],
        "pilots": [one.as_dict() for one in held],
    }
    lines = [
        f"{target}: {len(shape.points)} points, moved by up to {moved:.6g}, "
        f"in {1e3 * seconds:.2f} ms",
        *map(str, torn),
        *(line for one in held for line in one.sentences()),
    ]
    show(report, given.json, lines)
    return 0 if all(one.is_met for one in held) else 1


def _streamed(case: "Case", target: Path, chosen: dict[str, Any], given: argparse.Namespace) -> int:
    from ..case import streaming

    points, moved = streaming.deform(case, target, chosen, given.rider)
    report = {"points": points, "largest_motion": moved, "file": str(target)}
    show(report, given.json, [f"{target}: {points} points, moved by up to {moved:.6g}"])
    return 0
