"""`moldline blender`."""

import argparse
from pathlib import Path

from . import show

HELP = "Make an environment with Blender, and tell what can be turned in a Blender file."
EXAMPLE = """\
  moldline blender make
  moldline blender list scene.blend --object wing
  $(moldline blender where) script.py                     (runs a script that imports bpy)"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    actions = command.add_subparsers(dest="action", metavar="ACTION", required=True)
    make = actions.add_parser(
        "make", help="make an environment of its own with Blender as a Python module (800 MB)"
    )
    make.add_argument("--release", default="4.5", help="of Blender: 4.5 or 5.2 (4.5)")
    make.add_argument(
        "--folder", type=Path, help="where; else in this user's cache, where it is found again"
    )
    actions.add_parser("where", help="tell which Blender is run, or which Python that has bpy")
    found = actions.add_parser("list", help="tell what can be turned in a .blend file")
    found.add_argument("file", type=Path, help=".blend file")
    found.add_argument("--object", help="of this object only")
    found.add_argument(
        "--python", type=Path, help="a Blender, or a Python that has bpy; else it is looked for"
    )
    found.add_argument("--json", action="store_true", help="report for a script")


def run(given: argparse.Namespace) -> int:
    """Do it."""
    return {"make": _make, "where": _where, "list": _list}[given.action](given)


def _make(given: argparse.Namespace) -> int:
    from ..modelers.blender_found import VARIABLE
    from ..modelers.blender_making import make

    python = make(given.release, given.folder)
    print(f"Blender {given.release} is in {python.parent.parent}")
    if given.folder is not None:
        print(f"it is found with {VARIABLE}={python}, or with python = {str(python)!r} in a stage")
    return 0


def _where(given: argparse.Namespace) -> int:
    from ..modelers.blender_found import found_interpreter

    print(found_interpreter())
    return 0


def _list(given: argparse.Namespace) -> int:
    from ..modelers import blender_listing

    listed = blender_listing.turnable(given.file, given.python)
    if given.object is not None:
        listed = blender_listing.of_object(listed, given.object)
    show({"objects": listed}, given.json, blender_listing.sentences(listed))
    return 0
