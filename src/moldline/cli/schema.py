"""`moldline schema`."""

import argparse
import json
from pathlib import Path

HELP = "Write the JSON Schema of the case file, with the options of all installed deformers."
EXAMPLE = """\
  moldline schema -o case.schema.json
  (then "#:schema case.schema.json" as a case file's first line serves editors with TOML support)"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    command.add_argument("-o", "--output", type=Path, help="file to write; else it is printed")


def run(given: argparse.Namespace) -> int:
    """Do it."""
    from ..case import json_schema
    from ..mesh.io.files import replacing

    text = json.dumps(json_schema(), indent=2) + "\n"
    if given.output is None:
        print(text, end="")
        return 0
    with replacing(given.output) as stream:
        stream.write(text.encode())
    print(given.output)
    return 0
