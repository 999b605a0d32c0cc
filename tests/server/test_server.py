"""A running moldline and its clients, as they work and as they fail."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from servers import CASE, is_shared, serving, until

import moldline as ml
from moldline.server import protocol, wire
from moldline.server.cases import fingerprint
from moldline.server.client import Client
from moldline.server.protocol import ServerError

LIFT = {"lift": [0.3, -0.2]}
N = 1026
"""Points of the ball."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory, ball):
    """Two cases that differ, and their geometry."""
    place = tmp_path_factory.mktemp("s")
    ml.write(place / "ball.tri", ball)
    (place / "one.toml").write_text(CASE)
    (place / "two.toml").write_text(CASE.replace("[2, 3, 2]", "[2, 2, 2]"))
    return place


@pytest.fixture(scope="module")
def path(folder):
    """The socket of a server that is running."""
    place = folder / "socket"
    with serving("--socket", str(place)):
        until(place.exists)
        yield place
    assert not place.exists()


@pytest.fixture
def client(path):
    """A client of it."""
    with Client.connect(path) as one:
        yield one


@pytest.fixture(scope="module")
def here(folder):
    """The first case, in this process."""
    return ml.load(folder / "one.toml")


@pytest.fixture(scope="module")
def keeper(path, folder):
    """A client that has both cases open all the time, so that they stay loaded."""
    with Client.connect(path) as one:
        text = (folder / "two.toml").read_text()
        yield one.open(folder / "one.toml"), one.open(text=text, folder=folder)


@pytest.fixture
def case(client, keeper, folder):
    """The first case, open for a client of its own."""
    return client.open(folder / "one.toml")


def pid_of(client, name):
    """The process that holds a case."""
    return next(one["pid"] for one in client.cases() if one["case"].endswith(name))


def refused(call, *arguments, **named):
    """What a call is refused for."""
    with pytest.raises(ServerError) as found:
        call(*arguments, **named)
    return found.value


@pytest.mark.parametrize("is_shared", [True, False], ids=["shared memory", "sent"])
def test_results_are_those_of_this_process_to_the_bit(path, keeper, folder, here, is_shared):
    with Client.connect(path, shared=is_shared) as client:
        case, pipeline = client.open(folder / "one.toml"), here.pipeline
        weights = np.random.default_rng(0).normal(size=(N, 3))
        for _ in range(2):  # the first by the socket, the second by shared memory, if that serves
            client.expect(2**17)
            np.testing.assert_array_equal(case.points(LIFT), pipeline.points(LIFT))
            np.testing.assert_array_equal(
                case.sensitivity(LIFT, "lift"), pipeline.sensitivity(LIFT, "lift")
            )
            np.testing.assert_array_equal(
                case.pullback(LIFT, weights)["lift"], pipeline.pullback(LIFT, weights)["lift"]
            )
        push = case.pushforward(LIFT, {"lift": [1.0, 0.5]})
        np.testing.assert_array_equal(push, pipeline.pushforward(LIFT, {"lift": [1.0, 0.5]}))
        assert case.measures(LIFT)["volume"] == here.measurements(LIFT)["volume"]
        slopes = here.measurements.jacobian(LIFT)["volume"]["lift"]
        np.testing.assert_array_equal(case.jacobian(LIFT)["volume"]["lift"], slopes)
        assert (client._places.segment is not None) == is_shared


def test_a_case_is_described_when_it_is_opened(case, here):
    assert case.description["result"] == "ball"
    assert case.variables["lift"]["upper"] == [1.0, 1.0]
    assert case.description["measures"]["volume"]["upper"] == [None]
    np.testing.assert_array_equal(case.faces, here.pipeline.geometry.faces)
    np.testing.assert_array_equal(case.points_at_rest, here.pipeline.geometry.points)
    assert case.values(LIFT)["lift"].tolist() == [0.3, -0.2]
    (net,) = case.nets(LIFT)
    assert net.rest.shape == net.moved.shape == (12, 3) and net.lines.shape[1] == 2
    assert case.check(LIFT)["is_sound"]


def test_single_precision_is_sent_where_it_is_asked_for(case, here):
    found = case.points(LIFT, dtype="<f4")
    np.testing.assert_array_equal(found, np.asarray(here.pipeline.points(LIFT), np.float32))


def test_what_is_wrong_is_told_and_the_next_request_served(case, client, folder):
    assert "outside [-1, 1]" in str(refused(case.points, {"lift": [5, 0]}))
    assert "must be finite" in str(refused(case.points, {"lift": [np.nan, 0]}))
    assert "nothing named 'x'" in str(refused(case.points, {"x": 1}))
    assert refused(case.points, LIFT, of="nowhere").code == "unknown name"
    assert refused(case.sensitivity, LIFT, "x").code == "unknown name"
    bad = np.zeros((N, 3))
    bad[7, 1] = np.inf
    assert "at [7, 1] it is not" in str(refused(case.pullback, LIFT, bad))
    assert refused(case.pullback, LIFT, np.zeros((3, 3))).code == "parameter"
    assert refused(client.request, "fly").code == "unknown operation"
    assert refused(client.request, "points", case="case-99").code == "unknown case"
    assert refused(client.request, "points", case=case.handle(), values=5).code == "malformed"
    assert refused(client.shutdown).code == "not allowed"
    assert refused(client.open, folder / "absent.toml").code == "case"
    assert case.points(LIFT).shape == (N, 3)


