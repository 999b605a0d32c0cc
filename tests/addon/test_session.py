"""The link to a running moldline: started where needed, and every way it can fail is a sentence."""

import contextlib
import os
import signal
import sys
import threading
import time
from pathlib import Path

import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import environment, session
from bl_ext.user_default.moldline.client import protocol


@pytest.fixture(autouse=True)
def _clean():
    session.forget()
    yield
    session.forget()


def test_moldline_is_started_when_it_is_first_needed(ball_case):
    assert session.state() in ("stopped", "ready")
    told = []
    session.run(lambda client: client.open(ball_case).points(), told.append, what="opening")
    assert told[0].shape == (258, 3)
    assert session.state() == "ready" and "moldline" in session.sentence()
    assert session.busy() == ""


def test_without_it_the_client_is_a_problem_with_a_sentence():
    with pytest.raises(session.Problem, match="it starts when it is needed"):
        session.client()


def test_an_error_of_moldline_is_a_sentence(ball_case):
    told = []
    session.run(
        lambda client: client.open(ball_case).points({"lift": [9.0, 0.0]}), failed=told.append
    )
    assert told[0].code == "parameter" and "lift" in str(told[0])
    assert session.state() == "ready"
    with pytest.raises(session.Problem, match="lift"):
        session.run(lambda client: client.open(ball_case).points({"lift": [9.0, 0.0]}))


def test_an_error_of_the_work_itself_is_told_too(capsys):
    with pytest.raises(session.Problem, match="ZeroDivisionError"):
        session.run(lambda client: 1 / 0)
    assert "Traceback" in capsys.readouterr().err


def test_a_restart_keeps_what_is_open(ball_case):
    session.start()
    case = session.client().open(ball_case)
    before, first = case.points(), server_pid(session.client())
    session.restart()
    np.testing.assert_array_equal(case.points(), before)
    assert server_pid(session.client()) != first
    assert session.state() == "ready"


def test_a_stop_is_no_failure(ball_case):
    session.start()
    session.stop()
    assert session.state() == "stopped"


def test_a_server_that_crashed_is_started_again_and_told(ball_case):
    session.start()
    case = session.client().open(ball_case)
    again = []
    session.on_ready(lambda: again.append(True))
    crash(session.client())
    session.run(lambda client: client.cases())
    session._flush()
    assert again and session.state() == "ready"
    assert case.points().shape == (258, 3)


def test_a_server_that_is_lost_in_the_middle_is_told_with_the_remedy(ball_case):
    session.start()
    case = session.client().open(ball_case)
    lost = []
    session.on_lost(lost.append)
    with pytest.raises(session.Problem, match="press 'Restart'"):
        session.run(lambda client: (crash(client), client.wait(client.send("ping", case="x"))))
    assert [one.code for one in lost] == ["disconnected"]
    assert session.state() == "failed" and "press 'Restart'" in session.sentence()
    with pytest.raises(session.Problem, match="press 'Restart'"):
        session.client()
    session.restart()
    assert session.state() == "ready"
    assert case.points().shape == (258, 3)


def test_a_killed_process_of_a_case_is_a_sentence_and_the_next_request_works(ball_case):
    session.start()
    case = session.client().open(ball_case)
    for one in session.client().cases():
        os.kill(one["pid"], signal.SIGKILL)
    told = []
    for _ in range(2):
        session.run(lambda _: case.points(), told.append, told.append)
    assert told[1].shape == (258, 3)
    assert isinstance(told[0], np.ndarray) or told[0].code == "worker died"
    assert session.state() == "ready"


def test_a_missing_environment_says_which_button_helps(preferences, tmp_path):
    preferences.socket = str(tmp_path / "none.sock")
    preferences.python = ""
    assert session.state() == "no environment"
    assert "press 'Make environment'" in session.sentence()
    with pytest.raises(session.Problem, match="press 'Make environment'") as told:
        session.start()
    assert told.value.code == "environment"


