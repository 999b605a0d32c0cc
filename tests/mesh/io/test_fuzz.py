"""Every reader against hostile, broken and random valid files.

A format joins by being in `FORMATS`; `strategies.VARIANTS` says what its files keep.
"""

import gzip
import re
import time
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import jax
import numpy as np
import pytest
from conftest import same_bits
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from strategies import READABLE, broken, geometry, key, valid_files, variants, written

from moldline.errors import FileError, GeometryError
from moldline.mesh import Geometry, io
from moldline.mesh.io import text
from moldline.mesh.section import Section
from moldline.mesh.surface import Surface
from moldline.mesh.volume import VolumeMesh

MULTIPLE, BASE = 40, 10 * 2**20
"""Bytes that reading may take: so many times the (unpacked) file, and so many besides."""

LONGEST = 5.0
"""Seconds of computing that no small file may take; traced, and on a slow machine."""

EVERYTHING = (
    "points faces tags components point_data face_data shapes name is_closed cells markers "
    "dimension"
)
"""What geometries consist of, but for SU2's `extra`, which keeps blanks."""

OPEN_ENDED = {"obj", "dat", "su2", "stl"}
"""Texts that do not say how much there is to come, so that one cut at a line's end is whole."""

NAMES = ["a\nNDIME= 3", "50 % b", "a\\", "\ud800", "\0", "f 1 2 3", "", " "]

quick = settings(
    max_examples=100,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)
quicker = settings(quick, max_examples=40)
thorough = settings(quick, max_examples=10_000, derandomize=False)

every_reader = pytest.mark.parametrize("module", READABLE, ids=key)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


@contextmanager
def bounded(size: int, base: int) -> Iterator[None]:
    """Refuses to take long, or much more memory than a file's size."""
    tracemalloc.start()
    begin = time.process_time()
    try:
        yield
    finally:
        peak, spent = tracemalloc.get_traced_memory()[1], time.process_time() - begin
        tracemalloc.stop()
    assert spent < LONGEST, f"took {spent:.1f} s"
    assert peak < MULTIPLE * size + base, f"took {peak} bytes for a file of {size}"


def read_or_refused(
    module: ModuleType | None, path: Path, data: bytes, base: int = BASE
) -> Geometry | None:
    """What a file holds, if it is a valid geometry; None if it is refused as it must be."""
    path.write_bytes(data)
    with bounded(unpacked_size(data), base):
        try:
            found = module.read(path) if module else io.read(path)
        except FileError as error:
            message = str(error)
            assert message.startswith(f"{path}: ")
            assert len(message) > len(f"{path}: ") + 15
            assert len(message) < len(str(path)) + 600
            assert message.isprintable(), repr(message)
            return None
    assert np.isfinite(np.asarray(found.points)).all()
    return found


def unpacked_size(data: bytes) -> int:
    """An upper bound: nested packing is not unpacked, and 256 times is the most."""
    if data[:2] != b"\x1f\x8b":
        return len(data)
    try:
        return max(len(gzip.decompress(data)), len(data))
    except (OSError, EOFError, ValueError, gzip.zlib.error):
        return 256 * len(data)


@every_reader
@quick
@given(data=st.data())
def test_a_broken_file_is_refused_or_a_valid_geometry(folder, module, data):
    damaged = data.draw(broken(valid_files(module)))
    read_or_refused(module, folder / "a", damaged)
    read_or_refused(None, folder / f"a{module.SUFFIXES[0]}", damaged)


@pytest.mark.slow
@every_reader
@thorough
@given(data=st.data())
def test_ten_thousand_broken_files_are_refused_or_valid(folder, module, data):
    damaged = data.draw(broken(valid_files(module)))
    read_or_refused(module, folder / "a", damaged)
    read_or_refused(None, folder / f"a{module.SUFFIXES[0]}", damaged)


@every_reader
@quick
@given(data=st.data())
def test_a_file_cut_short_is_refused_or_says_the_same(folder, module, data):
    whole = data.draw(st.sampled_from(valid_files(module)))
    size = data.draw(st.integers(0, len(whole) - 1))
    path = folder / f"a.i{module.SUFFIXES[0]}"  # the name of a Cart3D file with components
    cut = read_or_refused(module, path, whole[:size])
    if cut is not None and not leaves_room(module, whole, size):
        path.write_bytes(whole)
        same(module.read(path), cut, EVERYTHING)