def test_a_case_is_saved_with_its_values(case, folder):
    case.save(folder / "saved.toml", LIFT)
    assert ml.load(folder / "saved.toml").values()["lift"].tolist() == [0.3, -0.2]


def test_a_case_may_be_given_as_text(keeper, folder):
    want = ml.load(folder / "two.toml").pipeline.points(LIFT)
    np.testing.assert_array_equal(keeper[1].points(LIFT), want)
    assert not list(folder.glob(".moldline-*"))


def test_a_killed_process_is_told_and_others_go_on(case, client, keeper, here):
    own = np.random.default_rng(1).normal(size=(50, 3)) / 3
    name = case.embed(own, "probes")
    want = here.embed(own, name="probes").points(LIFT)
    np.testing.assert_array_equal(case.points(LIFT, of=name), want)
    np.testing.assert_array_equal(case.points(LIFT, of=name, rest=True), own)
    pid = pid_of(client, "one.toml")
    os.kill(pid, signal.SIGSTOP)  # so that the request is surely under way
    asked = case.send("points", values=LIFT)
    start = time.monotonic()
    keeper[1].points(LIFT)  # a case that is slow holds up no other
    assert time.monotonic() - start < 20
    os.kill(pid, signal.SIGKILL)
    error = refused(client.wait, asked)
    assert error.code == "worker died" and "signal 9 (SIGKILL)" in str(error)
    np.testing.assert_array_equal(case.points(LIFT, of=name), want)  # embedded again by itself
    assert case.points(LIFT).shape == (N, 3)
    assert next(c["loads"] for c in client.cases() if c["case"].endswith("one.toml")) == 2


def test_only_the_latest_of_a_drag_is_computed(case, client, here):
    pid = pid_of(client, "one.toml")
    os.kill(pid, signal.SIGSTOP)
    asked = [case.send("points", values={"lift": [0.01 * i, 0.0]}, latest=True) for i in range(10)]
    until(lambda: next(c["waiting"] for c in client.cases() if c["pid"] == pid) <= 2)
    os.kill(pid, signal.SIGCONT)
    assert [refused(client.wait, number).code for number in asked[1:-1]] == ["outdated"] * 8
    want = here.pipeline.points({"lift": [0.09, 0.0]})
    np.testing.assert_array_equal(client.wait(asked[-1]).arrays["points"], want)


def test_a_drag_ends_at_the_values_that_were_pushed_last(case, here):
    live, seen = case.live(), 0
    for i in range(200):
        live.push({"lift": [0.0, i / 400]})
        seen += live.poll() is not None
    shape = live.finish()
    np.testing.assert_array_equal(shape.points, here.pipeline.points({"lift": [0.0, 199 / 400]}))
    assert shape.connectivity == case.connectivity and shape.faces is None
    assert seen + 1 <= 200 and not live.is_busy
    live.push({"lift": [9.0, 0.0]})
    assert refused(live.finish).code == "parameter"


def test_many_clients_get_each_their_own(path, keeper, folder, here):
    want = {i: np.asarray(here.pipeline.points({"lift": [i / 10, 0.0]})) for i in range(6)}
    problems = []

    def work(i):
        try:
            with Client.connect(path) as one:
                case = one.open(folder / "one.toml")
                for _ in range(10):
                    np.testing.assert_array_equal(case.points({"lift": [i / 10, 0.0]}), want[i])
        except Exception as error:
            problems.append(error)

    threads = [threading.Thread(target=work, args=(i,)) for i in want]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not problems


def raw(path):
    """A connection without manners."""
    link = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    link.settimeout(20)
    link.connect(str(path))
    return link


def greeted(path):
    """One that was let in."""
    link = raw(path)
    wire.send(link, protocol.encode({"id": 0, "op": "hello", "protocol": protocol.PROTOCOL}))
    assert wire.receive(link)[0]["ok"]
    return link


def frame(text, body=b""):
    """A frame of any header."""
    return protocol.PREFIX.pack(protocol.MAGIC, len(text), len(body)) + text + body


def told(link):
    """The code of an answer."""
    link.settimeout(20)
    return wire.receive(link)[0]["error"]["code"]


def test_malformed_frames_are_told_and_hurt_nobody_else(path, case):
    with greeted(path) as link:
        for text in (b"{", b"[]", b"\xff", b'{"op": "ping"}', b'{"id": 1}', b"{}"):
            link.sendall(frame(text, b"12345678"))
            assert told(link) in ("malformed", "unknown operation")
        link.sendall(frame(b'{"id": 1, "op": "ping"}'))
        assert wire.receive(link)[0]["ok"]
        link.sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert told(link) == "malformed"
        assert link.recv(1) == b""
    with greeted(path) as link:
        link.sendall(protocol.PREFIX.pack(protocol.MAGIC, 20, 2**63))
        assert told(link) == "too large"
    with raw(path) as link:  # who has not said who it is may send little
        link.sendall(protocol.PREFIX.pack(protocol.MAGIC, 2**20, 0))
        assert told(link) == "too large"
    assert case.points(LIFT).shape == (N, 3)


