"""Blender as a process, through a stand-in for it: pipes, limits, deaths, derivatives, cases."""

import gc
import io
import sys
import textwrap
import time
from pathlib import Path

import jax
import numpy as np
import pytest

import moldline as ml
from moldline.case import load
from moldline.cli import main
from moldline.errors import CaseError, GeometryError, ParameterError, TaskError
from moldline.modelers.blender import Blender
from moldline.modelers.blender_found import VARIABLE, found_interpreter
from moldline.modelers.blender_making import make, missing_libraries
from moldline.modelers.in_blender import frames

STAND_IN = Path(__file__).parent / "blender_stand_in.py"
X = np.linspace(0, 1, 12)


@pytest.fixture
def interpreter(tmp_path):
    """An executable that stands in for a Python with bpy."""
    return executable(tmp_path / "python", f'exec "{sys.executable}" "{STAND_IN}" "$@"')


def executable(path, line):
    path.write_text(f"#!/bin/sh\n{line}\n")
    path.chmod(0o755)
    return path


@pytest.fixture
def strip(tmp_path, interpreter):
    """Makes modelers of the stand-in's strip, and ends their processes."""
    made = []

    def make_one(object="wing", **options):
        given = {
            "parameters": {"length": "length", "rise": "rise"},
            "controls": {"tip": {"object": "tip", "axes": "yz"}},
            "python": interpreter,
            "workers": 2,
        }
        one = Blender(tmp_path / "scene.blend", object, **given | options)
        made.append(one)
        return one

    yield make_one
    for one in made:
        one.close()


def points(length, rise, y=0.0, z=0.0):
    return np.stack([length * X, rise * np.sin(X) + y, 0 * X + z], axis=1)


def test_messages_are_read_as_they_were_written():
    stream = io.BytesIO()
    arrays = {"a": np.arange(6.0).reshape(2, 3), "none": np.zeros((0, 3), np.float32)}
    stream.write(b"Blender 4.5\n" + frames.HELLO)
    frames.write(stream, {"do": "it", "limits": [float("inf")]}, arrays)
    stream.seek(0)
    assert frames.skip_to_hello(stream)
    told, found = frames.read(stream)
    assert told == {"do": "it", "limits": [float("inf")]}
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)
    assert frames.read(stream) is None
    with pytest.raises(ValueError, match="begins with b'Read'"):
        frames.read(io.BytesIO(b"Read blend: x"))


def test_parameters_are_those_of_the_file_and_derivatives_no_worse_than_told(strip):
    blend = strip()
    assert {k: v.tolist() for k, v in blend.parameters.items()} == {
        "length": [0], "rise": [1], "tip": [2, 3],
    }  # fmt: skip
    assert blend.scene.labels == ("length", "rise", "tip[y]", "tip[z]")
    np.testing.assert_array_equal(blend.values, [2.0, 0.5, 0.0, 0.0])
    making = blend.bind()
    at = np.array([2.2, 0.7, 0.1, -0.1])
    np.testing.assert_allclose(making(at), points(*at), rtol=0, atol=2e-7)
    exact = [points(1, 0), points(0, 1), points(0, 0, 1), points(0, 0, 0, 1)]
    found = making.along(at, [], [(row, []) for row in np.eye(4)])
    for name, column, right in zip(blend.scene.labels, found, exact, strict=True):
        assert np.abs(column - right).max() < 2 * making.accuracy[name].error < 1e-5
        assert making.accuracy[name].step >= 0.05  # large: it is linear, and coarsely rounded
    assert len(blend.scene.pool.idle) == 2
    weights = np.random.default_rng(0).normal(size=(12, 3))
    pulled = jax.vjp(making, at)[1](weights)[0]
    np.testing.assert_allclose(pulled, [np.vdot(c, weights) for c in found], rtol=1e-12)


def test_a_given_geometry_keeps_its_double_precision_and_its_names(strip):
    start = 100 + np.random.default_rng(1).normal(size=(12, 3))
    given = ml.Surface(start, np.arange(12).reshape(4, 3), components=("skin",))
    blend = strip(values={"rise": 0.0})
    making = blend.bind(given)
    np.testing.assert_array_equal(making.geometry.points, start)
    assert making.geometry.components == ("skin",)
    motion = jax.jvp(making, (blend.values, start), (np.zeros(4), np.ones((12, 3))))[1]
    np.testing.assert_allclose(motion, np.ones((12, 3)), atol=1e-5)
    assert blend.takes == (0, 1)
    with pytest.raises(GeometryError, match="takes one geometry, got 2"):
        blend.bind(given, given)


