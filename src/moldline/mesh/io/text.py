"""Numbers in text: fast where all is well, exact about the place where it is not."""

import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._types import Array
from ...errors import FileError
from .files import EXPANSION, HEAD, Bytes

LARGEST = 2**18
"""Numbers that repeat counts may stand for in a file that is itself shorter than this."""

NUMBER = re.compile(
    rb"(?:(?P<repeat>\d+)\*)?"
    rb"(?P<mantissa>[+-]?(?:\d+(?:\.\d*)?|\.\d+))(?:[eEdD]?(?P<power>(?<=[eEdD])\d+|[+-]\d+))?"
)
"""What Fortran, C and Python write: `1.5e-3`, `1.5D-3`, `1.5-300` and `3*0.0`."""

_TOKEN = re.compile(rb"[^ \t\n\r\v\f]+")
_GAP = re.compile(rb"[ \t\n\r\v\f]")
_SPACE = np.zeros(256, bool)
_SPACE[list(b" \t\n\r\v\f")] = True
_D_TO_E = bytes.maketrans(b"dD", b"eE")


class Rows(NamedTuple):
    """Numbers line by line; lines without any are left out."""

    values: np.ndarray
    starts: np.ndarray
    """Where each row begins in `values`, and the end of the last."""
    lines: np.ndarray
    """The line each row stands on, counted from 1."""


def numbers(text: bytes, path: Path | str, line: int = 1, finite: bool = True) -> np.ndarray:
    """All numbers of a text that holds nothing else, whatever its line breaks.

    `line` is the file's line at which the text begins, for the error message.
    """
    values = _fast(text, finite)
    return _in_parts(text, path, line, finite) if values is None else values


def rows(text: bytes, path: Path | str, line: int = 1) -> Rows:
    """The numbers of a text whose lines matter; lines end in `\\n` (see `unix`)."""
    letters = np.frombuffer(text, np.uint8)
    begins = _begins(letters)
    row_of = np.searchsorted(np.flatnonzero(letters == ord("\n")), begins)
    values = numbers(text, path, line)
    if len(values) != len(begins):
        raise FileError(f"{path}: line {line} or later holds repeat counts, expected plain numbers")
    starts = np.flatnonzero(np.diff(row_of, prepend=-1))
    return Rows(values, np.append(starts, len(values)), row_of[starts] + line)


def indices(
    values: np.ndarray, count: int, path: Path | str, place: Callable[[int], str], base: int = 1
) -> np.ndarray:
    """Numbers that refer to one of `count` things, made to count from 0.

    `place` says where a row of `values` stands, for the error message.
    """
    is_whole = values.dtype.kind in "iu" and len(values) > 0
    if is_whole and base <= values.min() and values.max() < count + base:
        return np.subtract(values, base, dtype=np.int32, casting="unsafe")
    good = (values >= base) & (values < count + base) & (values == np.floor(values))
    if not good.all():
        found = np.argwhere(~good)[0]
        raise FileError(
            f"{path}: {place(int(found[0]))} refers to {values[tuple(found)]:.15g}, expected a "
            f"whole number from {base} to {count + base - 1}"
        )
    return np.asarray(values - base, np.int32)


def count_of(value: float, path: Path | str, what: str, least: int = 1) -> int:
    """A number that counts something."""
    if not (least <= value <= 2**31 - 1 and value == int(value)):
        raise FileError(
            f"{path}: found {value:.15g} as the number of {what}, expected a whole number "
            f"of at least {least}"
        )
    return int(value)


def written(array: Array) -> Iterator[bytes]:
    """Lines of text, one per row; floating-point numbers read back to the same bits."""
    array = np.asarray(array)
    row = " ".join(["%d" if array.dtype.kind in "iu" else "%r"] * array.shape[1]) + "\n"
    for start in range(0, len(array), 4096):
        part = array[start : start + 4096]
        yield (row * len(part) % tuple(part.ravel().tolist())).encode()


def unix(text: bytes) -> bytes:
    """The text with every line ended by `\\n`, whichever system it comes from."""
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in text else text


def title(name: str) -> bytes:
    """A name as it can end a line: white space becomes one blank, what cannot be seen a `?`."""
    return "".join(c if c.isprintable() else "?" for c in " ".join(name.split())).encode()


def decoded(name: bytes) -> str:
    """A name in UTF-8, or else in Latin-1, which every byte is part of."""
    try:
        return name.decode()
    except UnicodeDecodeError:
        return name.decode("latin-1")


def quoted(found: bytes | str) -> str:
    """A piece of a file for a message: not too long, and nothing that a terminal would obey."""
    word = decoded(found) if isinstance(found, bytes) else found
    return repr(word if len(word) <= 60 else word[:57] + "...")


def is_text(head: Bytes) -> bool:
    """Whether the bytes hold no control characters but white space."""
    return re.search(rb"[\x00-\x08\x0e-\x1f]", head) is None


