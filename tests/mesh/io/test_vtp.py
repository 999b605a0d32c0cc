"""VTP, and the ways in which VTK's XML holds arrays."""

import base64
import zlib

import numpy as np
import pytest
from conftest import same_bits

from moldline.errors import FileError
from moldline.mesh.io import vtp
from moldline.mesh.surface import Surface

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]])
ARRAYS = {"Points": POINTS, "connectivity": np.array([0, 1, 2, 3]), "offsets": np.array([4])}


class Writer:
    """Writes one quadrangle in each of the encodings, as other programs do."""

    def __init__(self, encoding="ascii", compress=False, order="<", wide=False, real="f8"):
        self.encoding, self.compress, self.order = encoding, compress, order
        self.size, self.real, self.appended = ("u8" if wide else "u4"), real, b""
        self.wide = wide

    def array(self, name):
        array, kind = ARRAYS[name], self.real if name == "Points" else "i4"
        vtk = {"f4": "Float32", "f8": "Float64", "i4": "Int32"}[kind]
        components = array.shape[1] if array.ndim > 1 else 1
        start = f'<DataArray type="{vtk}" Name="{name}" NumberOfComponents="{components}"'
        if self.encoding == "ascii":
            return f'{start} format="ascii">{" ".join(map(str, array.ravel()))}</DataArray>'
        data = array.astype(self.order + kind).tobytes()
        if self.encoding == "binary":
            return f'{start} format="binary">\n {self.text(data)}\n</DataArray>'
        offset = len(self.appended)
        raw = self.encoding == "raw"
        self.appended += b"".join(self.parts(data)) if raw else self.text(data).encode()
        return f'{start} format="appended" offset="{offset}"/>'

    def text(self, data):
        """Compressed data have their sizes encoded apart."""
        head, body = self.parts(data)
        pieces = [head, body] if self.compress else [head + body]
        return "".join(base64.b64encode(piece).decode() for piece in pieces)

    def parts(self, data):
        if not self.compress:
            return self.sizes(len(data)), data
        whole = 32  # bytes in a block
        blocks = [data[k : k + whole] for k in range(0, len(data), whole)]
        packed = [zlib.compress(block) for block in blocks]
        sizes = self.sizes(len(blocks), whole, len(data) % whole, *map(len, packed))
        return sizes, b"".join(packed)

    def sizes(self, *values):
        return np.array(values, self.order + self.size).tobytes()

    def file(self):
        order = "LittleEndian" if self.order == "<" else "BigEndian"
        zipped = ' compressor="vtkZLibDataCompressor"' if self.compress else ""
        body = (
            f'<VTKFile type="PolyData" version="1.0" byte_order="{order}" '
            f'header_type="{"UInt64" if self.wide else "UInt32"}"{zipped}><PolyData>\n'
            f'<Piece NumberOfPoints="4" NumberOfPolys="1"><Points>{self.array("Points")}</Points>\n'
            f"<Polys>{self.array('connectivity')}\n{self.array('offsets')}</Polys></Piece>"
            "</PolyData>"
        ).encode()
        if self.encoding in ("raw", "base64"):
            body += f'<AppendedData encoding="{self.encoding}">\n _'.encode() + self.appended
            body += b"\n</AppendedData>"
        return body + b"</VTKFile>\n"


def read(tmp_path, content):
    path = tmp_path / "wing.vtp"
    path.write_bytes(content)
    return vtp.read(path)


def test_what_is_written_reads_back_to_the_bit(tmp_path, surface):
    rng = np.random.default_rng(4)
    point_data = {
        "Cp": rng.standard_normal(30),
        "a <b> & 'c' \"d\"": rng.standard_normal((30, 3)).astype(np.float32),
        "nan": np.full(30, np.nan),
    }
    face_data = {"k": np.arange(30) + 2**60, "small": np.arange(30, dtype=np.uint8)}
    names = ("a b", "ü", "7")
    mine = Surface(surface.points, surface.faces, surface.tags, names, point_data, face_data)
    vtp.write(tmp_path / "a.vtp", mine)
    read = vtp.read(tmp_path / "a.vtp")
    assert same_bits(read.points, mine.points)
    assert same_bits(read.faces, mine.faces)
    assert same_bits(read.tags, mine.tags)
    assert read.components == names
    assert read.point_data.keys() == point_data.keys()
    assert all(same_bits(read.point_data[name], array) for name, array in point_data.items())
    assert all(same_bits(read.face_data[name], array) for name, array in face_data.items())


