"""ESP through a stand-in for serveCSM, which behaves as its help page says."""

import sys
from pathlib import Path

import numpy as np
import pytest

from moldline.case.options import model_of
from moldline.errors import FileError, GeometryError, ParameterError
from moldline.modelers.esp import Esp

FAKE = """#!{python}
import sys, time
words = sys.argv[1:]
assert words[0] == "-batch" and words[1] == "-despmtrs" and words[3] == "-outLevel"
given = dict(line.split() for line in open(words[2]))
script = open(words[5]).read()
if "SLEEP" in script:
    time.sleep(60)
if "FAIL" in script:
    print("ERROR:: (illegal_value)")
    sys.exit(1)
import OCP.OCP as occ
shape = occ.BRepPrimAPI.BRepPrimAPI_MakeBox(
    1e3 * float(given.get("length", 1)), 1e3 * float(given.get("width", 1)), 1e3
).Shape()
writer = occ.STEPControl.STEPControl_Writer()
writer.Transfer(shape, occ.STEPControl.STEPControl_StepModelType.STEPControl_AsIs)
if "DUMP" in script:
    writer.Write("box.step")
"""


@pytest.fixture
def serve_csm(tmp_path):
    path = tmp_path / "serveCSM"
    path.write_text(FAKE.format(python=sys.executable))
    path.chmod(0o755)
    return str(path)


def csm(folder, text="BOX 0 0 0 length width 1\nDUMP box.step\nEND\n"):
    path = folder / "box.csm"
    path.write_text(f"DESPMTR length 1\nDESPMTR width 1\n{text}")
    return path


def test_design_parameters_are_set_and_derivatives_taken(serve_csm, tmp_path):
    pytest.importorskip("OCP", reason="OpenCascade is optional: pip install 'moldline[step]'")
    shape = Esp.build(
        csm(tmp_path).parent,
        script=Path("box.csm"),
        parameters={"length": 2.0},
        result="box.step",
        command=serve_csm,
        max_edge=1.0,
    )
    points = np.asarray(shape.geometry.points)
    np.testing.assert_allclose(points.max(axis=0), [2, 1, 1], rtol=1e-12)
    np.testing.assert_allclose(shape(np.array([3.0])), points * [1.5, 1, 1], atol=1e-12)
    expected = points * [0.5, 0, 0]
    np.testing.assert_allclose(shape.differences().jacobian[..., 0], expected, atol=1e-9)
    assert {"box.csm", "serveCSM"} == {path.name for path in tmp_path.iterdir()}


def test_a_case_file_can_say_it():
    model_of("esp", Esp.options()).model_validate(
        {"script": "box.csm", "parameters": {"length": 2.0, "x[1,2]": 1.0}, "components": "one"}
    )


@pytest.mark.parametrize(
    ("text", "options", "error", "message"),
    [
        ("FAIL", {}, GeometryError, r"ended with 1 at length 2\.0, .*illegal_value"),
        ("SLEEP", {"time_limit": 0.5}, GeometryError, r"took more than 0\.5 s"),
        ("", {"command": "no_such_program"}, ParameterError, "'no_such_program' .* not found"),
        ("", {"result": "box.stl"}, ParameterError, "result is the STEP file that box.csm dumps"),
    ],
)
def test_a_run_that_goes_wrong_is_told(serve_csm, tmp_path, text, options, error, message):
    options = {"command": serve_csm, "result": "box.step", **options}
    with pytest.raises(error, match=message):
        Esp(csm(tmp_path, text), {"length": 2.0}, **options)


def test_a_script_that_dumps_nothing_or_is_missing_is_told(serve_csm, tmp_path):
    with pytest.raises(FileError, match="there is no such file"):
        Esp(tmp_path / "other.csm", command=serve_csm)
    pytest.importorskip("OCP", reason="the stand-in makes its shape by OpenCascade")
    with pytest.raises(GeometryError, match="dumped no such file"):
        Esp(csm(tmp_path, "END\n"), {"length": 2.0}, result="box.step", command=serve_csm)
