"""`moldline sensitivity` into every kind of file."""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.cli import main
from moldline.mesh.io.sensitivities import read_sensitivities

CASE = str(Path(__file__).parent.parent.parent / "examples/transport_wing.toml")
DROOP = ["sensitivity", CASE, "--variable", "droop", "--set", "droop[1]=0.2"]
needs_hdf5 = pytest.mark.skipif(
    importlib.util.find_spec("h5py") is None, reason="h5py, an optional extra, is not installed"
)


@pytest.fixture(scope="module")
def exact():
    """The moved wing, and the derivatives that must be in the files."""
    case = ml.load(CASE)
    values = case.values({"droop": [*case.pipeline.variables["droop"].value]})
    values["droop"] = np.asarray(values["droop"]).copy()
    values["droop"][1] = 0.2
    return case.pipeline(values), case.pipeline.labelled_sensitivity(values, "droop")


@pytest.mark.parametrize(
    "arguments",
    [
        ["wing.trix"],
        ["wing.vtp"],
        ["wing.npz"],
        pytest.param(["wing.h5"], marks=needs_hdf5),
        ["geometry", "--per-variable"],
    ],
    ids=" ".join,
)
def test_every_file_holds_the_moved_wing_and_its_exact_derivatives(
    tmp_path, capsys, exact, arguments
):
    target = tmp_path / arguments[0]
    assert main([*DROOP, "-o", str(target), *arguments[1:], "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["file"] == str(target)
    surface, columns = read_sensitivities(target)
    np.testing.assert_array_equal(surface.points, exact[0].points)
    np.testing.assert_array_equal(surface.faces, exact[0].faces)
    assert columns.keys() == exact[1].keys() == report["largest"].keys()
    for label, column in exact[1].items():
        np.testing.assert_array_equal(columns[label], column)


def test_one_file_per_variable_is_where_cart3d_looks_for_it(tmp_path):
    assert main([*DROOP, "-o", str(tmp_path), "--per-variable"]) == 0
    files = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.tri"))
    assert files == [str(Path(f"droop_{k}_") / "Components.i.tri") for k in range(4)]
    assert isinstance(ml.read(tmp_path / files[0]), ml.Surface)


def test_a_suffix_that_holds_no_derivatives_is_told(tmp_path, capsys):
    assert main([*DROOP, "-o", str(tmp_path / "wing.stl")]) == 1
    assert "go to .npz, .h5, .vtp or .trix" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_missing_library_is_told(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    assert main([*DROOP, "-o", str(tmp_path / "wing.h5")]) == 1
    assert "pip install 'moldline[hdf5]'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
