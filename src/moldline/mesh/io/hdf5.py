"""HDF5: named arrays of numbers and of words, bit by bit, through h5py (an optional extra)."""

import importlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FileError
from . import text
from .files import EXPANSION, contents, replacing

MAGIC = b"\x89HDF\r\n\x1a\n"
_DAMAGES = (OSError, RuntimeError, ValueError, KeyError, TypeError, OverflowError, MemoryError)


def read_arrays(path: Path | str) -> dict[str, np.ndarray]:
    """All arrays in a file, by name."""
    h5py, data = _h5py(path), contents(path)
    try:
        with h5py.File(BytesIO(data), "r") as file:
            return {name: _array(h5py, file, name, len(data), path) for name in file}
    except FileError:
        raise
    except _DAMAGES as problem:
        reason = " ".join(str(problem).split())[:100]
        raise FileError(f"{path}: damaged HDF5 data ({reason}); copy the file again") from None


def write_arrays(path: Path | str, arrays: Mapping[str, np.ndarray]) -> None:
    """Write a file of named arrays."""
    h5py, memory = _h5py(path), BytesIO()
    for name in arrays:
        if "/" in name or not name.strip("."):
            raise FileError(
                f"{path}: HDF5 has no data named {text.quoted(name)}; rename it, or write .npz"
            )
    with h5py.File(memory, "w") as file:
        for name, array in arrays.items():
            has_words = array.dtype.kind == "U"
            file[name] = np.char.encode(array, "utf-8") if has_words else array
    with replacing(path) as stream:
        stream.write(memory.getbuffer())


def _h5py(path: Path | str) -> Any:
    try:
        return importlib.import_module("h5py")
    except ImportError:
        raise FileError(
            f"{path}: HDF5 needs h5py, which is not installed; pip install 'moldline[hdf5]'"
        ) from None


def _array(h5py: Any, file: Any, name: str, size: int, path: Path | str) -> np.ndarray:
    """One array, if it lies in the file itself and is not larger than the file can explain."""
    what = f"{path}: {text.quoted(name)}"
    if not isinstance(file.get(name, getlink=True), h5py.HardLink):
        raise FileError(f"{what} lies in another file; copy it into this one")
    data = file[name]
    if not isinstance(data, h5py.Dataset):
        raise FileError(f"{what} is a group, expected an array")
    if data.dtype.kind not in "fiuS" or data.shape is None:
        raise FileError(f"{what} holds {data.dtype}, expected numbers or words")
    if data.external or data.is_virtual:
        raise FileError(f"{what} lies in another file; copy it into this one")
    if data.nbytes > EXPANSION * size:
        raise FileError(
            f"{what} is of {data.nbytes} bytes in a file of {size}; was the copy cut short?"
        )
    array = np.asarray(data[()])
    if array.dtype.kind == "S":
        return np.array([text.decoded(word) for word in array.ravel().tolist()], str)
    return array.astype(array.dtype.newbyteorder("="))
