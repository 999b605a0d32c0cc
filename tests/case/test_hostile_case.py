"""Case files that nobody should send: each is a case, or refused with its file and key."""

import os
import re
import shutil
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import moldline as ml
from moldline.case.case import Case
from moldline.cli import main
from moldline.errors import CaseError

EXAMPLE = Path(__file__).parent.parent.parent / "examples/transport_wing.toml"

VALUES = [
    *("0", "-1", "3", "0.5", "1e999", "-1e308", "nan", "inf", "true", '""', '"x"', '"y"', "[]"),
    *("[[]]", "{}", "[1, 2]", '["x"]', "[nan, nan]", "[inf, -inf]", "[[1, 2], [3]]", "{ a = 1 }"),
    *("9" * 30, "9" * 6000, "0x" + "f" * 300, "1979-05-27", "07:32:00", '"\\u202e\\u001b[2J"'),
    *("[" * 30 + "]" * 30, "[" * 3000 + "]" * 3000, "{ a = " * 999 + "1" + " }" * 999),
    *("[1000000, 1000000, 1000000]", "[2147483647, 2, 2]", "[2, 2, 99999999]", "1000000000000"),
    *('"case.toml"', '"."', '"/dev/zero"', '"none.tri"', '"\\u0000"', '"a\\nb"', '"' + "x" * 5000),
    *('"' + "x" * 5000 + '"', '"controls"', '"lattice"', '"nm"', '"x+"', '["x+", "x+", "q"]'),
]

LINES = [
    *("[geometry.wing]", "[variable]", "[[stage]]", "[stage]", "[[stage.link]]", "[rider.wing]"),
    *("[geometry.'']", '[variable."a.b"]', "moldline = 2", "x = 1", "= 1", "]", "\0", "# ü", "["),
    *(
        '[rider.r]\nfile = "wing.tri"',
        '[rider.r]\nfile = "wing.tri"\non = "none"',
        'freeze = ["z+"]',
    ),
    *("[a." + "a." * 3000 + "a]", "mirrored = 'x'", "scale = nan", "scale = 1e308", "margin = -1"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, ball) -> Path:
    """A folder with the example's geometry made small, and `case.toml` in it to be."""
    folder = tmp_path_factory.mktemp("hostile")
    surface = ml.Surface(np.asarray(ball.points) * [30, 30, 3] + [30, 30, 4], ball.faces)
    ml.write(folder / "wing.tri", surface)
    return folder


def example() -> str:
    text = EXAMPLE.read_text(encoding="utf-8").replace("data/transport_wing.tri", "wing.tri")
    return re.sub(r"[ \t]*#.*", "", text)


PILOTS = """
moldline = 1
[geometry.wing]
file = "wing.tri"
[variable.v]
size = 2
[[stage]]
deformer = "pilots"
margin = 0.2
weights = 1.0
step = 1.0
[stage.hidden]
deformer = "lattice"
shape = [3, 2, 2]
[stage.pilot.up]
measure = "position"
spot = { vertex = 3 }
along = "z"
[stage.pilot.aft]
measure = "position"
spot = { near = [30.0, 30.0, 7.0] }
along = "x"
[stage.constraint.thick]
measure = "separation"
start = { vertex = 5 }
end = { vertex = 2 }
bounds = [0.1, inf]
weight = 2.0
[stage.constraint.tail]
measure = "fixed"
region = { near = [60.0, 30.0, 4.0], radius = 3.0 }
[[stage.link]]
variable = "v"
link = "controls"
[measure.volume]
measure = "volume"
bounds = [1.0, 1e6]
[measure.clear]
measure = "clearance"
other = "wing.tri"
"""


@st.composite
def hostile(draw: st.DrawFn, text: str) -> str:
    """A case with one to three values or lines changed, or cut."""
    lines = text.strip().splitlines()
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(lines) - 1))
        kind = draw(st.sampled_from(["value", "value", "value", "line", "gone", "twice", "cut"]))
        if kind == "value":
            lines[at] = lines[at].partition("=")[0] + "= " + draw(st.sampled_from(VALUES))
        elif kind == "line":
            lines.insert(at, draw(st.sampled_from(LINES)))
        elif kind == "gone":
            lines[at] = ""
        elif kind == "twice":
            lines.insert(at, lines[at])
        else:
            lines[at] = lines[at][: draw(st.integers(0, max(len(lines[at]), 1)))]
    return "\n".join(lines)


