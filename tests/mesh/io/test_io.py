"""Telling formats apart, units, and files that stay whole."""

import errno
from pathlib import Path

import numpy as np
import pytest
from conftest import same_bits

from moldline.errors import FileError, GeometryError, ParameterError
from moldline.mesh import io
from moldline.mesh.cloud import Cloud
from moldline.mesh.grid import Grid
from moldline.mesh.io import files, text
from moldline.mesh.section import Section
from moldline.mesh.surface import Surface
from moldline.mesh.volume import Cells, VolumeMesh

TRIANGLE = Surface(np.eye(3), np.array([[0, 1, 2]]))
PATCH = Grid(np.random.default_rng(5).random((6, 3)), ((3, 2, 1),))
AIRFOIL = Section(np.array([[1, 0, 0], [0.5, 0.1, 0], [0, 0, 0], [1, 0, 0]]))
MESH = VolumeMesh(
    np.eye(3) * [1, 1, 0],
    Cells(np.array([5], np.int32), np.array([0, 3]), np.array([0, 1, 2], np.int32)),
    dimension=2,
)
EXAMPLES = {
    "a.tri": (TRIANGLE, {}),
    "a.i.tri": (TRIANGLE, {"binary": "big"}),
    "a.stl": (TRIANGLE, {}),
    "b.stl": (TRIANGLE, {"binary": True}),
    "a.obj": (TRIANGLE, {}),
    "a.vtp": (TRIANGLE, {}),
    "a.xyz": (PATCH, {}),
    "b.xyz": (PATCH, {"binary": "little", "records": True}),
    "a.xyz.gz": (PATCH, {}),
    "a.su2": (MESH, {}),
    "a.dat": (AIRFOIL, {}),
}


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("other", [None, "nameless", "wrong.su2", "wrong.tri"])
def test_content_tells_the_format_whatever_the_name(tmp_path, name, other):
    geometry, options = EXAMPLES[name]
    io.write(tmp_path / name, geometry, **options)
    path = (tmp_path / name).rename(tmp_path / (other or name))
    read = io.read(path)
    assert type(read) is type(geometry)
    np.testing.assert_array_equal(read.points, geometry.points)


@pytest.mark.parametrize("module", io.FORMATS, ids=lambda module: module.NAME)
def test_every_format_says_what_it_holds_and_loses(module):
    assert "Lost on writing" in module.__doc__
    assert module.HOLDS.__name__
    assert all(suffix.startswith(".") for suffix in module.SUFFIXES)


def test_the_name_decides_where_content_leaves_a_choice(tmp_path):
    content = "2 2\n0 0\n1 1\n0 1\n0 0\n1 1 1 1\n"  # a PLOT3D patch without nk
    (tmp_path / "a.xyz").write_text(content)
    assert io.found(tmp_path / "a.xyz").NAME == "PLOT3D"
    both = "2 2\n0 0\n1 1\n0 1\n0 1\n"  # as well points on a curve
    (tmp_path / "both").write_text(both)
    with pytest.raises(FileError, match=r"could be PLOT3D or airfoil .*by its suffix or by format"):
        io.read(tmp_path / "both")
    assert isinstance(io.read(tmp_path / "both", format="plot3d"), Grid)


def test_an_unknown_file_lists_what_is_known(tmp_path):
    (tmp_path / "a.doc").write_text("Dear reader")
    with pytest.raises(FileError, match=r"of no known format; known are: Cart3D tri \(\.tri"):
        io.read(tmp_path / "a.doc")
    with pytest.raises(FileError, match=r"the suffix tells no format; known are"):
        io.write(tmp_path / "a.doc", TRIANGLE)
    with pytest.raises(ParameterError, match="no format named 'word'; known are: tri, stl, obj"):
        io.read(tmp_path / "a.doc", format="word")


