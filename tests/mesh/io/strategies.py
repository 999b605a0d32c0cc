"""Random valid geometries, the files that hold them, and what damages a file."""

import gzip
import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType, ModuleType
from typing import Any, NamedTuple

import numpy as np
from conftest import HARD
from hypothesis import strategies as st
from test_ply import RAGGED, SQUARE, TRIANGLES
from test_ugrid import STREAM, TWO_PRISMS
from test_vtp import Writer

from moldline.mesh import Geometry
from moldline.mesh.grid import Grid
from moldline.mesh.io import FORMATS
from moldline.mesh.section import Section
from moldline.mesh.surface import Surface
from moldline.mesh.volume import NODES_PER_CELL, Cells, VolumeMesh


class Variant(NamedTuple):
    """A way in which a format's writer can be called."""

    file: str
    options: Mapping[str, Any] = MappingProxyType({})
    kept: str = "points faces tags components"
    """What of the geometry reads back to the last bit."""
    precision: int = 8
    """Bytes of a coordinate."""


def _binary(file: str, kept: str) -> list[Variant]:
    return [
        Variant(
            file, {"binary": order, "records": records, "precision": precision}, kept, precision
        )
        for order in ("little", "big")
        for records in (False, True)
        for precision in (4, 8)
    ]


SURFACE = "points faces tags components"
VOLUME = "points cells markers dimension"

VARIANTS: dict[str, list[Variant]] = {
    "tri": [
        Variant("a.i.tri"),
        Variant("a.triq", {}, f"{SURFACE} point_data"),
        *_binary("a.i.tri", SURFACE),
        *_binary("a.triq", f"{SURFACE} point_data")[1::2],
    ],
    "stl": [
        Variant("a.stl", {}, "corners tags components"),
        Variant("a.stl", {"binary": True}, "corners", 4),
    ],
    "obj": [Variant("a.obj")],
    "vtp": [Variant("a.vtp", {}, f"{SURFACE} point_data face_data")],
    "vtu": [Variant("a.vtu", {}, VOLUME)],
    "trix": [Variant("a.trix", {}, f"{SURFACE} point_data face_data")],
    "plot3d": [Variant("a.xyz", {}, "points shapes"), *_binary("a.xyz", "points shapes")],
    "su2": [Variant("a.su2", {}, f"{VOLUME} extra")],
    "dat": [
        Variant("a.dat", {}, "points name"),
        Variant("a.dat", {"lednicer": True}, "points name"),
    ],
    "ply": [
        Variant("a.ply", {}, f"{SURFACE} point_data"),
        Variant("a.ply", {"binary": False}, f"{SURFACE} point_data"),
    ],
    "ugrid": [
        Variant("a.ugrid", {}, "points dimension"),
        *(Variant(f"a.{k}8.ugrid", {}, "points dimension") for k in ("b", "lb", "r", "lr")),
        *(Variant(f"a.{k}4.ugrid", {}, "points dimension", 4) for k in ("b", "lb", "r", "lr")),
    ],
    "glb": [Variant("a.glb", {}, "", 4)],
}
"""How each format is written; one that is not named here is written once, and keeps its points."""

FOREIGN: dict[str, list[bytes]] = {
    "ply": [SQUARE.encode(), RAGGED, TRIANGLES],
    "ugrid": [TWO_PRISMS.encode(), STREAM],
    "vtp": [
        Writer("ascii").file(),
        Writer("binary", compress=True, order=">", wide=True).file(),
        Writer("raw").file(),
        Writer("raw", compress=True).file(),
        Writer("base64", real="f4").file(),
    ],
}
"""Valid files of other programs, in encodings that ours does not write."""

READABLE = [module for module in FORMATS if hasattr(module, "read")]
"""A format that is only written has nothing to fuzz."""


def key(module: ModuleType) -> str:
    """A format's short name."""
    return module.__name__.rpartition(".")[2]


def variants(module: ModuleType) -> list[Variant]:
    """Those of a format."""
    return VARIANTS.get(key(module)) or [Variant("a" + module.SUFFIXES[0], {}, "points")]


def geometry(kind: type[Geometry], seed: int, precision: int = 8) -> Geometry:
    """A valid geometry of a kind, with coordinates that a float of so many bytes can hold."""
    rng = np.random.default_rng(seed)
    return _MAKERS[kind](rng, precision)


@cache
def valid_files(module: ModuleType) -> list[bytes]:
    """Files in each of a format's variants, and other programs' ones."""
    with TemporaryDirectory() as folder:
        return [
            written(Path(folder), module, variant, seed)[1]
            for seed in range(6)
            for variant in variants(module)
        ] + FOREIGN.get(key(module), [])


