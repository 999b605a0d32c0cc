# SPDX-License-Identifier: GPL-3.0-or-later
"""The one link to a running moldline: started where needed, asked from a thread, told of by state.

Threads talk to the server only; whatever touches Blender's data runs on its main thread.
"""

import queue
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import bpy
from bpy.app.handlers import persistent

from . import environment, server, window
from .client.client import Client
from .client.protocol import ServerError
from .client.starting import Place
from .server import Problem, Where, problem_of

TICK = 0.02
"""Seconds between looks at what threads have done."""


@dataclass
class _Job:
    work: Callable[[Client], Any]
    then: Callable[[Any], None] | None
    failed: Callable[[Problem], None] | None
    what: str
    undo: str
    epoch: int
    where: Where
    result: Any = None
    problem: Problem | None = None


@dataclass
class _State:
    """All that is known of the link."""

    client: Client | None = None
    live: Client | None = None
    where: Where | None = None
    is_starting: bool = False
    why: str = ""
    generation: int = 0
    epoch: int = 0
    under_way: list[str] = field(default_factory=list)
    thread: threading.Thread | None = None
    lost: list[Callable[[Problem], None]] = field(default_factory=list)
    ready: list[Callable[[], None]] = field(default_factory=list)


_now = _State()
_asked: queue.Queue = queue.Queue()
_done: queue.Queue = queue.Queue()
_connecting = threading.RLock()


def state() -> str:
    """'no environment', 'stopped', 'starting', 'ready' or 'failed'."""
    if _now.is_starting or environment.is_making():
        return "starting"
    if _now.why:
        return "failed"
    if _now.client is not None:
        return "ready"
    return "stopped" if environment.is_made() else "no environment"


def sentence() -> str:
    """How things stand, with the remedy where something is wrong."""
    if environment.is_making():
        return environment.progress() or "the environment is being made"
    found = state()
    if found == "starting":
        return "moldline is starting"
    if found == "ready":
        assert _now.client is not None
        return mismatch() or f"moldline {_now.client.moldline} is running"
    if found == "failed":
        return _now.why
    if found == "no environment":
        return Where.now().lacking
    return "moldline is not running; it starts when it is needed"


def mismatch() -> str:
    """That the running moldline is another than the add-on is made for, and what to do; or ""."""
    return server.mismatch(_now.client.moldline) if _now.client is not None else ""


def busy() -> str:
    """What is under way, or ""."""
    return _now.under_way[0] if _now.under_way else ""


def client() -> Client:
    """The client, where moldline is running."""
    if _now.client is None or _now.why:
        raise Problem(sentence(), "disconnected")
    return _now.client


def live_client() -> Client:
    """Another connection to the same moldline: a drag never waits behind what `run` does."""
    main = client()
    if _now.live is None or _now.live.address != main.address:
        assert _now.where is not None
        try:
            _now.live = _now.where.start()
        except ServerError as error:
            raise met(error) from None
    return _now.live


def run(
    work: Callable[[Client], Any],
    then: Callable[[Any], None] | None = None,
    failed: Callable[[Problem], None] | None = None,
    what: str = "working",
    undo: str = "",
) -> None:
    """Have `work(client)` done in a thread, then `then(result)` on Blender's main thread.

    Moldline is started first where needed. What goes wrong is given to `failed`; without it, it is
    raised in background mode and told in the window else. `what` is shown meanwhile; `undo` names
    the step that `then` makes. In background mode all is done before this returns. When another
    file is opened meanwhile, nobody is told.
    """
    job = _Job(work, then, failed, what, undo, _now.epoch, Where.now())
    if bpy.app.background:
        _work(job)
        _deliver(job)
        return
    if _now.thread is None or not _now.thread.is_alive():
        _now.thread = threading.Thread(target=_serve, daemon=True)
        _now.thread.start()
    _now.under_way.append(what)
    _asked.put(job)
    wake()


def start(then: Callable[[], None] | None = None) -> None:
    """Start moldline where it is not running."""
    run(lambda _: None, lambda _: then() if then else None, what="moldline is starting")


def restart(then: Callable[[], None] | None = None) -> None:
    """Stop moldline and start it again; cases that are open are opened again when next asked."""
    own = _now.client
    if own is not None and busy():  # what is under way is given up
        _shut(own)

    def work(found: Client) -> None:
        if found is not own:  # it was not running, so this one is new
            return
        _shut(found)
        found.close()
        found.ensure()

    run(work, lambda _: then() if then else None, what="moldline is starting again")


def stop() -> None:
    """Stop moldline."""
    if _now.client is not None:
        _shut(_now.client)
    forget()


def forget() -> None:
    """Leave the server that there is; what is wanted next connects again."""
    if not _connecting.acquire(blocking=False):
        return  # a thread is starting one just now; the next job sees that it is another
    try:
        for one in (_now.client, _now.live):
            if one is not None and busy():  # it is in a thread's hands: nobody waits for that
                threading.Thread(target=one.close, daemon=True).start()
            elif one is not None:
                one.close()
        _now.client = _now.live = _now.where = None
        _now.why, _now.generation = "", 0
    finally:
        _connecting.release()


def met(error: Exception) -> Problem:
    """The problem that a client's error is; where the connection was lost, all are told."""
    problem = problem_of(error)
    if isinstance(error, ServerError) and error.code in ("disconnected", "version"):
        _now.why = str(problem)
        _done.put(lambda: [tell(problem) for tell in list(_now.lost)])
        wake()
    return problem