def test_a_death_is_survived_and_two_are_told_with_the_last_words(strip):
    making = strip("dies once").bind()
    np.testing.assert_allclose(making.geometry.points, points(2, 0.5), atol=2e-7)
    with pytest.raises(
        TaskError, match=r"(?s)ended with status 3; it said last:.*out of memory.*so did the proc"
    ):
        strip("dies").bind()


def test_an_answer_that_takes_too_long_is_told_and_its_process_ended(strip):
    blend = strip("slow", limit=0.5)
    start = time.monotonic()
    with pytest.raises(TaskError, match=r"took longer than its limit of 0\.5 s; give it more"):
        blend.bind()
    assert time.monotonic() - start < 20 and blend.scene.pool.idle == ()


def test_what_fails_inside_is_told_with_what_blender_said(strip):
    with pytest.raises(TaskError, match=r"(?s)ZeroDivisionError: inside Blender.*Traceback"):
        strip("fails").bind()
    with pytest.raises(ParameterError, match="nothing named 'wrong'; there are 'length'"):
        strip(parameters={"wrong": "wrong"})


def test_a_changed_topology_is_told_with_the_step_that_changed_it(strip):
    making = strip("grows").bind()
    with pytest.raises(
        GeometryError, match=r"makes 13 points and 4 faces for these values, and 12"
    ):
        making(np.array([3.0, 0.5, 0, 0]))
    at = np.array([2.45, 0.5, 0, 0])
    with pytest.raises(GeometryError, match=r"13 points and 4 faces for length \+ 0\.2"):
        jax.jvp(making, (at,), (np.eye(4)[0],))


def test_processes_end_with_their_modeler(strip, interpreter, tmp_path):
    blend = Blender(tmp_path / "a.blend", "wing", python=interpreter)
    (process,) = blend.scene.pool.idle
    assert process.is_alive and process.version == "9.9 stand-in"
    del blend
    gc.collect()
    assert not process.is_alive


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"values": {"lenght": 1.0}}, "values name 'lenght', which is neither.*length, rise, tip"),
        ({"values": {"tip": [1.0, 2.0, 3.0]}}, "values of 'tip' are 3 numbers; it has 2"),
        ({"steps": {"rise": 0.0}}, "'rise' needs a step above 0.*got 0"),
        ({"bounds": {"rise": (1.0, 1.0)}}, "a lower bound below the upper one"),
        ({"values": {"rise": 5.0}}, "rise is 5; Blender keeps it from 0 to 4"),
        ({"limit": 0.0}, "a limit is a time above 0"),
        ({"controls": {"rise": {"object": "a"}}}, "both a parameter and controls are named 'rise'"),
        ({"controls": {"a": {"object": "a", "axes": "xx"}}}, "axes are some of xyz, got 'xx'"),
        ({"controls": {"a": {"object": "a", "motion": "up"}}}, "a motion is location, rotation"),
        ({"controls": {"a": {"object": "a", "bone": "up"}}}, "say 'bone'; they may say object"),
    ],
)
def test_wrong_options_are_told(strip, options, match):
    with pytest.raises(ParameterError, match=match):
        strip(**options)


def test_a_step_below_single_precision_is_told(strip):
    making = strip(steps={"length": 1e-9}, step_control=False).bind()
    with pytest.raises(ParameterError, match="1e-09 in length is lost in Blender's single"):
        jax.jvp(
            making, (making.kernel.slopes.runs and np.array([2.0, 0.5, 0, 0]),), (np.eye(4)[0],)
        )


def test_a_python_without_bpy_is_told_with_the_way_out(tmp_path):
    with pytest.raises(
        TaskError, match=r"(?s)No module named 'bpy'.*could not begin; `moldline blender make`"
    ):
        Blender(tmp_path / "scene.blend", "wing", python=Path(sys.executable))