def written(
    folder: Path, module: ModuleType, variant: Variant, seed: int
) -> tuple[Geometry, bytes]:
    """A random geometry, and its file."""
    valid = geometry(module.HOLDS, seed, variant.precision)
    while key(module) == "ugrid" and valid.dimension == 2:  # it holds solid cells only
        valid = geometry(module.HOLDS, seed := seed + 1, variant.precision)
    module.write(folder / variant.file, valid, **variant.options)
    return valid, (folder / variant.file).read_bytes()


def _coordinates(rng: np.random.Generator, count: int, precision: int) -> np.ndarray:
    most = 3 if precision == 4 else 30  # PLOT3D's points need some order in 4-byte floats
    points = rng.standard_normal((count, 3)) * 10.0 ** rng.integers(-most, most, (count, 3))
    if precision == 4:
        return points.astype("f4").astype(float)
    hard = rng.random(points.shape) < 0.2
    points[hard] = rng.choice(HARD, hard.sum())
    return points


def _surface(rng: np.random.Generator, precision: int) -> Surface:
    """Every point has a face, every component too; faces are in the components' order."""
    parts, count = int(rng.integers(1, 4)), 3 * int(rng.integers(4, 12))
    more = rng.integers(0, count, (int(rng.integers(0, 9)), 3))
    faces = np.concatenate([np.arange(count).reshape(-1, 3), more])
    tags = np.sort(np.concatenate([np.arange(parts), rng.integers(0, parts, len(faces) - parts)]))
    scalars = _coordinates(rng, count, precision).T
    return Surface(
        _coordinates(rng, count, precision),
        faces,
        tags,
        tuple(map(str, np.sort(rng.choice(99, parts, replace=False)).tolist())),
        {"Cp": scalars[0].copy(), "q2": scalars[1].copy()},
        {"area": rng.random(len(faces)), "kind": rng.integers(-9, 9, len(faces))},
    )


def _grid(rng: np.random.Generator, precision: int) -> Grid:
    shapes = rng.integers(1, 5, (int(rng.integers(1, 4)), 3))
    shapes[:, 0] += 1
    return Grid(
        _coordinates(rng, int(shapes.prod(1).sum()), precision), tuple(map(tuple, shapes.tolist()))
    )


