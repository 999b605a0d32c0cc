"""Frames through a socket, in programs that embed Python as well."""

import os
import subprocess
import sys

import pytest

EMBEDDED = """
import signal, socket
from moldline.server import wire

signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # as in a program that embeds Python
ours, theirs = socket.socketpair()
theirs.close()
for pieces in ([b"small"], [b"small", bytes(2**17)]):
    try:
        wire.send(ours, pieces)
    except BrokenPipeError:
        print("told")
"""


@pytest.mark.skipif(os.name == "nt", reason="no SIGPIPE there")
def test_a_program_that_embeds_python_outlives_a_lost_server():
    done = subprocess.run([sys.executable, "-c", EMBEDDED], capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()) == (0, ["told", "told"]), done.stderr