@pytest.mark.parametrize(("unit", "metres"), [("m", 1), ("mm", 0.001), ("in", 0.0254)])
def test_units_turn_lengths_into_metres_and_back(tmp_path, unit, metres):
    io.write(tmp_path / "a.tri", TRIANGLE)
    read = io.read(tmp_path / "a.tri", units=unit)
    np.testing.assert_array_equal(read.points, np.eye(3) * metres)
    io.write(tmp_path / "b.tri", read, units=unit)
    assert (tmp_path / "b.tri").read_bytes() == (tmp_path / "a.tri").read_bytes()
    with pytest.raises(ParameterError, match="no unit named 'yd'; known are: m, mm, cm, in, ft"):
        io.read(tmp_path / "a.tri", units="yd")


def test_options_reach_the_format(tmp_path):
    io.write(tmp_path / "a.stl", TRIANGLE)
    assert len(io.read(tmp_path / "a.stl", tolerance=2.0).points) == 1


def test_a_format_refuses_what_it_cannot_hold(tmp_path):
    with pytest.raises(GeometryError, match=r"STL holds a Surface, got a Grid; .* PLOT3D"):
        io.write(tmp_path / "a.stl", PATCH)
    with pytest.raises(GeometryError, match="got a Cloud; formats for it: none"):
        io.write(tmp_path / "a.stl", Cloud(np.eye(3)))
    broken = TRIANGLE.moved(np.full((3, 3), np.nan))
    with pytest.raises(GeometryError, match=r"3 of 3 points are not finite \(first: 0\); nothing"):
        io.write(tmp_path / "a.stl", broken)
    assert not list(tmp_path.iterdir())


def test_the_systems_errors_name_file_and_remedy(tmp_path):
    with pytest.raises(FileError, match=r"none\.tri: no such file; check the name"):
        io.read(tmp_path / "none.tri")
    with pytest.raises(FileError, match="is a folder, expected a file"):
        io.read(tmp_path)
    with pytest.raises(FileError, match="no such folder; make it first"):
        io.write(tmp_path / "none" / "a.tri", TRIANGLE)
    (tmp_path / "folder.tri").mkdir()
    with pytest.raises(FileError, match=r"folder\.tri: is a folder"):
        io.write(tmp_path / "folder.tri", TRIANGLE)
    (tmp_path / "empty").touch()
    with pytest.raises(FileError, match="the file is empty"):
        io.read(tmp_path / "empty")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.tri"
    path.write_text("old")
    full = OSError(errno.ENOSPC, "No space left on device")
    message = "no space left on device; the old file, if any, is as it was"
    with pytest.raises(FileError, match=message), files.replacing(path) as file:
        file.write(b"new")
        raise full
    assert [p.name for p in tmp_path.iterdir()] == ["a.tri"]
    assert path.read_text() == "old"


def test_a_write_keeps_the_mode_and_follows_a_link(tmp_path):
    real, link = tmp_path / "real.tri", tmp_path / "link.tri"
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to(real)
    io.write(link, TRIANGLE)
    assert link.is_symlink()
    assert real.stat().st_mode & 0o777 == 0o640
    assert same_bits(io.read(real).points, TRIANGLE.points)


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_read_only_string_path_works_too(tmp_path, name):
    geometry, options = EXAMPLES[name]
    io.write(str(tmp_path / name), geometry, **options)
    assert type(io.read(str(tmp_path / name))) is type(geometry)


def test_long_rubbish_is_refused_at_once():
    with pytest.raises(FileError, match="line 1: found '1111"):
        text.numbers(b"1" * 200_000 + b"x", Path("a"))


def test_every_real_file_is_told_apart(data):
    names = {
        "crm_wing_body_patches.xyz.gz": "PLOT3D",
        "naca0012.dat": "airfoil coordinates",
        "pygeo/c172.stl": "STL",
        "su2/onera_m6_surface.stl": "STL",
        "su2/brick_tets_ffd.su2": "SU2",
    }
    assert {name: io.found(data(name)).NAME for name in names} == names
