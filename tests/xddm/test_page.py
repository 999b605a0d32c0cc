"""The page about XDDM says what happens."""

import re
from pathlib import Path

from moldline.xddm import document, operations, reading
from moldline.xddm.problems import findings

PAGE = (Path(__file__).parent.parent.parent / "docs/xddm.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.S)


def test_the_page_s_document_is_answered_as_it_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    request, answer, *_ = blocks("xml")
    Path("model.input.xml").write_text(request)
    for script in blocks("python"):
        exec(script, {})
    assert findings(document.read("model.input.xml")) == findings(document.read("model.output.xml"))
    assert findings(document.read("model.input.xml")).problems == []
    filled = Path("model.output.xml").read_text()
    assert answer in filled
    assert filled.startswith(request[: request.index("  <Analysis")])
    changed = Path("changed.xml").read_text()
    assert changed == re.sub(r"  <Function.*\n", "", request).replace(
        'Value="6.0"', 'Value="6.50000000000000000e+00"'
    ).replace("</Model>", '  <Analysis ID="Area" Sensitivity="None"/>\n</Model>')


def test_the_page_names_every_function_and_limit():
    functions = re.search(r"^function = (.*)$", PAGE, re.M)
    assert tuple(functions[1].split(" | ")) == tuple(operations.FUNCTIONS)
    limits = (reading.DEPTH, reading.MOST, reading.ATTRIBUTES, reading.LONGEST, reading.LARGEST)
    assert limits == (32, 2**20, 256, 65536, 64 * 2**20)