def _section(rng: np.random.Generator, precision: int) -> Section:
    points = _coordinates(rng, int(rng.integers(4, 30)), precision) * [1, 1, 0]
    points[:, 2] = 0.0
    points[0] = [0.25, -0.0, 0]  # cannot pass for the counts of Lednicer's order
    points[len(points) // 2, 0] = -1.7e308  # the nose
    return Section(points, str(rng.choice(["NACA 0012", "ü 12 %", "RAE-2822 a=0.5"])))


def _volume(rng: np.random.Generator, precision: int) -> VolumeMesh:
    dimension, count = int(rng.integers(2, 4)), int(rng.integers(8, 30))
    points = _coordinates(rng, count, precision)
    points[:, dimension:] = 0.0
    kinds, sides = ([5, 9], [3]) if dimension == 2 else ([10, 12, 13, 14], [5, 9])
    names = ("wall", "far field", "ü")[: int(rng.integers(1, 4))]
    markers = {name: _cells(rng, sides, count) for name in names}
    return VolumeMesh(points, _cells(rng, kinds, count), markers, dimension, "FFD_NBOX= 0\n")


def _cells(rng: np.random.Generator, kinds: list[int], count: int) -> Cells:
    types = np.sort(rng.choice(kinds, int(rng.integers(1, 20)))).astype(np.int32)
    sizes = [NODES_PER_CELL[kind] for kind in types.tolist()]
    nodes = np.concatenate([rng.choice(count, size, replace=False) for size in sizes])
    return Cells(types, np.concatenate([[0], np.cumsum(sizes)]), nodes.astype(np.int32))


_MAKERS: dict[type[Geometry], Callable[[np.random.Generator, int], Geometry]] = {
    Surface: _surface,
    Grid: _grid,
    Section: _section,
    VolumeMesh: _volume,
}

# ---- damage -------------------------------------------------------------------------------------

TOKEN = re.compile(rb"[^\s<>=\"']+")

WORDS = [
    *(b"nan", b"-inf", b"1e999", b"-1", b"0", b"1,5", b"1.0D+00", b"1.5.5", b"1_0", b"0x10", b"+"),
    *(b"99999999999", b"2147483647", b"4294967295", b"9" * 400, b"1" * 5000, b"-1e308", b"2*0"),
    *(b"999999*1.0", b"99999999999*1", b"16000000*0", b"\xff\xfe", b"\0", b"\xd9\xa3", b"1e-400"),
    *(b"\x1b[2J", b"\xc2\x9b1m", b"%s%n", b"''", b"&lol;", b"]]>", b"\xe2\x80\xae", b"x" * 3000),
]

PATTERNS = [
    *(np.array(number, "<i4").tobytes() for number in (0, 1, -1, 2**31 - 1, -(2**31), 2**24, 300)),
    *(np.array(number, ">i4").tobytes() for number in (1, -1, 2**31 - 1, 2**24, 300)),
    *(np.array(number, "<i8").tobytes() for number in (-1, 2**63 - 1, 2**40)),
    *(
        np.array(x, f"{order}f{size}").tobytes()
        for x in (np.nan, np.inf, -1e30)
        for order in "<>"
        for size in (4, 8)
    ),
]

XML = [
    b'<!DOCTYPE a [<!ENTITY lol "lol"><!ENTITY lolz "&lol;&lol;&lol;&lol;">]>',
    b'<!DOCTYPE a SYSTEM "file:///etc/passwd">',
    b"<a>" * 5000,
    b"<a" + b' b="' + b"x" * 20000 + b'"/>',
    b"<!-- " + b"-" * 500,
    b"<![CDATA[",
    b"<?xml version='1.0' encoding='utf-16'?>",
    b"</Piece>",
    b'<Piece NumberOfPoints="99999999999999">',
]


def _place(draw: st.DrawFn, data: bytes) -> int:
    return draw(st.integers(0, len(data)))


def _cut(draw: st.DrawFn, data: bytes) -> bytes:
    return data[: _place(draw, data)]


def _flip(draw: st.DrawFn, data: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(draw(st.integers(1, 4)) if data else 0):
        changed[draw(st.integers(0, len(data) - 1))] ^= draw(st.integers(1, 255))
    return bytes(changed)


def _splice(draw: st.DrawFn, data: bytes) -> bytes:
    """Delete, repeat or move a span, or put something in its place."""
    begin, end = sorted((_place(draw, data), _place(draw, data)))
    new = draw(st.sampled_from([b"", data[begin:end] * 2, data[: end - begin], b"\0", b"\n", b" "]))
    return data[:begin] + new + data[end:]


def _word(draw: st.DrawFn, data: bytes) -> bytes:
    """Another word in the place of one, more often near the beginning, where counts stand."""
    found = list(TOKEN.finditer(data))
    if not found:
        return data
    at = draw(st.one_of(st.integers(0, min(8, len(found) - 1)), st.integers(0, len(found) - 1)))
    word = draw(st.one_of(st.sampled_from(WORDS), st.integers(-9, 99).map(lambda k: b"%d" % k)))
    return data[: found[at].start()] + word + data[found[at].end() :]


def _pattern(draw: st.DrawFn, data: bytes) -> bytes:
    """Other bytes in the place of a binary number."""
    pattern = draw(st.sampled_from(PATTERNS))
    at = draw(st.one_of(st.integers(0, 24), st.integers(0, max(len(data) // 4, 1)))) * 4
    return data[:at] + pattern + data[at + len(pattern) :]


def _swapped(draw: st.DrawFn, data: bytes) -> bytes:
    size = draw(st.sampled_from([2, 4, 8]))
    end = len(data) // size * size
    return np.frombuffer(data[:end], f"u{size}").byteswap().tobytes() + data[end:]


def _lines(draw: st.DrawFn, data: bytes) -> bytes:
    """Line ends of several systems in one file."""
    ends = [b"\n", b"\r\n", b"\r", b"\n\n", b"\x0c", b"\xe2\x80\xa8"]
    lines = data.split(b"\n")
    period = draw(st.lists(st.sampled_from(ends), min_size=1, max_size=3))
    return b"".join(line + period[k % len(period)] for k, line in enumerate(lines))


def _prefix(draw: st.DrawFn, data: bytes) -> bytes:
    return (
        draw(st.sampled_from([b"\xef\xbb\xbf", b"\xff\xfe", b"\0", b"\n\n", b"# x\n", b" "])) + data
    )


def _xml(draw: st.DrawFn, data: bytes) -> bytes:
    """XML's own attacks, between two elements."""
    found = [match.start() for match in re.finditer(b"<", data)] or [0]
    at = draw(st.sampled_from(found))
    return data[:at] + draw(st.sampled_from(XML)) + data[at:]


def _packed(draw: st.DrawFn, data: bytes) -> bytes:
    return gzip.compress(data, 1, mtime=0)


def _rubbish(draw: st.DrawFn, data: bytes) -> bytes:
    """Random bytes after a valid beginning."""
    begin = draw(st.one_of(st.integers(0, 100), st.just(0), st.just(84)))
    return data[:begin] + draw(st.binary(max_size=200))


DAMAGES = [_cut, _flip, _splice, _word, _word, _word, _pattern, _pattern, _swapped, _lines, _prefix]
DAMAGES += [_xml, _packed, _rubbish]


@st.composite
def broken(draw: st.DrawFn, files: list[bytes]) -> bytes:
    """One of these files, damaged in one to three ways."""
    data = draw(st.sampled_from(files))
    for _ in range(draw(st.integers(1, 3))):
        data = draw(st.sampled_from(DAMAGES))(draw, data)
    return data
