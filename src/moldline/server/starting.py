"""A server started by its client. Standard library only."""

import contextlib
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from .protocol import PROTOCOL, ServerError

_STARTED: list[subprocess.Popen] = []
"""Servers that go on when their client leaves; they are looked after for as long as we are here."""


class Address(NamedTuple):
    """Where a server is: a Unix socket, or a host and a port."""

    socket: str | None = None
    host: str = "127.0.0.1"
    port: int | None = None
    token: str | None = None

    def __str__(self) -> str:
        return self.socket or f"{self.host}, port {self.port}"


class Place(NamedTuple):
    """Where a server is, or is to be: its socket, or the file that tells its port."""

    path: Path
    is_socket: bool

    @classmethod
    def of(cls, given: str | PathLike[str] | None = None) -> "Place":
        """The one that is given, or the user's own."""
        is_socket = hasattr(socket, "AF_UNIX")
        if given is not None:
            return cls(Path(given).absolute(), is_socket)
        kind = "sock" if is_socket else "json"
        return cls(folder() / f"moldline-{PROTOCOL}.{kind}", is_socket)

    def address(self) -> Address:
        """Of the server that is there."""
        if self.is_socket:
            return Address(str(self.path))
        told = json.loads(self.path.read_text())
        return Address(None, told["host"], told["port"], told["token"])

    def answers(self) -> bool:
        """Whether somebody listens there."""
        try:
            path, host, port, _ = self.address()
            if path is None:
                socket.create_connection((host, port or 0), 2).close()
                return True
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as trial:
                trial.settimeout(2)
                trial.connect(path)
            return True
        except (OSError, ValueError, KeyError):
            return False


def folder() -> Path:
    """A folder of the user's own for sockets."""
    given = os.environ.get("XDG_RUNTIME_DIR")
    if given and Path(given).is_dir():
        return Path(given)
    user = os.getuid() if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")
    own = Path(tempfile.gettempdir()) / f"moldline-{user}"
    own.mkdir(mode=0o700, exist_ok=True)
    if hasattr(os, "getuid") and own.stat().st_uid != os.getuid():
        raise ServerError("not allowed", f"{own}: belongs to somebody else; give socket=")
    return own


def start(place: Place, python: str | PathLike[str] | None, quit_after: float, wait: float) -> None:
    """Start a server and wait until it listens; it stops by itself when its clients have left."""
    program = str(python or sys.executable)
    where = ["--socket", str(place.path)]
    if not place.is_socket:
        where = ["--port", "0", "--ready", str(place.path), "--token-file", f"{place.path}.token"]
    command = [program, "-m", "moldline", "serve", *where, "--quit-after", str(quit_after)]
    with tempfile.TemporaryFile() as log:
        try:
            server = subprocess.Popen(
                [*command, "--allow-shutdown"],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env=_environment(),
                start_new_session=True,  # a key that interrupts the client is not for the server
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as error:
            raise ServerError("disconnected", f"{program}: cannot be started: {error}") from None
        _STARTED[:] = [server, *(one for one in _STARTED if one.poll() is None)]
        deadline = time.monotonic() + wait
        while not place.answers():
            if server.poll() is not None and not place.answers():
                log.seek(0)
                told = log.read().decode(errors="replace").strip()[-600:]
                raise ServerError(
                    "disconnected", f"{' '.join(command[:4])}: ended at once: {told or 'no reason'}"
                )
            if time.monotonic() > deadline:
                with contextlib.suppress(OSError):
                    server.kill()
                raise ServerError("timeout", f"the server did not listen within {wait:g} s")
            time.sleep(0.05)


def _environment() -> dict[str, str]:
    """Without what would lead another interpreter to this one's libraries."""
    return {k: v for k, v in os.environ.items() if k not in ("PYTHONHOME", "PYTHONPATH")}
