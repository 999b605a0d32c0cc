"""Whole files in and out: gzip seen through, old files kept until the new one is complete."""

import gzip
import os
import shutil
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from ...errors import FileError

HEAD = 65536
"""Bytes that telling the formats apart looks at."""

EXPANSION = 256
"""A gzip file that grows by more than this is no mesh but an attack or an accident."""


def contents(path: Path | str) -> bytes:
    """All bytes of a file, unpacked if they are gzip's."""
    with _told(path, "read"):
        packed = Path(path).read_bytes()
    if not packed:
        raise FileError(f"{path}: the file is empty; was writing it cut short?")
    return _unpacked(packed, path, EXPANSION * len(packed)) if _is_gzip(packed) else packed


def head(path: Path | str) -> bytes:
    """The first bytes of a file, unpacked if they are gzip's."""
    with _told(path, "read"), Path(path).open("rb") as file:
        packed = file.read(HEAD)
    if not _is_gzip(packed):
        return packed
    try:
        return zlib.decompressobj(wbits=31).decompress(packed, HEAD)
    except zlib.error as problem:
        raise FileError(f"{path}: damaged gzip data ({problem}); copy the file again") from None


@contextmanager
def replacing(path: Path | str) -> Iterator[BinaryIO | gzip.GzipFile]:
    """A file to write to, which takes the place of `path` when all went well.

    It lies beside the target until then, so that a full disk or an error leaves the old file
    whole. A name that ends in `.gz` is packed.
    """
    target = Path(os.path.realpath(path))  # a link stays a link
    beside = target.with_name(f".{target.name}.{os.getpid()}.part")
    with _told(path, "write"):
        if target.is_dir():
            raise IsADirectoryError
        try:
            with beside.open("wb") as file:
                if target.suffix == ".gz":
                    with gzip.GzipFile("", "wb", 6, file, mtime=0) as packed:
                        yield packed
                else:
                    yield file
            if target.exists():
                shutil.copymode(target, beside)
            beside.replace(target)
        finally:
            beside.unlink(missing_ok=True)


@contextmanager
def _told(path: Path | str, verb: str) -> Iterator[None]:
    """Turn the system's errors into ours."""
    try:
        yield
    except FileNotFoundError:
        what = "no such file; check the name" if verb == "read" else "no such folder; make it first"
        raise FileError(f"{path}: {what}") from None
    except IsADirectoryError:
        raise FileError(f"{path}: is a folder, expected a file; name a file in it") from None
    except PermissionError:
        raise FileError(f"{path}: no permission to {verb} it; change its owner or mode") from None
    except OSError as problem:
        kept = "" if verb == "read" else "; the old file, if any, is as it was"
        reason = problem.strerror or str(problem)
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
