"""The docs tell of what there is."""

import re
import tomllib
from pathlib import Path

from moldline.case import schema
from moldline.cli import COMMANDS
from moldline.mesh.io import FORMATS

DOCS = Path(__file__).parent.parent.parent / "docs"


def test_every_command_has_its_section():
    sections = re.findall(r"^## `moldline (\w+)`", (DOCS / "cli.md").read_text(), re.M)
    assert tuple(sections) == COMMANDS


def test_every_format_has_its_row():
    text = (DOCS / "formats.md").read_text()
    for module in FORMATS:
        assert f"| {module.NAME} |" in text, module.NAME


def test_every_case_file_in_the_docs_is_valid():
    found = 0
    for page in DOCS.rglob("*.md"):
        for block in re.findall(r"```toml\n(moldline = 1\n.*?)```", page.read_text(), re.S):
            schema.parse(block, page.name)
            tomllib.loads(block)
            found += 1
    assert found >= 1


def test_every_file_that_a_page_includes_is_there():
    included = []
    for page in DOCS.rglob("*.md"):
        text = page.read_text()
        assert "8 <" not in text, f"{page.name}: an include that was taken for Python"
        included += re.findall(r'^--8<-- "(.*)"$', text, re.M)
    assert included
    assert all((DOCS.parent / name).is_file() for name in included)
