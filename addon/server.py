# SPDX-License-Identifier: GPL-3.0-or-later
"""Where moldline is started, and what its errors mean to a user."""

from dataclasses import dataclass

import bpy

from . import environment
from .client.client import Client
from .client.protocol import ServerError
from .client.starting import Place

QUIT_AFTER = 600.0
"""Seconds after which a server without clients stops."""


class Problem(Exception):
    """What went wrong, as a sentence with what to do.

    Attributes
    ----------
    code
        One of the client's `protocol.CODES`, or "environment".
    """

    def __init__(self, sentence: str, code: str = ""):
        self.code = code
        self.args = (sentence,)


@dataclass(frozen=True)
class Where:
    """What to start, as the preferences say it; only Blender's main thread may read them."""

    python: str
    lacking: str
    socket: str | None

    @classmethod
    def now(cls) -> "Where":
        held = bpy.context.preferences.addons.get(__package__)
        given = held.preferences.socket if held and held.preferences else ""
        socket = bpy.path.abspath(given) if given else None
        try:
            return cls(environment.python(), "", socket)
        except environment.Unmade as problem:
            return cls("", str(problem), socket)

    def start(self) -> Client:
        """A client of the server there, which is started if none answers."""
        if self.lacking and not Place.of(self.socket).answers():
            raise Problem(self.lacking, "environment")
        return Client.start(self.socket, self.python or None, QUIT_AFTER)


def problem_of(error: Exception) -> Problem:
    """The problem that an error is."""
    if isinstance(error, Problem):
        return error
    if isinstance(error, environment.Unmade):
        return Problem(str(error), "environment")
    if isinstance(error, ServerError):
        return Problem(_with_remedy(error), error.code)
    return Problem(f"{type(error).__name__}: {error}", "internal")


def _with_remedy(error: ServerError) -> str:
    """What a client says, and which button helps."""
    said = str(error)
    button = environment.button() if environment.is_own() else ""
    if error.code == "version":
        return f"{said}; " + (
            f"press '{button}', then 'Restart'" if button else "update one of the two"
        )
    if error.code == "disconnected":
        if "No module named" in said:
            return f"{said}; " + (
                f"press '{button}'" if button else "name another Python in the preferences"
            )
        return f"moldline is not running any more ({said}); press 'Restart'"
    return said


def mismatch(running: str) -> str:
    """That a running moldline is another than the add-on is made for, and what to do; or ""."""
    own = environment.version()
    if not own or running == own:
        return ""
    if not environment.is_own() and running.split(".dev")[0] == own.split(".dev")[0]:
        return ""  # who develops moldline has it a few commits apart
    remedy = (
        "press 'Update environment'"
        if environment.is_own()
        else f"install moldline {own} in the environment that the preferences name"
    )
    return f"moldline {running} is running, this add-on is made for {own}: {remedy}, then 'Restart'"
