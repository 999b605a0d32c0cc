"""Airfoil coordinates."""

import numpy as np
import pytest
from conftest import hard_points, same_bits

from moldline.errors import FileError
from moldline.mesh.io import dat
from moldline.mesh.section import Section

SELIG = "1 0\n0.5 0.1\n0 0\n0.5 -0.05\n1 0\n"
LEDNICER = "3. 3.\n\n0 0\n0.5 0.1\n1 0\n\n0 0\n0.5 -0.05\n1 0\n"


def read(tmp_path, content):
    path = tmp_path / "n12.dat"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return dat.read(path)


@pytest.mark.parametrize("lednicer", [False, True])
def test_what_is_written_reads_back_to_the_bit(tmp_path, lednicer):
    points = hard_points(12) * [1, 1, 0]
    points[:, 2] = 0.0
    points[0] = [0.25, -0.0, 0]
    dat.write(tmp_path / "a.dat", Section(points, "NACA 0012 ü"), lednicer=lednicer)
    read = dat.read(tmp_path / "a.dat")
    assert same_bits(read.points, points)
    assert read.name == "NACA 0012 ü"


@pytest.mark.parametrize("title", ["", "NACA 0012\n", "\n\n  NACA 0012 \r\n"])
@pytest.mark.parametrize("body", [SELIG, LEDNICER])
def test_both_orders_give_seligs(tmp_path, title, body):
    section = read(tmp_path, title + body)
    np.testing.assert_array_equal(section.points[:, 0], [1, 0.5, 0, 0.5, 1])
    np.testing.assert_array_equal(section.points[:, 1], [0, 0.1, 0, -0.05, 0])
    assert section.name == ("NACA 0012" if title else "n12")


def test_sides_with_different_noses_keep_both(tmp_path):
    apart = "3 3\n0 0.01\n0.5 0.1\n1 0\n0 0\n0.5 -0.05\n1 0\n"
    assert len(read(tmp_path, apart).points) == 6


def test_a_name_of_two_numbers_does_not_become_a_point(tmp_path):
    dat.write(tmp_path / "a.dat", Section(np.eye(3)[:2], "12 13"))
    assert dat.read(tmp_path / "a.dat").name == "airfoil 12 13"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("name\n" + SELIG.replace("0 0", "0"), "line 4: found 1 numbers, expected x and y"),
        ("name\n" + SELIG.replace("0 0", "0 0 0"), "line 4: found 3 numbers"),
        ("\nname\n" + SELIG.replace("0 0", "0 O"), "line 5: found 'O', expected a number"),
        ("name\n" + SELIG.replace("0.1", "0,1"), "line 3: found '0,1', .*decimal commas"),
        ("name\n" + SELIG.replace("0.1", "nan"), "line 3: found 'nan', expected a finite"),
        (LEDNICER[:-4], "3 points above and 3 below need 6 lines, the file has 5"),
        ("name\n1 0\n", "the file has 1 points, expected at least 2"),
        (b"\xff\xfe\0\n", "the file has 0 points"),
        ("", "the file is empty"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, content, message):
    with pytest.raises(FileError, match=message):
        read(tmp_path, content)


def test_the_real_airfoil_is_read(data):
    section = dat.read(data("naca0012.dat"))
    assert len(section.points) == 160
    assert section.name == "naca0012"
    np.testing.assert_array_equal(section.points[[0, -1], 0], [1, 1])
    assert section.points[0, 1] > section.points[-1, 1]