def test_blender_is_looked_for_in_order(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.delenv(VARIABLE, raising=False)
    with pytest.raises(ParameterError, match="there is no Blender: `moldline blender make` makes"):
        found_interpreter()
    places = [
        "bin/blender", "case/.venv-blender/bin/python", ".venv-blender/bin/python",
        "cache/moldline/blender-4.5/bin/python", "own/bin/python", "given",
    ]  # fmt: skip
    for place in places:
        path = tmp_path / place
        path.parent.mkdir(parents=True, exist_ok=True)
        executable(path, "exit 0")
        if place.startswith("own"):
            monkeypatch.setenv(VARIABLE, str(tmp_path / "own"))  # an environment's folder serves
        given = path if place == "given" else None
        assert found_interpreter(given, tmp_path / "case") == path
    monkeypatch.setenv(VARIABLE, "blender")
    assert found_interpreter() == tmp_path / "bin/blender"
    monkeypatch.setenv(VARIABLE, "blonder")
    with pytest.raises(ParameterError, match=f"{VARIABLE} says that Blender is 'blonder'"):
        found_interpreter()


def test_an_environment_that_is_made_is_found_made(tmp_path, monkeypatch):
    python = tmp_path / "place/bin/python"
    python.parent.mkdir(parents=True)
    executable(python, "exit 0")
    said = []
    assert make("4.5", tmp_path / "place", said.append) == python and not said
    with pytest.raises(ParameterError, match=r"4\.4 is not one that is made; it is one of 4\.5, "):
        make("4.4")
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with pytest.raises(ParameterError, match=r"needs Python 3\.13 exactly.*pip install uv"):
        make("5.2", tmp_path / "other", said.append)


def test_system_libraries_that_lack_are_named(tmp_path, monkeypatch):
    lines = "libX11.so.6 => not found\\nlibc.so.6 => /lib/libc.so.6 (0x0)\\nlibGL.so.1 => not found"
    executable(tmp_path / "ldd", f"printf '\\t{lines}\\n'")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    assert missing_libraries(tmp_path / "bpy.so") == ["libGL.so.1", "libX11.so.6"]
    library = tmp_path / "place/lib/python3.11/site-packages/bpy/__init__.so"
    library.parent.mkdir(parents=True)
    library.touch()
    executable(tmp_path / "uv", f'mkdir -p "{tmp_path}/place/bin"; '
               f'printf "#!/bin/sh\\necho ImportError: libGL >&2; exit 1" > "{tmp_path}/place/bin/'
               f'python"; chmod +x "{tmp_path}/place/bin/python"')  # fmt: skip
    with pytest.raises(
        TaskError, match=r"does not import: ImportError: libGL.*apt-get install libgl1 libx11-6"
    ):
        make("4.5", tmp_path / "place", lambda line: None)


CASE = """\
moldline = 1

[variable.rise]
value = 0.5
bounds = [0.0, 1.0]

[variable.tip]
size = 2

[[stage]]
modeler = "blender"
to = "strip"
file = "scene.blend"
object = "wing"
workers = 1

[stage.parameters]
rise = 'objects["wing"].rise'

[stage.controls.tip]
object = "wing"
points = [3]
axes = "yz"

[[stage.link]]
variable = "rise"
link = "named"
parameter = "rise"
absolute = true

[[stage.link]]
variable = "tip"
link = "named"
parameter = "tip"
"""


def test_a_case_file_runs_with_the_command_line(tmp_path, interpreter, monkeypatch, capsys):
    monkeypatch.setenv(VARIABLE, str(interpreter))
    case = tmp_path / "case.toml"
    case.write_text(CASE)
    target = tmp_path / "new.tri"
    assert main(["deform", str(case), "--set", "tip=0.1,0.2", "-o", str(target)]) == 0
    assert main(["sensitivity", str(case), "-o", str(tmp_path / "new.npz")]) == 0
    assert "derivatives of 12 points by 3 numbers" in capsys.readouterr().out
    assert main(["blender", "list", str(tmp_path / "scene.blend"), "--object", "wing"]) == 0
    assert capsys.readouterr().out == textwrap.dedent("""\
        wing  mesh; 12 vertices; groups tip; modifiers Bend (BEND)
            objects["wing"].rise  0.5  (0 to 4)
        """)
    assert main(["blender", "list", str(tmp_path / "scene.blend"), "--object", "x"]) == 1
    assert "no object 'x'; there are wing" in capsys.readouterr().err
    assert main(["blender", "where"]) == 0
    assert capsys.readouterr().out == f"{interpreter}\n"
    assert main(["blender", "make", "--release", "4.4"]) == 1
    assert "it is one of 4.5, 5.2" in capsys.readouterr().err
    case.write_text(CASE.replace("axes = ", "axis = "))
    with pytest.raises(CaseError, match=r"stage\.0\.controls\.tip\.axis: there is no such key"):
        load(case)
