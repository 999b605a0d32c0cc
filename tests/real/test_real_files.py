"""Everything in the folder of real geometry is read, checked, converted and deformed."""

import json

import numpy as np
import pytest

import moldline as ml
from moldline.cli import main
from moldline.pipeline import examine

SURFACES = ["pygeo/bwb.stl", "pygeo/c172.stl", "su2/onera_m6_surface.stl"]
GRIDS = ["crm_wing_body_patches.xyz.gz", "pygeo/bwb.xyz", "pygeo/c172.xyz", "pygeo/bodyFFD.xyz"]
MESHES = [
    *("su2/naca0012_inviscid.su2", "su2/rae2822_turbulent_ffd.su2"),
    *("su2/brick_tets_ffd.su2", "su2/brick_prism_ffd.su2"),
]
FILES = {
    **dict.fromkeys(SURFACES, "vtp"),
    **dict.fromkeys(GRIDS, "xyz"),
    **dict.fromkeys(MESHES, "su2"),
    "naca0012.dat": "dat",
}
"""Each file, and a format to convert it to that loses nothing but what the docs say."""


def report(command, capsys):
    """What a command prints as JSON, and its status."""
    status = main([*command, "--json"])
    return status, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_read_and_told_of(data, capsys, name):
    status, told = report(["info", str(data(name))], capsys)
    assert status == 0
    geometry = ml.read(data(name))
    assert told["points"] == len(geometry.points) > 7
    assert np.isfinite(geometry.points).all()
    np.testing.assert_array_equal(told["low"], geometry.points.min(axis=0))


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_checked(data, capsys, name):
    status, told = report(["check", str(data(name))], capsys)
    assert status in (0, 1)
    assert told["is_sound"] == (status == 0)


@pytest.mark.parametrize(("name", "suffix"), FILES.items())
def test_a_file_is_converted_and_back(data, capsys, tmp_path, name, suffix):
    target = tmp_path / f"new.{suffix}"
    assert main(["convert", str(data(name)), str(target)]) == 0
    capsys.readouterr()
    before, after = ml.read(data(name)), ml.read(target)
    assert type(after) is type(before)
    np.testing.assert_array_equal(after.points, before.points)


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_deformed_and_rides(data, capsys, tmp_path, name):
    suffix = FILES[name]
    flat = name in ("naca0012.dat", "su2/naca0012_inviscid.su2", "su2/rae2822_turbulent_ffd.su2")
    shape = [4, 3, 1] if flat else [4, 3, 3]
    (tmp_path / "case.toml").write_text(
        f"""
moldline = 1
[geometry.real]
file = {json.dumps(str(data(name).resolve()))}
[variable.lift]
value = [0.1, 0.2, -0.1, 0.05]
[[stage]]
deformer = "lattice"
shape = {shape}
[[stage.link]]
variable = "lift"
link = "camber"
along = "x"
axis = "y"
"""
    )
    target = tmp_path / f"new.{suffix}"
    assert main(["deform", str(tmp_path / "case.toml"), "-o", str(target)]) == 0
    capsys.readouterr()
    rest = ml.read(data(name)).points
    moved = ml.read(target).points
    assert np.abs(moved - rest).max() > 0.01
    pipeline = ml.load(tmp_path / "case.toml").pipeline
    np.testing.assert_array_equal(pipeline({"lift": np.zeros(4)}).points, rest)
    assert examine.proof(pipeline).is_right


def test_the_real_files_are_all_here(data):
    """A new one is to be tried too."""
    folder = data("README.md").parent
    found = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
    own = {name for name in found if not name.startswith("blender/")} - {"README.md"}
    assert own == set(FILES)
