"""NumPy's `.npz`: named arrays of numbers and of words, bit by bit.

Nothing in a file is ever run: what NumPy would unpickle is refused.
"""

import math
import re
import struct
import zipfile
import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from ...errors import FileError
from . import text
from .files import EXPANSION, contents, replacing

MAGIC = b"PK"
_PLAIN = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_DAMAGES = (
    *(zipfile.BadZipFile, zlib.error, struct.error),
    *(EOFError, OSError, ValueError, RuntimeError, OverflowError),
)
_HEADER = re.compile(
    rb"\{'descr': '([<>|=](?:f[248]|[iu][1248]|U\d{1,6}))', 'fortran_order': (True|False), "
    rb"'shape': \(([\d, ]{0,99})\), *\}\s*"
)


def read_arrays(path: Path | str) -> dict[str, np.ndarray]:
    """All arrays in a file, by name."""
    data = contents(path)
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            _check(archive, EXPANSION * len(data), path)
            return {
                info.filename.removesuffix(".npy"): _array(archive.read(info), info.filename, path)
                for info in archive.infolist()
            }
    except FileError:
        raise
    except _DAMAGES as problem:
        raise FileError(f"{path}: damaged NPZ ({problem}); copy the file again") from None


def write_arrays(path: Path | str, arrays: Mapping[str, np.ndarray]) -> None:
    """Write a file of named arrays, without packing them."""
    with replacing(path) as stream, zipfile.ZipFile(stream, "w") as archive:
        for name, array in arrays.items():
            info = zipfile.ZipInfo(f"{name}.npy")  # of a fixed date: same arrays, same file
            with archive.open(info, "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


def _check(archive: zipfile.ZipFile, limit: int, path: Path | str) -> None:
    """Refuse what would unpack without bounds."""
    members = archive.infolist()
    if sum(info.file_size for info in members) > limit:
        raise FileError(
            f"{path}: unpacks to more than {EXPANSION} times its size; unpack it by hand if that "
            "is right"
        )
    for info in members:
        if info.compress_type not in _PLAIN:
            raise FileError(
                f"{path}: {text.quoted(info.filename)} is packed in a way that NumPy does not use; "
                "write it with numpy.savez"
            )


def _array(data: bytes, name: str, path: Path | str) -> np.ndarray:
    begin = 8 + (2 if data[6:7] == b"\1" else 4)
    end = begin + int.from_bytes(data[8:begin], "little")
    header = _HEADER.fullmatch(data[begin:end])
    if data[:6] != b"\x93NUMPY" or header is None:
        found = text.quoted(data[begin : min(end, begin + 99)])
        raise FileError(
            f"{path}: {text.quoted(name)} begins with {found}, expected an array of numbers or "
            "words"
        )
    dtype, shape = np.dtype(header[1].decode()), tuple(map(int, re.findall(rb"\d+", header[3])))
    if len(data) - end != math.prod(shape) * dtype.itemsize or not dtype.itemsize:
        raise FileError(
            f"{path}: {text.quoted(name)} needs {math.prod(shape) * dtype.itemsize} bytes, the "
            f"file has {len(data) - end}; was the copy cut short?"
        )
    array = np.frombuffer(data, dtype, offset=end)
    if dtype.kind == "U":
        array = np.array(array.tolist(), str)  # refuses what is no letter
    array = array.reshape(shape, order="F" if header[2] == b"True" else "C")
    return array.astype(array.dtype.newbyteorder("="))