@pytest.mark.parametrize("encoding", ["ascii", "binary", "base64", "raw"])
@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("real", ["f4", "f8"])
def test_every_encoding_is_read(tmp_path, encoding, compress, order, wide, real):
    surface = read(tmp_path, Writer(encoding, compress, order, wide, real).file())
    assert same_bits(surface.points, POINTS)
    assert surface.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_pieces_are_joined_and_data_follow_their_polygons(tmp_path):
    piece = Writer().file()
    piece = piece[piece.index(b"<Piece") : piece.index(b"</PolyData>")]
    data = b'<CellData><DataArray type="Int8" Name="%s">%d</DataArray></CellData></Piece>'
    pieces = [piece.replace(b"</Piece>", data % (b"component", number)) for number in (5, 3)]
    surface = read(tmp_path, b"<VTKFile><PolyData>" + b"".join(pieces) + b"</PolyData></VTKFile>")
    assert surface.faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    assert surface.components == ("3", "5")
    assert surface.tags.tolist() == [1, 1, 0, 0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"<VTKFile", b'<!DOCTYPE a [<!ENTITY b "c">]><VTKFile', "line 1: found a document type"),
        (b"<PolyData>", b"<PolyData>" * 99, "more than 32 elements within each other"),
        (b"</Points>", b"", "mismatched tag, expected XML; was the copy cut short"),
        (b"PolyData", b"ImageData", "holds 'ImageData', expected 'PolyData'"),
        (b"VTKFile", b"GPXFile", "the first element is 'GPXFile', expected 'VTKFile'"),
        (b"<Piece", b"<Peace", "has no Piece"),
        (b"0 1 2 3", b"0 1 2 4", "'connectivity', entry 4, refers to 4, expected .* 0 to 3"),
        (b"0 1 2 3", b"0 1 2 x", "line 3: found 'x', expected a number"),
        (b">4<", b">5<", "'offsets': offsets must rise by 3 or more, up to the 4 entries"),
        (b">4<", b">2<", "'offsets': offsets must rise"),
        (b'Points="4"', b'Points="5"', "'Points': 12 numbers, expected 5 times 3; was the copy"),
        (b'Points="4"', b'Points="-1"', "NumberOfPoints='-1' is no whole number of at least 0"),
        (b'Points="4"', b'Points="999999999999"', "12 numbers, expected 999999999999 times 3"),
        (b"0.5", b"nan", "needs 4 points of three finite coordinates"),
        (b"Float64", b"Float65", "type 'Float65', expected one of Int8"),
        (
            b'format="ascii"',
            b'format="morse"',
            "format 'morse', expected ascii, binary or appended",
        ),
        (b"connectivity", b"disconnected", "Polys need the arrays connectivity and offsets"),
        (b"UInt32", b"UInt31", "header_type 'UInt31', expected UInt32 or UInt64"),
        (b"header_type", b'compressor="vtkLZ4DataCompressor" header_type', "write the file again"),
        (b'Polys="1"', b'Polys="1" NumberOfStrips="1"', "has triangle strips, expected polygons"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, old, new, message):
    whole = Writer().file()
    assert old in whole
    replaced = whole.replace(old, new) if old in (b"PolyData", b"VTKFile", b"<Piece") else None
    if old == b"<Piece":
        replaced = replaced.replace(b"</Piece", b"</Peace")
    with pytest.raises(FileError, match=message):
        read(tmp_path, replaced or whole.replace(old, new, 1))


@pytest.mark.parametrize("encoding", ["ascii", "binary", "base64", "raw"])
@pytest.mark.parametrize("compress", [False, True])
def test_a_file_cut_short_anywhere_is_refused(tmp_path, encoding, compress):
    whole = Writer(encoding, compress).file().rstrip()
    for size in range(len(whole)):
        with pytest.raises(FileError):
            read(tmp_path, whole[:size])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"AAAA", b"A?AA", "'Points': damaged base64 data"),
        (b"AAAA", b"", "'Points': "),
    ],
)
@pytest.mark.parametrize("compress", [False, True])
def test_damaged_base64_is_named(tmp_path, old, new, message, compress):
    whole = Writer("binary", compress).file()
    with pytest.raises(FileError, match=message):
        read(tmp_path, whole.replace(old, new, 1))


def test_damaged_blocks_and_sizes_are_named(tmp_path):
    whole = Writer("raw", compress=True).file()
    begin = whole.index(b"_", whole.index(b"<AppendedData")) + 1
    for at, value, message in [
        (0, b"\xff\xff\xff\xff", "the data need 17179869192 bytes"),
        (4, b"\xff\xff\xff\xff", "the data need 4294967295 bytes, the file has 32"),
        (24, b"????", "block 1 is damaged"),
    ]:
        broken = whole[: begin + at] + value + whole[begin + at + 4 :]
        with pytest.raises(FileError, match=message):
            read(tmp_path, broken)


def test_data_that_are_no_numbers_are_refused(tmp_path):
    words = Surface(np.eye(3), np.array([[0, 1, 2]]), point_data={"w": np.array(["a", "b", "c"])})
    with pytest.raises(FileError, match="data 'w' of type <U1 cannot be written"):
        vtp.write(tmp_path / "a.vtp", words)
    assert not list(tmp_path.iterdir())


def test_data_without_any_number_are_refused(tmp_path):
    nothing = Surface(np.eye(3), np.array([[0, 1, 2]]), point_data={"w": np.empty((3, 0))})
    with pytest.raises(FileError, match="data 'w' with no number per point or face cannot be"):
        vtp.write(tmp_path / "a.vtp", nothing)


def test_pieces_whose_data_differ_and_offsets_that_are_no_numbers_are_refused(tmp_path):
    piece = Writer().file()
    piece = piece[piece.index(b"<Piece") : piece.index(b"</PolyData>")]
    data = b'<PointData><DataArray type="Int8" Name="n" NumberOfComponents="%d">%s</DataArray>'
    ends = b"</PointData></Piece>"
    pieces = [piece.replace(b"</Piece>", data % (size, b" 1" * 4 * size) + ends) for size in (1, 2)]
    with pytest.raises(FileError, match="the pieces' data 'n' differ in NumberOfComponents"):
        read(tmp_path, b"<VTKFile><PolyData>" + b"".join(pieces) + b"</PolyData></VTKFile>")
    whole = Writer().file().replace(b'"Int32" Name="offsets"', b'"Float64" Name="offsets"')
    for value in (b"nan", b"inf", b"4.5", b"1e300"):
        with pytest.raises(FileError, match="'offsets': offsets must rise by 3 or more"):
            read(tmp_path, whole.replace(b">4<", b">" + value + b"<"))