def on_lost(callback: Callable[[Problem], None]) -> None:
    """Have `callback(problem)` called on the main thread when the connection was lost."""
    if callback not in _now.lost:
        _now.lost.append(callback)


def on_ready(callback: Callable[[], None]) -> None:
    """Have `callback()` called on the main thread when moldline is there, or there again."""
    if callback not in _now.ready:
        _now.ready.append(callback)


def make_environment() -> None:
    """Make the environment, or renew it, in the background; then start what it has."""

    def made(problem: str) -> None:
        _done.put(lambda: _made(problem))

    try:
        environment.check()
        if _now.client is not None:
            _shut(_now.client)  # its files are about to be replaced
        environment.make(made)
    except environment.Unmade as problem:
        _now.why = str(problem)
        wake()
        raise Problem(str(problem), "environment") from None
    wake()
    if bpy.app.background:
        _tick()


def _made(problem: str) -> None:
    if problem:
        _now.why = problem
        if bpy.app.background:
            raise Problem(problem, "environment")
        window.tell(Problem(problem, "environment"))
        return
    _now.why = ""
    start()


def _shut(found: Client) -> None:
    """Stop the server behind a client, and wait until it has taken its socket away."""
    try:
        other = Client(found.address, timeout=10.0, shared=False)  # the other one may be busy
        other.shutdown()
    except (ServerError, OSError):  # gone already, or not ours to stop
        return
    where = Place.of(_now.where.socket if _now.where else None)
    deadline = time.monotonic() + 10.0
    while where.path.exists() and time.monotonic() < deadline:
        time.sleep(0.02)


def _connected(where: Where) -> Client:
    """The client; moldline is started where it is not running."""
    with _connecting:
        _now.is_starting = _now.client is None or bool(_now.why)
        try:
            if _now.client is not None and _now.where == where:
                _reached(_now.client)  # the same client again, so that its cases stay of use
            else:
                forget()
                _now.client, _now.where = where.start(), where
        finally:
            _now.is_starting = False
        _now.why = ""
        _look()
        return _now.client


def _reached(found: Client) -> None:
    """Connect again where the server went away unnoticed."""
    try:
        found.ping()
    except ServerError as error:
        if error.code != "disconnected":
            raise
        found.ensure()


def _look() -> None:
    """Tell who wants to know that moldline is there, or there again."""
    found = _now.client.generation if _now.client else 0
    if found != _now.generation:
        _now.generation = found
        if found:
            _done.put(lambda: [tell() for tell in list(_now.ready)])


def _serve() -> None:
    """The thread: one job after the other."""
    while True:
        job = _asked.get()
        if job is None:
            return
        _work(job)
        _done.put(lambda job=job: _deliver(job))


def _work(job: _Job) -> None:
    try:
        found = _connected(job.where)
        job.result = job.work(found)
        _look()
    except Exception as error:
        if not isinstance(error, (ServerError, Problem)):
            traceback.print_exc()
        job.problem = met(error)
        if _now.client is None and not _now.why and job.problem.code != "environment":
            _now.why = str(job.problem)


def _deliver(job: _Job) -> None:
    """Tell who asked; on the main thread."""
    if not bpy.app.background and job.what in _now.under_way:
        _now.under_way.remove(job.what)
    if job.epoch != _now.epoch:
        return
    if bpy.app.background:
        _flush()
    try:
        if job.problem is not None:
            raise job.problem
        if job.then is not None:
            job.then(job.result)
            if job.undo and not bpy.app.background:
                window.push_undo(job.undo)
    except Problem as problem:
        if job.failed is not None:
            job.failed(problem)
        elif bpy.app.background:
            raise
        else:
            window.tell(problem)


def wake() -> None:
    """Look soon at what threads have done; any thread may say so."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=TICK, persistent=True)


def _tick() -> float | None:
    """Blender's timer: what threads have done is told, what is under way is shown."""
    _flush()
    is_busy = bool(_now.under_way) or environment.is_making()
    window.show(sentence() if environment.is_making() else busy())
    return TICK if is_busy else None


def _flush() -> None:
    while True:
        try:
            news = _done.get_nowait()
        except queue.Empty:
            return
        try:
            news()
        except Exception:
            if bpy.app.background:
                raise
            traceback.print_exc()  # a timer that raises is never called again


@persistent
def _another_file(*_: Any) -> None:
    """What was asked for the file before is nobody's any more."""
    _now.epoch += 1


def _start_at_once() -> None:
    held = bpy.context.preferences.addons.get(__package__)
    if held and held.preferences and held.preferences.starts_at_once and environment.is_made():
        start()


def register() -> None:
    """Let Blender know."""
    bpy.app.handlers.load_pre.append(_another_file)
    if not bpy.app.background:
        bpy.app.timers.register(_start_at_once, first_interval=1.0)


def unregister() -> None:
    """Take it back; the server stops by itself when nobody else uses it."""
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if _another_file in bpy.app.handlers.load_pre:
        bpy.app.handlers.load_pre.remove(_another_file)
    if _now.thread is not None:
        _asked.put(None)
    window.clear_soon()
    forget()
    _now.lost.clear()
    _now.ready.clear()
