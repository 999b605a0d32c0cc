"""Cart3D triangulations in all variants."""

import numpy as np
import pytest
from conftest import same_bits

from moldline.errors import FileError, ParameterError
from moldline.mesh.io import tri
from moldline.mesh.surface import Surface

SMALL = "3 1\n0 0 0\n1 0 0\n0 1 0\n1 2 3\n"


def written(tmp_path, content, name="wing.tri"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_text_keeps_every_bit(tmp_path, surface):
    tri.write(tmp_path / "a.i.tri", surface)
    read = tri.read(tmp_path / "a.i.tri")
    assert same_bits(read.points, surface.points)
    assert same_bits(read.faces, surface.faces)
    assert same_bits(read.tags, surface.tags)
    assert read.components == surface.components


@pytest.mark.parametrize("binary", ["little", "big"])
@pytest.mark.parametrize("records", [False, True])
@pytest.mark.parametrize("precision", [4, 8])
@pytest.mark.parametrize("name", ["a.tri", "a.triq"])
@pytest.mark.parametrize("components", [("1",), ("1", "2", "7")])
def test_every_binary_variant_reads_back(tmp_path, binary, records, precision, name, components):
    rng = np.random.default_rng(1)
    points = rng.standard_normal((9, 3)).astype(f"f{precision}").astype(float)
    scalars = {"Cp": points[:, 0].copy(), "q2": points[:, 1].copy()}
    tags = np.arange(12) % len(components)
    surface = Surface(points, rng.integers(0, 9, (12, 3)), tags, components, scalars)
    tri.write(tmp_path / name, surface, binary=binary, records=records, precision=precision)
    read = tri.read(tmp_path / name)
    assert tri.sniff((tmp_path / name).read_bytes(), tmp_path / name)
    assert same_bits(read.points, points)
    assert same_bits(read.faces, surface.faces)
    assert same_bits(read.tags, surface.tags)
    assert read.components == components
    if name.endswith("q"):
        assert list(read.point_data) == ["Cp", "q2"]
        assert same_bits(read.point_data["q2"], scalars["q2"])


def test_scalars_in_text_are_named_in_their_order(tmp_path):
    data = {"Cp": np.zeros(3)} | {f"q{k}": np.full(3, float(k)) for k in range(2, 12)}
    tri.write(tmp_path / "a.triq", Surface(np.eye(3), np.array([[0, 1, 2]]), point_data=data))
    read = tri.read(tmp_path / "a.triq")
    assert {name: array[0] for name, array in read.point_data.items()} == {
        name: array[0] for name, array in data.items()
    }


@pytest.mark.parametrize(
    "layout",
    [
        "3 1 0 0 0 1 0 0 0 1 0 1 2 3",
        "3\n1\n0 0\n0 1 0 0\n0\t1 0 1\n2 3",
        "3 1\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n1 2 3\r\n",
        "3 1\r0 0 0\r1 0 0\r0 1 0\r1 2 3",
        "3 1\n4*0.0D0 3*0 1.0d+00 0\n1 2 3".replace("4*0.0D0 3*0", "3*0.0D0 1 3*0"),
    ],
)
def test_numbers_may_be_laid_out_in_any_way(tmp_path, layout):
    read = tri.read(written(tmp_path, layout))
    np.testing.assert_array_equal(read.points, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(read.faces, [[0, 1, 2]])
    assert read.components == ("1",)


def test_component_ids_become_names(tmp_path):
    read = tri.read(written(tmp_path, SMALL.replace("3 1\n", "3 2\n", 1) + "3 2 1\n9 4\n"))
    assert read.components == ("4", "9")
    assert read.tags.tolist() == [1, 0]


def test_names_that_are_no_numbers_are_numbered(tmp_path, surface):
    named = Surface(surface.points, surface.faces, surface.tags, ("wing", "body", "tail"))
    tri.write(tmp_path / "a.tri", named)
    assert tri.read(tmp_path / "a.tri").components == ("1", "2", "3")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (SMALL[:-2], "3 vertices and 1 triangles need 14 numbers, the file has 13; was the copy"),
        (SMALL + "1 1", "need 15 numbers, the file has 16; is it another format"),
        (SMALL.replace("1 2 3", "1 2 4"), "triangle 1 refers to 4, expected a whole number from 1"),
        (SMALL.replace("1 2 3", "1 2 0"), "triangle 1 refers to 0"),
        (SMALL.replace("1 2 3", "1 2 2.5"), "triangle 1 refers to 2.5"),
        (SMALL.replace("0 1 0", "0 1,5 0"), "line 4: found '1,5', .* write decimal commas as"),
        (SMALL.replace("0 1 0", "0 nan 0"), "line 4: found 'nan', expected a finite number"),
        (SMALL.replace("0 1 0", "0 1e999 0"), "line 4: found '1e999', expected a finite"),
        (SMALL.replace("0 1 0", "0 1.5.5 0"), r"line 4: found '1\.5\.5', expected a number"),
        (SMALL.encode().replace(b"0 1 0", b"0 \xff\xfe 0"), "line 4: found 'ÿþ'"),
        (
            SMALL.replace("0 1 0", "0 99999999999999*1 0"),
            "line 4: repeat counts make too many numbers",
        ),
        (SMALL + "-1e308", "component ids must be whole numbers, found -1e.308"),
        ("999999999 2\n0 0 0\n", "999999999 vertices and 2 triangles need"),
        ("-3 1\n0 0 0\n", "found -3 as the number of vertices"),
        ("3\n", "the header needs 2 numbers, the file has 1"),
        ("   \n", "the header needs 2 numbers, the file has 0"),
        ("", "the file is empty"),
        (b"\0" * 9, "counts nothing known"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, content, message):
    with pytest.raises(FileError, match=message) as caught:
        tri.read(written(tmp_path, content))
    assert "wing.tri: " in str(caught.value)


@pytest.mark.parametrize("records", [False, True])
def test_a_binary_file_cut_short_anywhere_is_refused(tmp_path, surface, records):
    tri.write(tmp_path / "a.tri", surface, binary="big", records=records)
    whole = (tmp_path / "a.tri").read_bytes()
    for size in range(0, len(whole), 7):
        with pytest.raises(FileError):
            tri.read(written(tmp_path, whole[:size]))
    with pytest.raises(FileError, match=r"30 vertices and 30 triangles need .* the file has"):
        tri.read(written(tmp_path, whole[:-1]))


def test_a_damaged_record_marker_is_named(tmp_path, surface):
    tri.write(tmp_path / "a.tri", surface, binary="little", records=True)
    whole = bytearray((tmp_path / "a.tri").read_bytes())
    whole[740] = 99
    with pytest.raises(FileError, match="byte 740: a record of 611 bytes, expected 720"):
        tri.read(written(tmp_path, bytes(whole)))


def test_infinity_in_binary_is_refused(tmp_path):
    surface = Surface(np.eye(3), np.array([[0, 1, 2]]))
    tri.write(tmp_path / "a.tri", surface, binary="little")
    whole = (tmp_path / "a.tri").read_bytes()
    inf = np.float64(np.inf).tobytes()
    with pytest.raises(FileError, match=r"vertex 1 is \[inf"):
        tri.read(written(tmp_path, whole[:8] + inf + whole[16:]))


def test_four_bytes_refuse_what_they_cannot_hold(tmp_path, surface):
    with pytest.raises(FileError, match="does not fit a float of 4 bytes"):
        tri.write(tmp_path / "a.tri", surface, binary="little", precision=4)
    assert not list(tmp_path.iterdir())


def test_options_that_do_not_exist_are_refused(tmp_path, surface):
    with pytest.raises(ParameterError, match="'little' or 'big', got 'middle'"):
        tri.write(tmp_path / "a.tri", surface, binary="middle")
    with pytest.raises(ParameterError, match="4 or 8 bytes, got 2"):
        tri.write(tmp_path / "a.tri", surface, binary="big", precision=2)
