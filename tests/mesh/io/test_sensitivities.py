"""Files of geometries with the derivatives of their points."""

import importlib
import io as streams
import sys
import zipfile

import jax
import numpy as np
import pytest
from conftest import same_bits
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from strategies import geometry

from moldline.errors import FileError, GeometryError, MoldlineError
from moldline.mesh import Cloud, VolumeMesh, io
from moldline.mesh.io import npz
from moldline.mesh.io.sensitivities import read_sensitivities, write_sensitivities
from moldline.mesh.surface import Surface

LABELS = ["span", "dz[3,1]", "file", "ü & <b> \"c\" 'd'", "Model__wing__Variable__x[0]"]

HAS_HDF5 = importlib.util.find_spec("h5py") is not None
needs_hdf5 = pytest.mark.skipif(not HAS_HDF5, reason="h5py, an optional extra, is not installed")
hdf5 = pytest.param("a.h5", marks=needs_hdf5)

quick = settings(
    max_examples=200,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)


def columns(points, seed=1):
    """Derivatives with the doubles that are hardest to write."""
    rng = np.random.default_rng(seed)
    hard = [5e-324, -0.0, 1.7976931348623157e308, 0.1, 1 / 3, -1e-5]
    made = {label: rng.standard_normal(points.shape) for label in LABELS}
    for column in made.values():
        column[rng.random(points.shape) < 0.3] = rng.choice(hard)
    return made


def bare(surface):
    return Surface(surface.points, surface.faces, surface.tags, surface.components)


def same(one, other):
    assert jax.tree.structure(one) == jax.tree.structure(other)
    assert all(map(same_bits, jax.tree.leaves(one), jax.tree.leaves(other)))


@pytest.mark.parametrize("name", ["a.trix", "a.vtp", "a.npz", "a.trix.gz", hdf5])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_is_written_reads_back_to_the_bit(tmp_path, name, seed):
    surface = bare(geometry(Surface, seed))
    made = columns(surface.points, seed)
    if name.endswith(".gz"):
        io.write(tmp_path / name, Surface(surface.points, surface.faces, point_data=made))
        same(read_sensitivities(tmp_path / name)[1], made)
        return
    write_sensitivities(tmp_path / name, surface, made)
    again, read = read_sensitivities(tmp_path / name)
    same(again, surface)
    same(read, made)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.npz", hdf5])
def test_what_has_no_triangles_comes_back_as_a_cloud(tmp_path, name):
    mesh = geometry(VolumeMesh, 4)
    write_sensitivities(tmp_path / name, mesh, columns(mesh.points))
    cloud, read = read_sensitivities(tmp_path / name)
    assert isinstance(cloud, Cloud)
    assert same_bits(cloud.points, mesh.points)
    same(read, columns(mesh.points))


def test_a_folder_holds_a_file_per_number(tmp_path):
    surface = bare(geometry(Surface, 7))
    made = {label: column for label, column in columns(surface.points).items() if "<" not in label}
    write_sensitivities(tmp_path / "wing", surface, made, per_variable=True)
    folders = sorted(path.name for path in (tmp_path / "wing").iterdir())
    assert folders == ["Model__wing__Variable__x_0_", "dz_3_1_", "file", "span"]
    path = tmp_path / "wing/dz_3_1_/Components.i.tri"
    assert path.read_text().count("SHAPE_LINEARIZATION") == 1
    same(read_sensitivities(path), (surface, {"dz[3,1]": made["dz[3,1]"]}))
    again, read = read_sensitivities(tmp_path / "wing")
    same(again, surface)
    same(read, made)


