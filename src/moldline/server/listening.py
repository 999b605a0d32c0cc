"""Where a server listens, and the files that tell others how to reach it."""

import contextlib
import errno
import json
import os
import secrets
import socket
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..errors import FileError, ParameterError

LOOPBACK = ("127.0.0.1", "::1", "localhost")
BACKLOG = 128


@contextlib.contextmanager
def at_path(path: Path) -> Iterator[socket.socket]:
    """A Unix socket that only its owner may use; the file is removed behind it."""
    if not hasattr(socket, "AF_UNIX"):
        raise ParameterError("--socket: this system has no Unix sockets; use --port")
    if len(os.fsencode(path)) > 100:  # systems take 104 or 108 bytes
        raise ParameterError(f"--socket: {path} is too long for a socket; take a shorter path")
    _make_way(path)
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    mask = os.umask(0o177)
    try:
        listening.bind(str(path))
    except OSError as error:
        listening.close()
        raise FileError(f"{path}: no socket can be made here: {error.strerror}") from None
    finally:
        os.umask(mask)
    own = _identity(path)
    with listening:
        listening.listen(BACKLOG)
        try:
            yield listening
        finally:
            with contextlib.suppress(FileNotFoundError):
                if _identity(path) == own:  # not what another server put in its place
                    path.unlink()


@contextlib.contextmanager
def at_port(host: str, port: int) -> Iterator[socket.socket]:
    """A TCP socket; port 0 takes one that is free."""
    try:
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.create_server(address[:2], family=family, backlog=BACKLOG)
    except OSError as error:
        raise ParameterError(f"cannot listen on {host}, port {port}: {error}") from None
    with listening:
        yield listening


def token_in(path: Path) -> str:
    """The token in a file; where there is none, one is made, for its owner alone to read."""
    with contextlib.suppress(FileNotFoundError):
        found = path.read_text().strip()
        if os.name == "posix" and path.stat().st_mode & 0o077:
            raise ParameterError(f"--token-file: others may read {path}; do: chmod 600 {path}")
        if found:
            return found
    made = secrets.token_urlsafe(24)
    private(path, made + "\n")
    return made


def token_file() -> Path:
    """Where a token goes that nobody said a file for."""
    return Path(tempfile.gettempdir()) / f"moldline-{secrets.token_hex(4)}.token"


@contextlib.contextmanager
def announced(path: Path | None, told: dict) -> Iterator[None]:
    """A file that says how to reach the server, there as long as it serves."""
    if path is None:
        yield
        return
    private(path, json.dumps(told) + "\n")
    own = _identity(path)
    try:
        yield
    finally:
        with contextlib.suppress(FileNotFoundError):
            if _identity(path) == own:
                path.unlink()


def private(path: Path, text: str) -> None:
    """Write a file that only its owner can read, all of it at once."""
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        place = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with open(place, "w") as stream:  # noqa: PTH123 - of a descriptor
            stream.write(text)
        beside.replace(path)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror}") from None


def _identity(path: Path) -> tuple[int, int]:
    """What tells a file from a later one in its place; a number alone may be given again."""
    found = path.stat()
    return found.st_ino, found.st_ctime_ns


def _make_way(path: Path) -> None:
    """Remove the socket of a server that is no longer there."""
    if not path.exists():
        return
    if not path.is_socket():
        raise FileError(f"{path}: is there already and is no socket; give another name")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as trial:
        trial.settimeout(2)
        try:
            trial.connect(str(path))
        except OSError as error:
            if error.errno not in (errno.ECONNREFUSED, errno.ENOENT):
                raise FileError(f"{path}: {error}; give another name") from None
            path.unlink(missing_ok=True)
            return
    raise FileError(f"{path}: a server listens here already; use it, or give another name")
