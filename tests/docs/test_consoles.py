"""What the pages show of the command line is what it prints."""

import re
import shlex
from pathlib import Path

import pytest

from moldline.cli import main

ROOT = Path(__file__).parent.parent.parent
NOISE = re.compile(r"[\d.]+ m?s\b|[\d.]+e-1[3-7]\b")
"""Times, and what is left of rounding."""


def shown():
    """Commands on files of the repository, each with the lines that a page shows below it."""
    for page in sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]):
        for block in re.findall(r"```console\n(.*?)```", page.read_text(), re.S):
            for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
                command, *lines = part.rstrip("\n").replace("\\\n", " ").split("\n")
                words = shlex.split(command, comments=True)
                if words[0] == "moldline" and any(w.startswith("examples/") for w in words):
                    yield pytest.param(words[1:], lines, id=f"{page.stem}-{' '.join(words[1:3])}")


@pytest.mark.parametrize(("command", "lines"), list(shown()))
def test_a_command_prints_what_the_page_shows(command, lines, tmp_path, monkeypatch, capsys):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    assert main(command) == 0
    printed = [NOISE.sub("~", line.rstrip()) for line in capsys.readouterr().out.split("\n")]
    for line in lines:
        if line.strip() != "...":
            assert NOISE.sub("~", line.rstrip()) in printed