def binary_head(data: np.ndarray, path: Path | str) -> bytes:
    """The first bytes of a file, which must not be text."""
    head: bytes = data[:HEAD].tobytes()
    if is_text(head[:4096]):
        raise FileError(f"{path}: only binary files can be streamed, this is text; convert it")
    return head


def may_hold(head: bytes, path: Path | str, counts: Iterable[int]) -> bool:
    """Whether a text that begins so can have one of these numbers of numbers."""
    if b"*" in head:
        return True  # Fortran's repeat counts hide how many there are
    if len(head) < HEAD:
        return len(head.split()) in counts
    growth = EXPANSION if Path(path).suffix == ".gz" else 1
    return 2 * min(counts) <= growth * Path(path).stat().st_size


def first_lines(head: bytes, count: int) -> list[list[bytes]]:
    """The words of the first lines that are not blank."""
    lines = (line.split() for line in unix(head).split(b"\n"))
    found = [words for words in lines if words][:count]
    return found + [[]] * (count - len(found))


def line_at(text: bytes, position: int) -> int:
    """The line of a position, counted from 1."""
    return 1 + len(re.findall(rb"\r\n|\r|\n", text[:position]))


def is_number(token: bytes) -> bool:
    """Whether a token is one number, repeat counts apart."""
    found = NUMBER.fullmatch(token)
    return found is not None and not found["repeat"]


def _begins(letters: np.ndarray) -> np.ndarray:
    """Where tokens begin."""
    space = _SPACE[letters]
    begin = ~space
    begin[1:] &= space[:-1]
    return np.flatnonzero(begin)


def _fast(text: bytes, finite: bool) -> np.ndarray | None:
    """All numbers, if they are plain ones, apart from Fortran's D."""
    values = _plain(text)
    if values is None and re.search(rb"[dD]", text):
        values = _plain(text.translate(_D_TO_E))
    return None if values is None or (finite and not np.isfinite(values).all()) else values


def _plain(text: bytes) -> np.ndarray | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)
            values = np.fromstring(text, dtype=np.float64, sep=" ")
    except (ValueError, DeprecationWarning):
        return None
    # one number per token, or NumPy has read something in its own way (such as 1.5.5 as two)
    return values if len(values) == len(_begins(np.frombuffer(text, np.uint8))) else None


def _in_parts(text: bytes, path: Path | str, line: int, finite: bool) -> np.ndarray:
    """Fast but where something is not plain, so that a fault in a big file is found soon."""
    values, room = [np.empty(0)], max(len(text), LARGEST)
    for part in _parts(text):
        found = _fast(part, finite)
        values.append(_slow(part, path, line, finite, room) if found is None else found)
        room -= len(values[-1])
        line += line_at(part, len(part)) - 1
    return np.concatenate(values)


def _parts(text: bytes) -> Iterator[bytes]:
    """A text cut between tokens into pieces of about `HEAD` bytes."""
    begin = 0
    while begin < len(text):
        gap = _GAP.search(text, begin + HEAD)
        end = gap.start() if gap else len(text)
        yield text[begin:end]
        begin = end


def _slow(text: bytes, path: Path | str, line: int, finite: bool, room: int) -> np.ndarray:
    """Number by number, with repeat counts, until one is wrong or `room` is used up."""
    values: list[float] = []
    counts: list[int] = []
    for token in _TOKEN.finditer(text):
        value = _value(token[0])
        if value is None or (finite and not np.isfinite(value)):
            raise _wrong(token, text, path, line)
        repeat, star, _ = token[0].partition(b"*")
        counts.append(int(repeat[:12]) if star else 1)
        values.append(value)
        room -= counts[-1]
        if room < 0:
            where = line_at(text, token.start()) + line - 1
            raise FileError(
                f"{path}: line {where}: repeat counts make too many numbers; write them out"
            )
    return np.repeat(np.array(values, np.float64), np.array(counts, np.int64))


def _value(token: bytes) -> float | None:
    found = NUMBER.fullmatch(token)
    if found is None:
        is_special = re.fullmatch(rb"(?i)[+-]?(nan|inf|infinity)", token)
        return float(token) if is_special else None
    return float(found["mantissa"] + b"e" + (found["power"] or b"0"))


def _wrong(token: re.Match[bytes], text: bytes, path: Path | str, line: int) -> FileError:
    if _value(token[0]) is not None:
        advice = "a finite number; mend the program that wrote it"
    elif re.fullmatch(rb"[+-]?\d+,\d*(?:[eE][+-]?\d+)?", token[0]):
        advice = "a number; write decimal commas as points"
    else:
        advice = "a number"
    where = line_at(text, token.start()) + line - 1
    return FileError(f"{path}: line {where}: found {quoted(token[0])}, expected {advice}")