def leaves_room(module: ModuleType, whole: bytes, size: int) -> bool:
    """Whether a format cannot tell that a file is cut at this place; docs/formats.md says so."""
    if not text.is_text(whole):
        return False
    rest = whole[size:]
    return key(module) in OPEN_ENDED or not re.search(rb"\s\S", rest)


@every_reader
@quicker
@given(data=st.data())
def test_what_changes_nothing_essential_changes_no_bit(folder, module, data):
    whole = data.draw(st.sampled_from(valid_files(module)))
    changes = [gzip.compress]
    if text.is_text(whole):
        changes += [
            lambda file: file.replace(b"\n", b"\r\n"),
            lambda file: file.replace(b"\n", b"\r"),
            lambda file: file.replace(b"\n", b" \t\n"),
            lambda file: file + b"\n \n",
            lambda file: file.rstrip(b"\n"),
        ]
    changed = data.draw(st.sampled_from(changes))(whole)
    (folder / "a").write_bytes(whole)
    (folder / "b").write_bytes(changed)
    same(module.read(folder / "a"), module.read(folder / "b"), EVERYTHING)


@every_reader
@quicker
@given(data=st.data())
def test_what_is_written_reads_back_to_the_bit(folder, module, data):
    variant = data.draw(st.sampled_from(variants(module)))
    valid, _ = written(folder, module, variant, data.draw(st.integers(0, 2**32)))
    same(valid, io.read(folder / variant.file), variant.kept)


def same(one: Geometry, other: Geometry, kept: str) -> None:
    """Asserts that parts of two geometries are equal, every bit of each array."""
    assert type(one) is type(other)
    for name in kept.split():
        if name == "corners":
            one_part, other_part = one.points[one.faces], other.points[other.faces]
        elif hasattr(one, name):
            one_part, other_part = getattr(one, name), getattr(other, name)
        else:
            continue
        leaves, other_leaves = (jax.tree.leaves_with_path(p) for p in (one_part, other_part))
        assert [path for path, _ in leaves] == [path for path, _ in other_leaves], name
        for (_, leaf), (_, other_leaf) in zip(leaves, other_leaves, strict=True):
            assert same_bits(leaf, other_leaf), name


BIG = 2**18


def inflated(data: bytes) -> list[bytes]:
    """Big broken files: their middle, single lines and bytes many times over."""
    middle = data[len(data) // 3 : 2 * len(data) // 3]
    lines = [line + b"\n" for line in dict.fromkeys(data.split(b"\n")) if len(line) < 200][:6]
    pieces = [
        middle,
        *lines,
        b"\n",
        b"\n1",
        b"\n1 2",
        b" 1",
        b"f\n",
        b"f 1 2 3\n",
        b"A=\n",
        b"<a/>",
    ]
    half = data.rfind(b"\n", 0, len(data) // 2) + 1
    return [data[:half] + piece * (BIG // len(piece)) + data[half:] for piece in pieces]


@every_reader
def test_memory_stays_a_small_multiple_of_a_big_file(folder, module):
    by_beginning = {data[:64]: data for data in valid_files(module)}
    for data in list(by_beginning.values())[::3][:2]:
        for big in inflated(data):
            read_or_refused(module, folder / "a", big, base=2**21)


@every_reader
@quicker
@given(name=st.one_of(st.text(max_size=8), st.sampled_from(NAMES)))
@example(name="x")
def test_names_of_any_kind_do_not_break_a_file(folder, module, name):
    """They may change, as formats have rules of their own, but nothing else does."""
    valid = renamed(geometry(module.HOLDS, 3), name)
    path = folder / variants(module)[0].file
    try:
        module.write(path, valid)
    except (FileError, GeometryError) as error:
        assert "surrogates not allowed" in str(error) or "which there is already" in str(error)
        return
    found = module.read(path)
    for part in ("faces", "cells", "components", "markers", "shapes"):
        assert len(getattr(found, part, ())) == len(getattr(valid, part, ()))


def renamed(valid: Geometry, name: str) -> Geometry:
    """The same with another name of its first part."""
    if isinstance(valid, Surface):
        components = (name, *valid.components[1:])
        data = {name or "Cp": valid.point_data["Cp"]}
        return Surface(valid.points, valid.faces, valid.tags, components, data)
    if isinstance(valid, VolumeMesh):
        (_, first), *others = valid.markers.items()
        markers = {name: first, **dict(others)}
        return VolumeMesh(valid.points, valid.cells, markers, valid.dimension)
    return Section(valid.points, name) if isinstance(valid, Section) else valid