def test_folders_that_cannot_be_are_refused_before_anything_is_written(tmp_path, ball):
    column = np.asarray(ball.points)
    for label in ("../../etc", "a/b", "..", "", "a\\b", "a\nb", "C:"):
        with pytest.raises(FileError, match=r"no folder can be named .*; rename the variable"):
            write_sensitivities(tmp_path, ball, {"x": column, label: column}, per_variable=True)
    with pytest.raises(FileError, match=r"'a\[1\]' and 'a_1_' would both go to the folder a_1_"):
        write_sensitivities(tmp_path, ball, {"a[1]": column, "a_1_": column}, per_variable=True)
    (tmp_path / "x").touch()
    with pytest.raises(FileError, match="x: cannot make the folder: File exists"):
        write_sensitivities(tmp_path, ball, {"x": column}, per_variable=True)
    assert [path.name for path in tmp_path.iterdir()] == ["x"]


def test_a_folder_of_different_geometries_or_of_none_is_refused(tmp_path, ball):
    column = {"a": np.asarray(ball.points)}
    write_sensitivities(tmp_path, ball, column, per_variable=True)
    write_sensitivities(tmp_path, ball.moved(2 * ball.points), {"b": column["a"]}, None, True)
    with pytest.raises(FileError, match="its points are not those of"):
        read_sensitivities(tmp_path)
    (tmp_path / "none").mkdir()
    with pytest.raises(FileError, match=r"has no folders with a file Components\.i\.tri"):
        read_sensitivities(tmp_path / "none")


@pytest.mark.parametrize("name", ["a.trix", "a.vtp", "a.npz", hdf5])
def test_units_scale_points_and_derivatives(tmp_path, ball, name):
    made = {"a": np.asarray(ball.points)}
    write_sensitivities(tmp_path / name, ball, made, units="mm")
    plain, _ = read_sensitivities(tmp_path / name)
    np.testing.assert_allclose(plain.points, 1000 * np.asarray(ball.points), rtol=1e-15)
    again, read = read_sensitivities(tmp_path / name, units="mm")
    np.testing.assert_allclose(again.points, ball.points, rtol=1e-15)
    np.testing.assert_allclose(read["a"], ball.points, rtol=1e-15)


def test_derivatives_that_do_not_fit_or_are_no_numbers_are_refused(tmp_path, ball):
    for name in ("a.trix", "a.npz", "a.h5", "a.vtp"):
        with pytest.raises(GeometryError, match=r"derivatives 'a' have the shape \(2, 3\), the"):
            write_sensitivities(tmp_path / name, ball, {"a": np.zeros((2, 3))})
        bad = np.full(ball.points.shape, np.nan)
        with pytest.raises(
            GeometryError, match=r"derivatives 'a' are not finite .*nothing was wri"
        ):
            write_sensitivities(tmp_path / name, ball, {"a": bad})
    assert not list(tmp_path.iterdir())


def test_names_that_a_table_needs_itself_are_refused(tmp_path, ball):
    for name in ("a.npz", "a.h5"):
        with pytest.raises(FileError, match="no variable can be named 'faces' there; rename it"):
            write_sensitivities(tmp_path / name, ball, {"faces": np.asarray(ball.points)})


def test_a_suffix_that_holds_none_is_refused(tmp_path, ball):
    mesh = geometry(VolumeMesh, 4)
    with pytest.raises(FileError, match=r"a Surface go to \.npz, \.h5, \.vtp or \.trix"):
        write_sensitivities(tmp_path / "a.stl", ball, {})
    for name, per_variable in (("a.trix", False), ("a.npz", True)):
        with pytest.raises(FileError, match=r"a VolumeMesh go to \.npz, \.h5; surfaces also"):
            write_sensitivities(tmp_path / name, mesh, {}, per_variable=per_variable)
    io.write(tmp_path / "a.stl", ball)
    with pytest.raises(FileError, match="is STL, which holds no sensitivities; they come in trix"):
        read_sensitivities(tmp_path / "a.stl")


