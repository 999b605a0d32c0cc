"""The command line: parse, call one public function, print."""

import argparse
import importlib
import io
import json
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any

COMMANDS = (
    "parameterise", "build", "deform", "sensitivity", "measure", "check", "info", "convert",
    "plot", "sweep", "serve", "blender", "schema",
)  # fmt: skip

DESCRIPTION = """\
Deform discrete geometry for aerodynamic shape design, with exact sensitivities.

A case file (TOML) names a geometry, the lattices around it and the design variables;
`moldline schema` writes its JSON Schema for editors.
"""


def parser() -> argparse.ArgumentParser:
    """Parser with one sub-command per module of this package."""
    top = argparse.ArgumentParser(
        prog="moldline",
        description=DESCRIPTION,
        epilog="example:\n  moldline deform examples/transport_wing.toml -o wing_new.tri",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action="store_true", help="print the version and stop")
    commands = top.add_subparsers(dest="command", metavar="COMMAND")
    for name in COMMANDS:
        module = importlib.import_module(f"moldline.cli.{name}")
        command = commands.add_parser(
            name,
            help=module.HELP,
            description=module.HELP,
            epilog=f"example:\n{module.EXAMPLE}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.configure(command)
        command.set_defaults(run=module.run)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; 0 only on success, 1 with a message on failure, 2 on wrong arguments."""
    top = parser()
    given = top.parse_args(arguments)
    if given.version:
        from importlib.metadata import version

        print(version("moldline"))
        return 0
    if given.command is None:
        top.print_help()
        return 2
    from ..errors import MoldlineError

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # some systems' output takes few letters
            stream.reconfigure(errors="backslashreplace")
    if getattr(given, "jobs", None):
        os.environ["MOLDLINE_THREADS"] = str(given.jobs)
    try:
        return int(given.run(given) or 0)
    except MoldlineError as error:
        print(f"moldline {given.command}: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return 1
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


def in_steps(**steps: Callable[[], Any]) -> list[Any]:
    """What each step returns; after two seconds a bar on the error stream tells how far it is."""
    from tqdm import tqdm

    results = []
    with tqdm(total=len(steps), delay=2, leave=False) as bar:
        for name, step in steps.items():
            bar.set_description(name.replace("_", " "), refresh=False)
            results.append(step())
            bar.update()
    return results


def show(report: dict, as_json: bool, lines: Sequence[str]) -> None:
    """Print a report, for a script or for a person."""
    print(json.dumps(report, indent=2, default=float) if as_json else "\n".join(lines))
