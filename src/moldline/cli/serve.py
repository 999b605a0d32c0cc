"""`moldline serve`."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import socket

HELP = "Answer a design framework's files, or keep cases loaded and answer clients."
EXAMPLE = """\
  moldline serve wing.xml                                       (reads model.input.xml here)
  moldline serve --socket /tmp/moldline.sock
  moldline serve --port 7777                                    (this machine only)
  moldline serve --host 0.0.0.0 --port 7777 --token-file token  (others too, who know the token)"""


def configure(command: argparse.ArgumentParser) -> None:
    """Arguments."""
    command.add_argument(
        "model",
        type=Path,
        nargs="?",
        help="XDDM Model, design or case: answer model.input.xml in this folder, and end",
    )
    command.add_argument(
        "--layout",
        choices=("one", "each", "both"),
        help="with a model: derivatives in one file, in one for each variable, or both",
    )
    command.add_argument(
        "--limit",
        type=float,
        default=600.0,
        metavar="S",
        help="with a model: seconds that a run of another program may take (600)",
    )
    command.add_argument(
        "--workers", type=int, metavar="N", help="with a model: other programs run at a time"
    )
    where = command.add_mutually_exclusive_group()
    where.add_argument("--socket", type=Path, metavar="PATH", help="listen on a Unix socket")
    where.add_argument("--port", type=int, help="listen on a TCP port; 0 takes a free one")
    command.add_argument(
        "--host", default="127.0.0.1", help="with --port: the address to listen on; this machine's"
    )
    command.add_argument(
        "--token", help="what clients must know (better by --token-file: `ps` shows this one)"
    )
    command.add_argument(
        "--token-file",
        type=Path,
        metavar="FILE",
        help="the token is in this file; one is made and written there if it is absent",
    )
    command.add_argument(
        "--ready", type=Path, metavar="FILE", help="write how to reach the server, once it listens"
    )
    _configure_ends(command)


def _configure_ends(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--processes", type=int, default=4, metavar="N", help="cases held at the same time (4)"
    )
    command.add_argument(
        "--idle",
        type=float,
        default=1800,
        metavar="S",
        help="let go of an unused case after (1800)",
    )
    command.add_argument(
        "--no-spare",
        action="store_true",
        help="no process is kept ready for the next case: saves memory, costs seconds",
    )
    command.add_argument(
        "--quit-after", type=float, metavar="S", help="stop after so many seconds without a client"
    )
    command.add_argument(
        "--allow-shutdown", action="store_true", help="clients may stop the server"
    )


def run(given: argparse.Namespace) -> int:
    """Answer, or serve until stopped; the status is then 0."""
    from ..errors import ParameterError
    from ..server import listening

    if given.model is not None:
        return _answer(given)
    if given.processes < 1 or given.idle <= 0:
        raise ParameterError("--processes and --idle must be above 0")
    if given.socket is not None:
        with listening.at_path(given.socket) as ours:
            return _serve(given, ours, {"socket": str(given.socket.absolute())})
    if given.port is None:
        raise ParameterError("give a model to answer for, or --socket PATH or --port N to listen")
    if not 0 <= given.port < 65536:
        raise ParameterError(f"--port is from 0 to 65535, got {given.port}")
    with listening.at_port(given.host, given.port) as ours:
        return _serve(given, ours, {"host": given.host, "port": ours.getsockname()[1]})


def _answer(given: argparse.Namespace) -> int:
    from ..errors import ParameterError
    from ..workers import Threads
    from ..xddm.serving import answer

    if given.socket is not None or given.port is not None:
        raise ParameterError("a model is answered in this folder; --socket and --port are for none")
    executor = None if given.workers is None else Threads(given.workers)
    found = answer(given.model, ".", given.layout, given.limit, executor)
    print("\n".join(["wrote Components.i.tri and model.output.xml", *found.notes]))
    return 0


def _serve(given: argparse.Namespace, ours: "socket.socket", where: dict[str, Any]) -> int:
    import asyncio

    from ..server import listening
    from ..server.cases import Cases
    from ..server.front import Front
    from ..server.holder import Spare

    token = _token(given, is_needed=where.get("host", "127.0.0.1") not in listening.LOOPBACK)
    cases = Cases(given.processes, given.idle, Spare(not given.no_spare))
    front = Front(cases, token, given.allow_shutdown, given.quit_after)
    with listening.announced(given.ready, {**where, "token": token, "pid": os.getpid()}):
        print("serving at " + (where.get("socket") or "{host}, port {port}".format(**where)))
        print(end="", flush=True)
        asyncio.run(front.serve(ours))
    return 0


def _token(given: argparse.Namespace, is_needed: bool) -> str | None:
    """The token; where others may come in, there is one."""
    from ..server import listening

    if given.token:
        return str(given.token)
    if given.token_file is None and not is_needed:
        return None
    path = given.token_file or listening.token_file()
    token = listening.token_in(path)
    print(f"token: in {path}")
    return token