def test_hdf5_without_h5py_tells_what_to_install(tmp_path, ball, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    (tmp_path / "a.h5").write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(FileError, match=r"not installed; pip install 'moldline\[hdf5\]'"):
        write_sensitivities(tmp_path / "b.h5", ball, {})
    with pytest.raises(FileError, match=r"not installed; pip install 'moldline\[hdf5\]'"):
        read_sensitivities(tmp_path / "a.h5")
    assert not (tmp_path / "b.h5").exists()


@needs_hdf5
def test_hdf5_has_no_names_with_slashes(tmp_path, ball):
    for label in ("a/b", ".", ""):
        with pytest.raises(FileError, match=r"HDF5 has no data named .*rename it, or write"):
            write_sensitivities(tmp_path / "a.h5", ball, {label: np.asarray(ball.points)})
    assert not list(tmp_path.iterdir())


def small(path):
    """A small file's bytes, and what it holds."""
    surface = Surface(np.eye(3), [[0, 1, 2], [0, 2, 1]], [0, 1], ("a", "ü"))
    write_sensitivities(path, surface, {"x": np.eye(3) / 3})
    return path.read_bytes(), read_sensitivities(path)


@pytest.mark.parametrize("name", ["a.trix", "a.vtp", "a.npz", hdf5])
def test_a_file_cut_short_anywhere_is_refused(tmp_path, name):
    path = tmp_path / name
    whole, content = small(path)
    for size in range(0, len(whole), 1 + len(whole) // 3_000):
        path.write_bytes(whole[:size])
        try:
            same(read_sensitivities(path), content)
        except FileError:
            continue
        assert whole[size:].isspace() or not any(whole[size:])


@pytest.mark.parametrize("name", ["a.npz", hdf5])
@quick
@given(data=st.data())
def test_a_broken_table_is_refused_or_a_valid_geometry(tmp_path_factory, name, data):
    path = tmp_path_factory.getbasetemp() / name
    broken = bytearray(small(path)[0])
    for _ in range(data.draw(st.integers(1, 4))):
        broken[data.draw(st.integers(0, len(broken) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(broken)
    try:
        geometry, found = read_sensitivities(path)
    except MoldlineError:
        return
    assert np.isfinite(geometry.points).all()
    assert all(column.shape == geometry.points.shape for column in found.values())


def archive(path, members, **options):
    with zipfile.ZipFile(path, "w", **options) as file:
        for name, content in members.items():
            file.writestr(name, content)


def packed(array, **options):
    stream = streams.BytesIO()
    np.save(stream, array, **options)
    return stream.getvalue()


GOOD = {"points.npy": packed(np.eye(3)), "x.npy": packed(np.ones((3, 3)))}


def test_what_numpy_writes_in_its_own_ways_is_read(tmp_path):
    arrays = {
        "points": np.asfortranarray(np.arange(12.0).reshape(4, 3)),
        "x": np.ones((4, 3), ">f4"),
    }
    for number, save in enumerate((np.savez, np.savez_compressed)):
        save(tmp_path / f"{number}.npz", **arrays)
        cloud, found = read_sensitivities(tmp_path / f"{number}.npz")
        assert np.asarray(cloud.points).tolist() == arrays["points"].tolist()
        assert found["x"].tolist() == arrays["x"].tolist()


@pytest.mark.parametrize(
    ("member", "content", "message"),
    [
        ("points.npy", None, "has no array 'points'; found: x"),
        ("points.npy", packed(np.eye(3)[:2]), r"'x' is float64 of shape \(3, 3\), expected float"),
        ("points.npy", packed(np.float64(3)), r"'points' is float64 of shape \(1,\), expected"),
        ("points.npy", packed(np.eye(3) * np.nan), "'points' holds values that are not finite"),
        ("x.npy", packed(np.ones(3)), r"'x' is float64 of shape \(3,\), expected floats of"),
        ("x.npy", packed(np.ones((3, 3), int)), "'x' is int64 of shape"),
        ("x.npy", packed(np.ones((3, 3)))[:-1], "'x.npy' needs 72 bytes, the file has 71; was"),
        ("x.npy", packed(np.ones((3, 3))).replace(b"(3, 3)", b"(9, 9)"), "needs 648 bytes"),
        ("x.npy", packed(np.ones((3, 3))).replace(b"(3, 3), }   ", b"(99999999, 9)}"), "begins"),
        ("x.npy", b"rubbish", "'x.npy' begins with '', expected an array of numbers or words"),
        ("x.npy", packed(np.array([{}], object), allow_pickle=True), r"begins with .*'\|O'"),
        ("faces.npy", packed(np.array([[0, 1, 3]])), "face 0 refers to 3, expected .* 0 to 2"),
        ("faces.npy", packed(np.array([0, 1, 2])), r"'faces' is int64 of shape \(3,\), expected"),
        ("faces.npy", packed(np.eye(3)), "'faces' is float64 of shape .*expected whole numbers"),
    ],
)
def test_what_is_wrong_with_an_npz_is_named(tmp_path, member, content, message):
    members = {k: v for k, v in {**GOOD, member: content}.items() if v is not None}
    archive(tmp_path / "a.npz", members)
    with pytest.raises(FileError, match=message):
        read_sensitivities(tmp_path / "a.npz")


def test_bombs_are_refused_before_they_unpack(tmp_path):
    path = tmp_path / "a.npz"
    archive(path, {**GOOD, "x.npy": bytes(2**23)}, compression=zipfile.ZIP_DEFLATED)
    with pytest.raises(FileError, match="unpacks to more than 256 times its size"):
        npz.read_arrays(path)
    archive(path, GOOD, compression=zipfile.ZIP_LZMA)
    with pytest.raises(FileError, match="packed in a way that NumPy does not use"):
        npz.read_arrays(path)


class Trap:
    def __reduce__(self):
        return eval, ("1 / 0",)


def test_nothing_is_unpickled(tmp_path):
    trap = packed(np.array([Trap()], object), allow_pickle=True)
    with pytest.raises(ZeroDivisionError):
        np.load(streams.BytesIO(trap), allow_pickle=True)
    archive(tmp_path / "a.npz", {**GOOD, "x.npy": trap})
    with pytest.raises(FileError, match="expected an array of numbers or words"):
        read_sensitivities(tmp_path / "a.npz")


@needs_hdf5
@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (
            lambda f, _: f.create_dataset("x", (2**40, 3), "f8", chunks=(9, 3)),
            "'x' is of .*cut short",
        ),
        (lambda f, _: f.create_group("x"), "'x' is a group, expected an array"),
        (
            lambda f, _: f.create_dataset("x", data=np.array(["a"], object)),
            "'x' holds object, expecte",
        ),
        (
            lambda f, h5py: f.create_dataset("x", data=h5py.Empty("f8")),
            "'x' holds float64, expected numbers",
        ),
        (
            lambda f, _: f.create_dataset("x", (3, 3), "f8", external=[("/etc/hostname", 0, 72)]),
            "'x' lies in another file",
        ),
        (lambda f, _: f.create_dataset("x", data=np.ones(3)), r"'x' is float64 of shape \(3,\)"),
    ],
)
def test_what_is_wrong_with_an_hdf5_is_named(tmp_path, spoil, message):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["points"] = np.eye(3)
        spoil(file, h5py)
    with pytest.raises(FileError, match=message):
        read_sensitivities(tmp_path / "a.h5")


@needs_hdf5
def test_links_out_of_an_hdf5_are_not_followed(tmp_path):
    h5py = pytest.importorskip("h5py")
    for name in ("b.h5", "a.h5"):
        with h5py.File(tmp_path / name, "w") as file:
            file["points"] = np.eye(3)
            file["y"] = np.ones((3, 3))
            if name == "a.h5":
                file["x"] = h5py.ExternalLink("b.h5", "y")
    with pytest.raises(FileError, match="'x' lies in another file; copy it into this one"):
        read_sensitivities(tmp_path / "a.h5")