def test_a_python_that_is_not_there_or_has_no_moldline_is_told(preferences, tmp_path):
    preferences.socket = str(tmp_path / "none.sock")
    preferences.python = str(tmp_path / "python")
    with pytest.raises(session.Problem, match=r"no Python at .*preferences"):
        session.start()
    preferences.python = sys.executable
    with pytest.raises(session.Problem, match=r"No module named.*another Python"):
        session.start()
    assert session.state() == "failed"


def test_another_protocol_is_told_with_the_remedy(monkeypatch):
    session.start()
    session.forget()
    monkeypatch.setattr(protocol, "PROTOCOL", 99)
    with pytest.raises(session.Problem, match=r"99.*update one of the two"):
        session.start()
    assert session.state() == "failed"


def test_another_moldline_is_told_with_the_remedy(monkeypatch):
    session.start()
    monkeypatch.setattr(environment, "version", lambda: "7.0")
    assert "this add-on is made for 7.0: install moldline 7.0" in session.sentence()
    monkeypatch.setattr(environment, "is_own", lambda: True)
    assert "press 'Update environment', then 'Restart'" in session.sentence()
    assert session.state() == "ready"


def test_a_drag_has_a_connection_of_its_own(ball_case):
    session.start()
    assert session.live_client() is session.live_client() is not session.client()
    live = session.live_client().open(ball_case).live(dtype="<f4")
    live.push({"lift": [0.1, 0.2]})
    assert live.finish().points.shape == (258, 3)


def test_in_a_window_work_is_done_in_a_thread_and_told_on_the_main_one(window, ball_case):
    told = []
    session.run(lambda _: threading.get_ident(), told.append, what="thinking")
    assert session.busy() == "thinking" and not told
    until(lambda: told, window)
    assert told[0] != threading.get_ident() and session.busy() == ""


def test_what_was_asked_before_another_file_was_opened_is_told_to_nobody(window):
    told = []
    session.run(lambda _: time.sleep(0.1), told.append, told.append)
    bpy.ops.wm.read_homefile(use_empty=True)
    until(lambda: not session.busy(), window)
    assert not told


def test_a_restart_in_a_window_gives_up_what_is_under_way(window):
    session.start()
    until(lambda: session.state() == "ready" and not session.busy(), window)
    told, again = [], []
    session.run(lambda client: client.wait(-1), failed=told.append)  # which never comes
    time.sleep(0.2)
    session.restart(lambda: again.append(session.state()))
    until(lambda: again, window)
    assert again == ["ready"] and "press 'Restart'" in str(told[-1])


def test_in_a_window_what_goes_wrong_without_a_listener_is_no_exception(window, capsys):
    session.run(lambda _: 1 / 0)
    until(lambda: not session.busy(), window)
    assert "ZeroDivisionError" in capsys.readouterr().err


def crash(client):
    """End the server as if it had crashed."""
    pid = server_pid(client)
    os.kill(pid, signal.SIGKILL)
    time.sleep(0.2)


def server_pid(client):
    """The process that listens; one that was told to stop may need a moment to end."""
    deadline = time.monotonic() + 30
    while len(found := list(_servers(client.address.socket.encode()))) != 1:
        assert time.monotonic() < deadline, found
        time.sleep(0.05)
    return found[0]


def _servers(place):
    """Processes that have a socket's path on their command line."""
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            words = file.read_bytes().split(b"\0")
            if b"serve" in words and place in words:
                yield int(file.parent.name)


@pytest.fixture
def window(monkeypatch):
    """As if there were a window: nothing calls timers here, so the test does."""

    class App:
        background = False

        def __getattr__(self, name):
            return getattr(bpy.app, name)

    class Bpy:
        app = App()

        def __getattr__(self, name):
            return getattr(bpy, name)

    monkeypatch.setattr(session, "bpy", Bpy())
    return session._tick


def until(condition, tick):
    """Call the timer until something is true."""
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        tick()
        time.sleep(0.01)
