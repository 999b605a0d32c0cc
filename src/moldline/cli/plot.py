"""`moldline plot`."""

import argparse
from pathlib import Path

HELP = "Draw a geometry, or a case before and after, or its sensitivity to one number."
EXAMPLE = """\
  moldline plot examples/data/transport_wing.tri -o wing.png
  moldline plot examples/transport_wing.toml --set thickness[3]=0.3 -o moved.png
  moldline plot examples/transport_wing.toml --sensitivity droop -o sensitivity.png"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""


def run(given: argparse.Namespace) -> int:
    """Do it."""
    raise NotImplementedError(Path)
