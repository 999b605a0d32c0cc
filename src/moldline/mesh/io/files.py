"""Whole files in and out: gzip seen through, old files kept until the new one is complete."""

import gzip
import os
import shutil
import stat
import threading
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, TypeAlias, cast

import numpy as np

from ...errors import FileError

HEAD = 65536
"""Bytes that telling the formats apart looks at."""

EXPANSION = 256
"""A gzip file that grows by more than this is no mesh but an attack or an accident."""


Bytes: TypeAlias = bytes | memoryview


def contents(path: Path | str) -> bytes:
    """All bytes of a file, unpacked if they are gzip's."""
    return bytes(loaded(path))


def loaded(path: Path | str) -> memoryview:
    """The same as memory that numbers are taken from: NumPy gets it sooner than Python does."""
    with _told(path, "read"):
        _check_ordinary(Path(path))
        packed = np.fromfile(path, np.uint8)
    if not len(packed):
        raise FileError(f"{path}: the file is empty; was writing it cut short?")
    if not _is_gzip(packed[:2].tobytes()):
        return packed.data
    return memoryview(_unpacked(packed.tobytes(), path, EXPANSION * len(packed)))


def head(path: Path | str) -> bytes:
    """The first bytes of a file, unpacked if they are gzip's."""
    with _told(path, "read"):
        _check_ordinary(Path(path))
        with Path(path).open("rb") as file:
            packed = file.read(HEAD)
    if not _is_gzip(packed):
        return packed
    try:
        return zlib.decompressobj(wbits=31).decompress(packed, HEAD)
    except zlib.error as problem:
        raise FileError(f"{path}: damaged gzip data ({problem}); copy the file again") from None


@contextmanager
def replacing(path: Path | str) -> Iterator[BinaryIO]:
    """A file to write to, which takes the place of `path` when all went well.

    It lies beside the target until then, so that a full disk or an error leaves the old file
    whole. A name that ends in `.gz` is packed; that one can do no more than write.
    """
    with _told(path, "write"):
        target = Path(os.path.realpath(path))  # a link stays a link
        own = f"{os.getpid()}-{threading.get_ident()}"  # others may write the same at this time
        beside = target.with_name(f".{target.name[:40]}.{own}.part")
        if target.exists():
            _check_ordinary(target)
        try:
            with beside.open("wb") as file:
                if target.suffix == ".gz":
                    packed = Packed(file)
                    yield cast(BinaryIO, packed)
                    packed.finish()
                else:
                    yield file
            if target.exists():
                shutil.copymode(target, beside)
            beside.replace(target)
        finally:
            beside.unlink(missing_ok=True)


class Packed:
    """A file in gzip's format, which holds nothing back that an error would let out later."""

    def __init__(self, file: BinaryIO):
        self._file = file
        self._packer = zlib.compressobj(6, wbits=31)

    def write(self, data: Bytes) -> int:
        """Pack some more."""
        self._file.write(self._packer.compress(data))
        return len(data)

    def writelines(self, lines: Iterable[Bytes]) -> None:
        """Pack one after the other."""
        for line in lines:
            self.write(line)

    def finish(self) -> None:
        """Write what is left, and the sum that readers check."""
        self._file.write(self._packer.flush())


def _check_ordinary(path: Path) -> None:
    """Refuse pipes and devices, which never end or would be replaced by a file."""
    kind = path.stat().st_mode
    if stat.S_ISDIR(kind):
        raise IsADirectoryError
    if not stat.S_ISREG(kind):
        raise OSError("is no ordinary file but a pipe or a device; name a file instead")


@contextmanager
def _told(path: Path | str, verb: str) -> Iterator[None]:
    """Turn the system's errors into ours."""
    if "\0" in str(path):
        raise FileError(f"{path}: no file can have a name with a NUL in it; check the name")
    try:
        yield
    except FileNotFoundError:
        what = "no such file; check the name" if verb == "read" else "no such folder; make it first"
        raise FileError(f"{path}: {what}") from None
    except IsADirectoryError:
        raise FileError(f"{path}: is a folder, expected a file; name a file in it") from None
    except PermissionError:
        raise FileError(
            f"{path}: no permission to {verb} it; change its owner or mode, and close it elsewhere"
        ) from None
    except (OSError, UnicodeEncodeError) as problem:  # such as half a character in a name
        kept = "" if verb == "read" else "; the old file, if any, is as it was"
        reason = getattr(problem, "strerror", None) or str(problem)
        raise FileError(f"{path}: cannot {verb} it: {reason.lower()}{kept}") from None


def _is_gzip(packed: bytes) -> bool:
    return packed[:2] == b"\x1f\x8b"


def _unpacked(packed: bytes, path: Path | str, limit: int) -> bytes:
    try:
        with gzip.GzipFile(fileobj=BytesIO(packed)) as file:
            text = file.read(limit + 1)
    except (OSError, EOFError, zlib.error) as problem:
        raise FileError(f"{path}: damaged gzip data ({problem}); copy the file again") from None
    if len(text) > limit:
        raise FileError(
            f"{path}: unpacks to more than {EXPANSION} times its {len(packed)} bytes; "
            "unpack it by hand if that is right"
        )
    return text
