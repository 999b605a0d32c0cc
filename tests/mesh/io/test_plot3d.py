"""PLOT3D blocks in all variants."""

import gzip

import numpy as np
import pytest
from conftest import same_bits

from moldline.errors import FileError
from moldline.mesh.grid import Grid
from moldline.mesh.io import plot3d

PATCH = "1\n2 2 1\n0 1 0 1\n0 0 1 1\n4*0.5D0\n"
CORNERS = [[0, 0, 0.5], [1, 0, 0.5], [0, 1, 0.5], [1, 1, 0.5]]


def read(tmp_path, content, name="patch.xyz"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return plot3d.read(path)


@pytest.mark.parametrize("name", ["a.xyz", "a.xyz.gz"])
def test_text_keeps_every_bit_packed_or_not(tmp_path, grid, name):
    plot3d.write(tmp_path / name, grid)
    read = plot3d.read(tmp_path / name)
    assert same_bits(read.points, grid.points)
    assert read.shapes == grid.shapes
    assert (tmp_path / name).read_bytes().startswith(b"\x1f\x8b") == name.endswith("gz")


@pytest.mark.parametrize("binary", ["little", "big"])
@pytest.mark.parametrize("records", [False, True])
@pytest.mark.parametrize("precision", [4, 8])
@pytest.mark.parametrize("shapes", [((2, 3, 4),), ((2, 3, 4), (3, 2, 1), (1, 5, 1))])
def test_every_binary_variant_reads_back(tmp_path, binary, records, precision, shapes):
    count = sum(i * j * k for i, j, k in shapes)
    points = np.random.default_rng(2).random((count, 3)).astype(f"f{precision}").astype(float)
    path = tmp_path / "a.xyz"
    plot3d.write(path, Grid(points, shapes), binary=binary, records=records, precision=precision)
    read = plot3d.read(path)
    assert plot3d.sniff(path.read_bytes(), path)
    assert same_bits(read.points, points)
    assert read.shapes == shapes


@pytest.mark.parametrize(
    ("content", "height"),
    [
        (PATCH, 0.5),
        (PATCH.removeprefix("1\n"), 0.5),
        (PATCH.replace("2 2 1", "2 2"), 0.5),
        (PATCH.removeprefix("1\n").replace("2 2 1", "2 2"), 0.5),
        (PATCH.replace("2 2 1", "2 2").replace("4*0.5D0\n", ""), 0.0),
        (PATCH.removeprefix("1\n").replace("2 2 1", "2 2").replace("4*0.5D0\n", ""), 0.0),
        (PATCH.replace("4*0.5D0", ".5 5-1 5.E-1\r\n+0.05d+1"), 0.5),
    ],
)
def test_headers_and_numbers_of_all_kinds_are_understood(tmp_path, content, height):
    grid = read(tmp_path, content)
    assert grid.shapes == ((2, 2, 1),)
    np.testing.assert_array_equal(grid.points, [[x, y, height] for x, y, _ in CORNERS])


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_binary_block_without_their_number_or_nk_is_understood(tmp_path, order):
    flat = np.array(CORNERS).T.astype(f"{order}f8").tobytes()

    def record(part):
        marker = np.array(len(part), f"{order}i4").tobytes()
        return marker + part + marker

    shape, plane = (np.array(s, f"{order}i4").tobytes() for s in ([2, 2, 1], [2, 2]))
    one = np.array([1], f"{order}i4").tobytes()
    headers = [shape, record(shape), record(plane), record(one) + record(plane)]
    for header in headers:
        body = flat if header == shape else record(flat)
        assert read(tmp_path, header + body).shapes == ((2, 2, 1),)


def test_the_first_index_runs_fastest(tmp_path):
    np.testing.assert_array_equal(read(tmp_path, PATCH).block(0)[1, 0, 0], [1, 0, 0.5])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (PATCH.replace("4*", "3*"), "1 blocks with 4 points .* need 16 numbers, the file has 15"),
        (PATCH.replace("4*", "x*"), "line 5: found 'x\\*0.5D0', expected a number"),
        (PATCH.replace("4*0.5D0", "1 nan 1 1"), "line 5: found 'nan', expected a finite"),
        (PATCH.replace("2 2 1", "999999 99999 99999"), "need .* numbers, the file has 16"),
        ("0\n1 1\n", r"the file begins with .*, expected the number of blocks"),
        ("1.5\n1 1\n", r"the file begins with"),
        ("-1\n", r"the file begins with"),
        (" \n", r"the file begins with"),
        ("", "the file is empty"),
        (b"\0\0\0\0\0", "counts nothing known"),
        (gzip.compress(PATCH.encode())[:-12], "damaged gzip data"),
        (gzip.compress(b" " * 10**7), "unpacks to more than 256 times its"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, content, message):
    with pytest.raises(FileError, match=message):
        read(tmp_path, content)


@pytest.mark.parametrize("records", [False, True])
@pytest.mark.parametrize("shapes", [((7, 5, 1),), ((2, 3, 4), (3, 2, 1), (1, 5, 1))])
def test_a_binary_file_cut_short_anywhere_is_refused(tmp_path, grid, records, shapes):
    grid = Grid(grid.points, shapes)
    plot3d.write(tmp_path / "a.xyz", grid, binary="big", records=records)
    whole = (tmp_path / "a.xyz").read_bytes()
    for size in range(len(whole)):
        with pytest.raises(FileError):
            read(tmp_path, whole[:size])
    with pytest.raises(FileError, match=r"blocks with 35 points .* need"):
        read(tmp_path, whole[:-1])


@pytest.mark.parametrize(
    ("name", "blocks", "points"),
    [
        ("crm_wing_body_patches.xyz.gz", 18, 21550),
        ("pygeo/bwb.xyz", 1, 32),
        ("pygeo/c172.xyz", 1, 32),
        ("pygeo/bodyFFD.xyz", 5, 40),
    ],
)
def test_real_files_are_read(data, name, blocks, points):
    grid = plot3d.read(data(name))
    assert (len(grid.shapes), len(grid.points)) == (blocks, points)


@pytest.mark.parametrize("binary", ["little", "big"])
@pytest.mark.parametrize("step", [0.5, 0.1, 0.25, 1 / 3])
def test_half_a_stream_of_long_floats_does_not_pass_for_short_ones(tmp_path, binary, step):
    axes = np.meshgrid(*(step * np.arange(n) for n in (5, 4, 3)), indexing="ij")
    box = Grid(np.stack([axis.ravel(order="F") for axis in axes], axis=1), ((5, 4, 3),))
    plot3d.write(tmp_path / "a.xyz", box, binary=binary)
    whole = (tmp_path / "a.xyz").read_bytes()
    with pytest.raises(FileError, match=r"halves of 8-byte floats.*was the copy cut in half"):
        read(tmp_path, whole[: len(whole) - 4 * 3 * 60])


@pytest.mark.parametrize("shape", [(2, 2, 1), (2, 2, 2), (2, 1, 5), (9, 7, 1)])
@pytest.mark.parametrize("noise", [0.0, 1e-17])
def test_boxes_and_patches_of_short_floats_are_read(tmp_path, shape, noise):
    axes = np.meshgrid(*(np.linspace(noise, 1, n) for n in shape), indexing="ij")
    points = np.stack([axis.ravel(order="F") for axis in axes], axis=1).astype("f4").astype(float)
    plot3d.write(tmp_path / "a.xyz", Grid(points, (shape,)), binary="big", precision=4)
    assert same_bits(plot3d.read(tmp_path / "a.xyz").points, points)


def test_shapes_that_do_not_run_on_in_the_next_line_are_believed_first(tmp_path, grid):
    plot3d.write(tmp_path / "a.xyz", grid)
    numbers = (tmp_path / "a.xyz").read_bytes().split(b"\n")
    header, body = numbers[:4], b" ".join(numbers[4:]).split()
    assert len(grid.shapes) == 3
    for count in range(len(body)):
        with pytest.raises(FileError):
            read(tmp_path, b"\n".join([*header, b" ".join(body[:count])]))
