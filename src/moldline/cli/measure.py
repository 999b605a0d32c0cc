"""`moldline measure`."""

import argparse
from typing import TYPE_CHECKING, Any

from . import show, values

if TYPE_CHECKING:
    import numpy as np

    from ..case import Case
    from ..measures import Constraint

HELP = "Measure a case's geometry before and after, against its bounds, or a geometry file."
EXAMPLE = """\
  moldline measure examples/transport_wing.toml --set 'droop[1]=0.2'
  moldline measure examples/transport_wing.toml --json --derivatives     (for an optimiser)
  moldline measure wing.stl volume area centroid                  (a geometry file, by name)"""

MOST = 8
"""Numbers of a measure that are told one by one; of more the range."""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    values.configure(command)
    command.add_argument(
        "names", nargs="*", metavar="MEASURE", help="of a case: these alone; of a file: which"
    )
    command.add_argument(
        "--derivatives", action="store_true", help="with --json: by every variable, exact"
    )
    command.add_argument("--json", action="store_true", help="report for a script")


def run(given: argparse.Namespace) -> int:
    """Do it; 0 only if all is within its bounds."""
    from ..case import load
    from ..errors import ParameterError

    if given.derivatives and not given.json:
        raise ParameterError("--derivatives are many numbers, for a script: add --json")
    if given.case.suffix.lower() != ".toml":
        return _of_file(given)
    case = load(given.case)
    known = case.measurements.constraints
    if not known:
        raise ParameterError(
            f"{given.case}: it has no measures; add a table such as [measure.volume] with "
            'measure = "volume"'
        )
    chosen = given.names or list(known)
    for name in chosen:
        if name not in known:
            raise ParameterError(f"no measure {name!r} in the case; it has: {', '.join(known)}")
    return _of_case(case, chosen, given)


def _of_case(case: "Case", chosen: list[str], given: argparse.Namespace) -> int:
    import numpy as np

    measurements, present = case.measurements, values.chosen(case, given)
    rest = np.asarray(case.pipeline.geometry.points)
    numbers = measurements(present)
    beyond = {n: miss for n, miss in measurements.beyond(numbers).items() if n in chosen}
    report: dict[str, Any] = {}
    lines = []
    slopes = measurements.jacobian(present) if given.derivatives else {}
    for name in chosen:
        constraint = measurements.constraints[name]
        before = np.asarray(constraint.measure(rest))
        low, high = constraint.bounds
        report[name] = {
            "before": before.tolist(),
            "after": numbers[name].tolist(),
            "lower": low.tolist(),
            "upper": high.tolist(),
            "is_within": name not in beyond,
        }
        if name in slopes:
            report[name]["derivatives"] = {v: s.tolist() for v, s in slopes[name].items()}
        lines.append(_line(name, before, numbers[name], constraint, beyond.get(name)))
    show(report, given.json, lines)
    return 1 if beyond else 0


def _line(
    name: str,
    before: "np.ndarray",
    after: "np.ndarray",
    constraint: "Constraint",
    miss: "np.ndarray | None",
) -> str:
    low, high = constraint.bounds
    told = f"{name:16}{_told(before)} -> {_told(after)}"
    if max(low.max(), -high.min()) > float("-inf"):
        told += f"  within [{_told(low)}, {_told(high)}]"
    return told + ("" if miss is None else f"  ! beyond by {miss.max():.6g}")


def _told(numbers: "np.ndarray") -> str:
    if len(numbers) > MOST:
        return f"{numbers.min():.6g} .. {numbers.max():.6g} ({len(numbers)})"
    same = len(set(numbers.tolist())) == 1
    return ", ".join(f"{x:.6g}" for x in (numbers[:1] if same else numbers))


def _of_file(given: argparse.Namespace) -> int:
    from .. import registry
    from ..errors import ParameterError
    from ..mesh.io import read

    if not given.names:
        raise ParameterError(
            f"name what to measure, such as: moldline measure {given.case} volume area; there is: "
            + ", ".join(registry.measures())
        )
    geometry, report, lines = read(given.case), {}, []
    for name in given.names:
        cls = registry.measure(name)
        needed = [key for key, option in cls.options().items() if option.default is option.empty]
        if needed:
            raise ParameterError(
                f"{name!r} needs {', '.join(needed)}; measure it in a case file, under "
                "[measure.NAME]"
            )
        numbers = cls.build(geometry)(geometry.points)
        report[name] = [float(x) for x in numbers]
        lines.append(f"{name:16}{', '.join(f'{x:.6g}' for x in report[name])}")
    show(report, given.json, lines)
    return 0
