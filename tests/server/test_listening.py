"""How a server is reached, who may come in, and how it ends; without any case."""

import json
import signal
import socket
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest
from servers import is_shared, serving, until

from moldline.errors import FileError, ParameterError
from moldline.server import listening, protocol, wire
from moldline.server.client import Client
from moldline.server.protocol import ServerError


def mode(path):
    """Who may do what with a file."""
    return stat.S_IMODE(path.stat().st_mode)


def test_a_token_lets_in_who_knows_it_and_nobody_else(tmp_path):
    token, ready = tmp_path / "token", tmp_path / "ready"
    where = ["--port", "0", "--token-file", str(token), "--ready", str(ready)]
    with serving(*where, "--no-spare", "--allow-shutdown") as server:
        until(ready.exists)
        told = json.loads(ready.read_text())
        assert mode(token) == mode(ready) == 0o600
        assert told["token"] == token.read_text().strip() and len(told["token"]) > 20
        for wrong in (None, "", "x" * len(told["token"])):
            with pytest.raises(ServerError, match="token is missing or not") as found:
                Client.connect(port=told["port"], token=wrong)
            assert found.value.code == "token"
        with Client.connect(port=told["port"], token=told["token"]) as client:
            assert client.ping() < 10
            client.shutdown()
        assert server.wait(20) == 0
        assert "token" not in server.stdout.read().replace(f"token: in {token}", "")
    assert not ready.exists()


def test_other_machines_need_a_token(tmp_path, monkeypatch):
    ready = tmp_path / "ready"
    with serving("--host", "0.0.0.0", "--port", "0", "--ready", str(ready), "--no-spare") as server:
        until(ready.exists)
        told = json.loads(ready.read_text())
        made = Path(server.stdout.readline().strip().removeprefix("token: in "))
        assert mode(made) == 0o600 and made.read_text().strip() == told["token"]
        made.unlink()
        with pytest.raises(ServerError, match="token"):
            Client.connect(port=told["port"])


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_server_that_is_told_to_stop_leaves_nothing(tmp_path, number):
    path = tmp_path / "socket"
    with serving("--socket", str(path), "--no-spare") as server:
        until(path.exists)
        assert mode(path) == 0o600
        with Client.connect(path) as client:
            name = client.request("share", size=2**16).header["segment"]
            assert is_shared(name)
            server.send_signal(number)
            assert server.wait(20) == 0
            with pytest.raises(ServerError, match="does a server run there"):
                client.ping()
        assert not path.exists() and not is_shared(name)


def test_memory_is_removed_also_behind_a_server_that_was_killed(tmp_path):
    path = tmp_path / "socket"
    command = [sys.executable, "-m", "moldline", "serve", "--no-spare", "--socket", str(path)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as server:
        until(path.exists)
        with Client.connect(path) as client:
            name = client.request("share", size=2**16).header["segment"]
            server.kill()
            server.wait()
            until(lambda: not is_shared(name))
    with serving("--socket", str(path), "--no-spare"):  # the socket that was left is replaced
        until(lambda: answers(path))


def answers(path):
    """Whether a server is there."""
    try:
        Client.connect(path).close()
    except ServerError:
        return False
    return True


def test_a_token_that_others_may_read_is_refused(tmp_path):
    path = tmp_path / "token"
    path.write_text("secret")
    path.chmod(0o644)
    with pytest.raises(ParameterError, match="others may read"):
        listening.token_in(path)
    path.chmod(0o600)
    assert listening.token_in(path) == "secret"


def test_a_place_that_is_taken_is_refused(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(FileError, match="is no socket"), listening.at_path(tmp_path / "file"):
        pass
    with (
        listening.at_path(tmp_path / "socket"),
        pytest.raises(FileError, match="a server listens here already"),
        listening.at_path(tmp_path / "socket"),
    ):
        pass
    assert (tmp_path / "file").read_text() == "mine"


def test_a_client_starts_a_server_that_stops_without_clients(tmp_path):
    path = tmp_path / "socket"
    with Client.start(path, quit_after=0.1) as client, Client.start(path) as other:
        assert client.ping() < 10 and other.ping() < 10
        assert client.moldline == other.moldline != ""
    until(lambda: not path.exists())
    with pytest.raises(ServerError, match="ended at once"):
        Client.start(tmp_path / "absent" / "socket")


def test_a_client_connects_again_by_itself(tmp_path):
    path = tmp_path / "socket"
    with serving("--socket", str(path), "--no-spare"):
        until(path.exists)
        client = Client.connect(path)
        client.ping()
    with pytest.raises(ServerError) as found:
        client.ping()
    assert found.value.code == "disconnected"
    with serving("--socket", str(path), "--no-spare"):
        until(path.exists)
        assert client.ping() < 10
        client.close()


def test_an_answer_that_does_not_come_is_given_up():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        with pytest.raises(ServerError):
            Client.connect(port=port, timeout=0.2)


def test_a_client_needs_no_jax_and_none_of_moldline_beside_it(tmp_path):
    """Its files work where they are copied to."""
    own, source = tmp_path / "vendored", Path(protocol.__file__).parent
    own.mkdir()
    (own / "__init__.py").touch()
    for name in ("client", "remote", "live", "places", "starting", "shared", "wire", "protocol"):
        (own / f"{name}.py").write_bytes((source / f"{name}.py").read_bytes())
    code = (
        "import sys, vendored.client\n"
        "print([m for m in sys.modules if m.split('.')[0] in ('jax', 'moldline', 'scipy')])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_a_stalled_frame_is_not_waited_for_while_others_are_served(tmp_path):
    path = tmp_path / "socket"
    with serving("--socket", str(path), "--no-spare"):
        until(path.exists)
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as half, Client.connect(path) as one:
            half.connect(str(path))
            half.sendall(protocol.MAGIC)
            start = time.monotonic()
            assert one.ping() < 10 and time.monotonic() - start < 10
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as link:
            link.connect(str(path))
            wire.send(link, protocol.encode({"id": 0, "op": "ping"}))
            assert wire.receive(link)[0]["error"]["code"] == "malformed"