quick = settings(
    max_examples=200,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)


def loaded_or_refused(path: Path) -> Case | None:
    """A case; None where it is refused as it must be, soon and without much memory."""
    tracemalloc.start()
    begin = time.process_time()
    try:
        case = ml.load(path)
    except CaseError as error:
        for line in str(error).splitlines():
            assert line.startswith(f"{path}: ")
            assert line.isprintable()
            assert len(line) < len(str(path)) + 6000  # a value in full at worst
        case = None
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert time.process_time() - begin < 10
    assert peak < 100 * 2**20, f"took {peak} bytes"
    return case


@quick
@given(text=hostile(example()))
def test_a_hostile_case_is_a_case_or_refused_with_its_place(folder, text):
    path = folder / "case.toml"
    path.write_bytes(text.encode())
    loaded_or_refused(path)


@settings(quick, max_examples=40)
@given(text=hostile(PILOTS))
def test_a_hostile_case_of_pilots_is_a_case_or_refused_with_its_place(folder, text):
    path = folder / "case.toml"
    path.write_bytes(text.encode())
    loaded_or_refused(path)


@pytest.mark.slow
@settings(quick, max_examples=10_000, derandomize=False)
@given(text=hostile(example()))
def test_ten_thousand_hostile_cases_are_cases_or_refused(folder, text):
    path = folder / "case.toml"
    path.write_bytes(text.encode())
    loaded_or_refused(path)


@quick
@given(content=st.binary(max_size=200))
def test_rubbish_is_refused(folder, content):
    path = folder / "case.toml"
    path.write_bytes(content)
    assert loaded_or_refused(path) is None


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "cannot be read: the file is empty"),
        (b"\n", "moldline: it must be there"),
        (b"moldline = 1\n", "a pipeline needs a geometry, or a stage that makes one"),
        (b"\xff\xfe", "not a text file: byte 0 is not UTF-8"),
        (b"\x1f\x8b\x08", "cannot be read: damaged gzip data"),
        (b"a = " + b"[" * 100_000, "not TOML: nested too deep"),
        (b"a = " + b"9" * 6000, "not TOML: .*digits"),
    ],
)
def test_what_is_no_case_at_all_is_told(folder, content, message):
    path = folder / "case.toml"
    path.write_bytes(content)
    with pytest.raises(CaseError, match=rf"case\.toml: {message}"):
        ml.load(path)


def test_a_folder_or_a_device_is_no_case(folder):
    with pytest.raises(CaseError, match="cannot be read: is a folder"):
        ml.load(folder)
    with pytest.raises(CaseError, match="no file can have a name with a NUL"):
        ml.load("a\0b")
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "pipe")
        with pytest.raises(CaseError, match="pipe: cannot be read: is no ordinary file"):
            ml.load(folder / "pipe")


@pytest.mark.parametrize("name", ["none.toml", "binary.toml", "deep.toml", "folder.toml"])
@pytest.mark.parametrize("command", ["deform", "sensitivity", "check", "plot", "info"])
def test_commands_print_one_message_and_no_traceback(folder, tmp_path, capsys, command, name):
    shutil.copy(folder / "wing.tri", tmp_path)
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)))
    (tmp_path / "deep.toml").write_text("a = " + "[" * 5000)
    (tmp_path / "folder.toml").mkdir()
    output = [] if command in ("info", "check") else ["-o", str(tmp_path / "out.vtp")]
    assert main([command, str(tmp_path / name), *output]) == 1
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith(f"moldline {command}: {tmp_path / name}: ")
    assert told.err.count("\n") == 1
    assert not (tmp_path / "out.vtp").exists()