def exchange(client, header):
    """An answer to a header that a client of ours would not write."""
    wire.send(client.ensure(), protocol.encode(header))
    problem = wire.problem_of(wire.receive(client.ensure())[0])
    if problem is not None:
        raise problem


def test_arrays_that_are_not_what_the_header_says_are_told(client, case):
    entry = {"name": "cotangent", "dtype": "<f8", "shape": [N, 3]}
    for bad in ({"shape": [-1]}, {"dtype": "|O"}, {"segment": "psm_other", "offset": 0}):
        ask = {"id": 1, "op": "pullback", "case": case.handle(), "arrays": [{**entry, **bad}]}
        assert refused(exchange, client, ask).code == "malformed"
    for into in (5, {"segment": "psm_other", "offset": 0, "size": 8}, {"offset": -1}):
        ask = {"id": 1, "op": "points", "case": case.handle(), "into": into}
        assert refused(exchange, client, ask).code == "malformed"


def test_the_page_tells_how_to_ask_without_a_client(path, keeper, folder, here):
    page = (Path(__file__).parents[2] / "docs/howto/server.md").read_text()
    (code,) = re.findall(r"```python\n(import json, socket.*?)```", page, re.S)
    code = code.replace("/tmp/moldline.sock", str(path))
    known = {}
    exec(code.replace("/home/me/case.toml", str(folder / "one.toml")), known)
    want = np.asarray(here.pipeline.points({"lift": [0.1, 0.0]}))
    (entry,) = known["header"]["arrays"]
    found = np.frombuffer(known["body"], entry["dtype"]).reshape(entry["shape"])
    np.testing.assert_array_equal(found, want)
    known["link"].close()
    named = {*re.findall(r"^\| `(\w+)` \|", page, re.M)}
    own = protocol.ASKED_OF_SERVER + protocol.ASKED_OF_CASE + protocol.ASKED_OF_WORKSHOP
    assert named == {"op", "hello", *own}


def test_another_protocol_is_told_which_one_is_spoken(path):
    with raw(path) as link:
        wire.send(link, protocol.encode({"id": 0, "op": "hello", "protocol": 99}))
        answer = wire.receive(link)[0]
        assert answer["error"]["code"] == "version"
        assert "the client speaks protocol 99" in answer["error"]["message"]


def test_a_client_that_is_killed_leaves_no_memory_and_no_work(path, case, folder):
    code = (
        "import sys, time; from moldline.server.client import Client\n"
        f"c = Client.connect({str(path)!r}); case = c.open({str(folder / 'one.toml')!r})\n"
        "c.expect(2**17); case.points()\n"
        "case.send('points'); print(c._places.segment, flush=True); time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as other:
        name = other.stdout.readline().strip()
        assert name.startswith("moldline_") and is_shared(name)
        other.kill()
    until(lambda: not is_shared(name))
    assert case.points(LIFT).shape == (N, 3)


def test_a_client_that_leaves_gives_its_memory_back(path, folder):
    with Client.connect(path) as client:
        name = client.request("share", size=2**16).header["segment"]
        assert is_shared(name)
        assert refused(client.request, "share", size=2**40).code == "too large"
    until(lambda: not is_shared(name))


def test_a_changed_file_is_another_case(tmp_path):
    case, mesh = tmp_path / "own.toml", tmp_path / "ball.tri"
    case.write_text(CASE)
    mesh.write_text("a")
    seen = {fingerprint({"path": str(case)})}
    mesh.write_text("changed")
    seen.add(fingerprint({"path": str(case)}))
    case.write_text(CASE + "\n")
    seen.add(fingerprint({"path": str(case)}))
    seen.add(fingerprint({"text": CASE, "folder": str(tmp_path)}))
    assert len(seen) == 4
    assert fingerprint({"path": str(case)}) in seen
    fingerprint({"path": str(tmp_path / "absent.toml")})  # who loads it says what is wrong


@pytest.mark.slow
def test_few_processes_serve_many_cases_and_rest_when_idle(folder, tmp_path):
    place = tmp_path / "socket"
    with serving("--socket", str(place), "--processes", "1", "--idle", "3"):
        until(place.exists)
        with Client.connect(place) as client:
            cases = [client.open(folder / f"{name}.toml") for name in ("one", "two")]
            for case in cases * 2:
                assert case.points(LIFT).shape == (N, 3)
                assert sum(one["pid"] is not None for one in client.cases()) == 1
            assert [one["loads"] for one in client.cases()] == [3, 3]
            until(lambda: not any(one["pid"] for one in client.cases()))
            assert cases[0].points(LIFT).shape == (N, 3)
